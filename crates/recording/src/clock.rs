//! Times of messages: those of the simulation, in nanoseconds from the start of the episode.

use foxglove::messages::Timestamp;

const NANOSECONDS: f64 = 1e9;

/// A time of the simulation \[s\] as nanoseconds.
pub fn nanoseconds(time: f64) -> u64 {
    (time * NANOSECONDS).round() as u64
}

/// Nanoseconds as Foxglove writes a moment.
pub fn timestamp(nanoseconds: u64) -> Timestamp {
    let per_second = NANOSECONDS as u64;
    Timestamp::new((nanoseconds / per_second) as u32, (nanoseconds % per_second) as u32)
}

/// Counts frames.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    /// Length of a frame \[s\].
    pub frame: f64,
    /// Frames so far.
    pub frames: u32,
}

impl Clock {
    /// Time of the present frame \[ns\].
    pub fn now(&self) -> u64 {
        nanoseconds(f64::from(self.frames) * self.frame)
    }

    /// True if an action of a rate \[Hz\] is due in this frame; rates above the frame rate are due in every frame.
    pub fn is_due(&self, rate: f64) -> bool {
        let period = (1.0 / (rate * self.frame)).round().max(1.0) as u32;
        self.frames.is_multiple_of(period)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_and_rates() {
        let clock = |frames| Clock { frame: 1.0 / 60.0, frames };
        assert_eq!((clock(0).now(), clock(60).now(), clock(1).now()), (0, 1_000_000_000, 16_666_667));
        let stamp = timestamp(clock(61).now());
        assert_eq!((stamp.sec(), stamp.nsec()), (1, 16_666_667));
        let due = |rate| (0..8).filter(|&k| clock(k).is_due(rate)).collect::<Vec<u32>>();
        assert_eq!(due(30.0), [0, 2, 4, 6]);
        assert_eq!(due(60.0), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(due(1000.0).len(), 8);
        assert_eq!(due(1.0), [0]);
    }
}
