//! Time of the world against time of the clock.

/// Slowest and fastest time scale.
pub const SCALES: [f64; 2] = [0.1, 10.0];
/// Longest pause between two pictures that the world catches up with \[s\].
const CATCH_UP: f64 = 0.25;

/// Pace at which a world runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Pace {
    /// True while the world stands.
    pub paused: bool,
    scale: f64,
    /// Time that the world is behind \[s\], its own.
    owed: f64,
    /// Frames to step although the world stands.
    single: u32,
}

impl Default for Pace {
    fn default() -> Self {
        Self { paused: false, scale: 1.0, owed: 0.0, single: 0 }
    }
}

impl Pace {
    /// The time scale: 1 is real time.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Sets the time scale, within [`SCALES`].
    pub fn set_scale(&mut self, scale: f64) {
        if scale.is_finite() {
            self.scale = scale.clamp(SCALES[0], SCALES[1]);
        }
    }

    /// Pauses, and steps one frame at the next look.
    pub fn step_once(&mut self) {
        self.paused = true;
        self.single += 1;
    }

    /// Frames of `frame` \[s\] that are due after `elapsed` \[s\] of the clock.
    pub fn due(&mut self, elapsed: f64, frame: f64) -> u32 {
        let single = std::mem::take(&mut self.single);
        if self.paused {
            self.owed = 0.0;
            return single;
        }
        self.owed += elapsed.clamp(0.0, CATCH_UP) * self.scale;
        let due = (self.owed / frame + 1e-9).floor();
        self.owed = (self.owed - due * frame).max(0.0);
        due as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_frame_is_lost_and_none_is_invented() {
        let mut pace = Pace::default();
        let frames: u32 = (0..100).map(|_| pace.due(0.013, 1.0 / 60.0)).sum();
        assert_eq!(frames, 78);
        pace.set_scale(0.1);
        assert_eq!((0..60).map(|_| pace.due(1.0 / 60.0, 1.0 / 60.0)).sum::<u32>(), 6);
        pace.set_scale(f64::NAN);
        pace.set_scale(99.0);
        assert_eq!((pace.scale(), pace.due(1.0 / 60.0, 1.0 / 60.0)), (10.0, 10));
        // After a long stop the world does not race.
        assert!(pace.due(1e9, 1.0 / 60.0) <= 151);
    }

    #[test]
    fn a_paused_world_takes_single_steps() {
        let mut pace = Pace::default();
        pace.step_once();
        pace.step_once();
        assert_eq!((pace.due(1.0, 0.1), pace.due(1.0, 0.1)), (2, 0));
        pace.paused = false;
        assert_eq!(pace.due(0.1, 0.1), 1);
    }
}
