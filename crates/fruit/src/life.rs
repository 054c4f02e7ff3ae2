//! The state machine of one fruit: its states and the rule of every transition.
//!
//! A fruit's [`Phase`] says which solver moves it. [`FruitState`] is the state that a benchmark counts; it follows from the phase,
//! two flags, the limb and the fingers ([`FruitLives::state`](crate::FruitLives::state)).
//!
//! | from | to | rule | function |
//! |---|---|---|---|
//! | `Hanging` | `InHand` | the pull exceeds f_detach for `pull_frames` frames in a row, or the stem tension exceeds `tension_factor` f_detach for `tension_frames` frames | `Life::load_stem` |
//! | `Hanging` | `InHand` | on a stem that bends: zone or spur have worn out under their loads | `Life::come_off` |
//! | `InHand` | `Free` | for `hand_over_frames` frames neither touched by the hand nor graspable | `Life::end_frame_off_stem` |
//! | `Free`, `Asleep` | `InHand` | graspable | `Life::end_frame_off_stem` |
//! | `Free` | `Asleep` | its island is still and nothing moves it | [`Island::support`], `Life::sleep` |
//! | `Asleep` | `Free` | its support moves, or a moving body can reach it within the frame | [`WakeRule`], `Life::wake` |
//! | `Asleep` in the bucket | `Asleep` away, for good | the bucket is exchanged | `Life::take_away` |
//!
//! | flag | set | cleared | function |
//! |---|---|---|---|
//! | dropped | first touch of the ground off the stem | deposited | `Life::judge` |
//! | deposited | quiet in the bucket for as long as the rest rule asks | its centre leaves the bucket | `Life::judge` |
//! | gripped | both fingers touch it | no finger touches it | [`is_gripped`] |
//!
//! | [`FruitState`] | condition, the first that holds |
//! |---|---|
//! | `OnBrokenLimb` | `Hanging`, on a broken limb |
//! | `OnTree` | `Hanging` |
//! | `Held` | both fingers touch it |
//! | `Deposited` | deposited |
//! | `Dropped` | dropped |
//! | `Loose` | otherwise |

use crate::Impact;
use crate::bruise::{Bruise, Partner};
use crate::stem::{Release, StemLife};
use orchard_geometry::Vec3;
use orchard_spec::fruit::FruitSpec;
use serde::{Deserialize, Serialize};

/// Support of a fruit at rest, directly or through other fruit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Resting {
    /// The robot's base or its bucket, at a point of the base frame \[m\].
    Base(Vec3),
    /// The ground, at a point of the world \[m\].
    Ground(Vec3),
    /// Nothing: taken off the field with the bucket, and kept at a point of the world \[m\].
    Away(Vec3),
}

/// Solver that moves a fruit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Phase {
    /// On its stem, moved by the model.
    Hanging,
    /// Off its stem and at the hand, moved by the coupled solve of the model.
    InHand,
    /// Free of stem and hand, moved by the rigid-body engine.
    Free,
    /// Asleep: held where it rests until something moves it.
    Asleep(Resting),
}

/// State of a fruit as a benchmark counts it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FruitState {
    /// On its stem.
    OnTree,
    /// On its stem, on a broken limb.
    OnBrokenLimb,
    /// Off its stem, between both fingers.
    Held,
    /// Off its stem, in the air or in the bucket but not yet at rest; or lying on the robot beside the bucket.
    Loose,
    /// In the bucket, where it has come to rest.
    Deposited,
    /// It has touched the ground, and not come to rest in the bucket since.
    Dropped,
}

/// Event of one fruit in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LooseEvent {
    /// The stem gave way.
    Detached {
        /// Index of the fruit.
        fruit: usize,
        /// Stem tension at that moment \[N\].
        tension: f64,
        /// Way in which it came off; `None` on a tether, which knows one way.
        release: Option<Release>,
    },
    /// It came to rest in the bucket.
    Deposited {
        /// Index of the fruit.
        fruit: usize,
        /// Height that it fell from where the hand (or its stem) released it to its first contact \[m\].
        drop_height: f64,
        /// Energy of the hardest impact during that fall and until rest \[J\].
        impact_energy: f64,
    },
    /// Off its stem, it touched the ground for the first time since it left stem or bucket.
    Dropped {
        /// Index of the fruit.
        fruit: usize,
        /// Speed just before [m/s].
        speed: f64,
    },
    /// The hardest impact of a fruit in this frame, where its energy exceeds `fruit.impact_floor`.
    Struck(Impact),
}

/// Contacts of one fruit at the end of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Touch {
    /// It touched the ground in this frame.
    pub ground: bool,
    /// A finger touches it.
    pub finger: bool,
    /// Hand or finger touches it.
    pub hand: bool,
    /// Both fingers, or a finger and the hand, are near enough to hold it.
    pub graspable: bool,
    /// The fruit's centre is inside the bucket.
    pub in_bucket: bool,
    /// The robot's base carries it: it is in the bucket or lies on the chassis.
    pub on_base: bool,
}

/// Rest rule: slower than `speed` against its support for `frames` frames in a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestRule {
    /// Speed [m/s].
    pub speed: f64,
    /// Frames.
    pub frames: u32,
}

/// Rule by which a fast body wakes a sleeping fruit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WakeRule {
    /// Speed above which something counts as moving [m/s].
    pub speed: f64,
    /// Gap below which two resting fruit count as touching \[m\].
    pub touching_gap: f64,
    /// Length of a frame \[s\].
    pub frame_time: f64,
    /// Height of a free fall from rest within a frame \[m\].
    pub fall: f64,
}

impl WakeRule {
    /// True if a support that moves at a speed [m/s] wakes the fruit on it.
    pub fn is_shaken(&self, support_speed: f64) -> bool {
        support_speed > self.speed
    }

    /// Distance from the fruit's centre \[m\] within which a body that moves at `closing` [m/s] relative to the fruit's support can
    /// touch it in this frame; `None` if the body is slow. `radius` is that of the fruit \[m\].
    pub fn reach(&self, radius: f64, closing: f64) -> Option<f64> {
        (closing > self.speed).then_some(radius + self.touching_gap + closing * self.frame_time + self.fall)
    }

    /// True if two resting fruit touch: radii and distance of the centres \[m\].
    pub fn touches(&self, radius: f64, other_radius: f64, distance: f64) -> bool {
        distance < radius + other_radius + self.touching_gap
    }
}

/// Body that supports an island of resting fruit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    /// The robot's base or its bucket.
    Base,
    /// The ground, a post or a wire.
    Ground,
}

/// An island: fruit that touch each other, directly or through others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Island {
    /// Every fruit of the island sleeps or has been quiet for as long as the rest rule asks.
    pub is_still: bool,
    /// Arm or hand touches it.
    pub touches_arm: bool,
    /// It lies in the bucket or on the chassis.
    pub is_on_base: bool,
    /// It lies on the ground, a post or a wire.
    pub is_on_ground: bool,
    /// The base under it moves faster than the sleep speed.
    pub base_drives: bool,
}

impl Island {
    /// Support on which the island falls asleep; `None` if it stays awake.
    pub fn support(&self) -> Option<Support> {
        if !self.is_still || self.touches_arm || (self.is_on_base && self.base_drives) {
            None
        } else if self.is_on_base && !self.is_on_ground {
            Some(Support::Base)
        } else {
            Some(Support::Ground)
        }
    }
}

/// True if a fruit counts as gripped: both fingers touch it, or it was gripped and one still does.
pub fn is_gripped(was_gripped: bool, fingers: [bool; 2]) -> bool {
    let [one, other] = fingers;
    (one && other) || (was_gripped && (one || other))
}

/// Change of the solver that moves a fruit off its stem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HandOver {
    /// From the coupled solve to the rigid-body engine.
    ToEngine,
    /// From the rigid-body engine or from sleep to the coupled solve.
    ToHand,
}

/// Fall of a fruit since stem or hand released it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Fall {
    /// Height of its centre at the release \[m\], world.
    from: f64,
    /// Height that it had fallen at its first contact \[m\].
    height: Option<f64>,
    /// Hardest impact since the release \[J\].
    energy: f64,
}

/// Phase, flags and counters of one fruit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Life {
    pub phase: Phase,
    pull_frames: u32,
    tension_frames: u32,
    /// Of the stem.
    pub stem: StemLife,
    quiet_frames: u32,
    free_frames: u32,
    pub dropped: bool,
    pub deposited: bool,
    speed_before: f64,
    fall: Fall,
    pub bruise: Bruise,
    /// Hardest impact of the present frame.
    struck: Option<(Partner, f64)>,
}

impl Life {
    /// A fruit on its stem.
    pub fn hanging() -> Self {
        Self {
            phase: Phase::Hanging,
            pull_frames: 0,
            tension_frames: 0,
            stem: StemLife::default(),
            quiet_frames: 0,
            free_frames: 0,
            dropped: false,
            deposited: false,
            speed_before: 0.0,
            fall: Fall::default(),
            bruise: Bruise::default(),
            struck: None,
        }
    }

    /// State as a benchmark counts it.
    pub fn state(&self, on_broken_limb: bool, held: bool) -> FruitState {
        match self.phase {
            Phase::Hanging if on_broken_limb => FruitState::OnBrokenLimb,
            Phase::Hanging => FruitState::OnTree,
            _ if held => FruitState::Held,
            _ if self.deposited => FruitState::Deposited,
            _ if self.dropped => FruitState::Dropped,
            _ => FruitState::Loose,
        }
    }

    /// True if the fruit has been quiet for as long as the rest rule asks.
    pub fn is_quiet(&self, rest: RestRule) -> bool {
        self.quiet_frames >= rest.frames
    }

    /// Counts the frames of too large a load on the stem, and takes the fruit off it when they suffice. `pull` is the external
    /// force on the fruit \[N\], `tension` that of the stem \[N\], `threshold` f_detach \[N\]. True if the stem gave way.
    pub fn load_stem(
        &mut self,
        spec: &FruitSpec,
        pull: f64,
        tension: f64,
        threshold: f64,
        p_world: &Vec3,
    ) -> bool {
        let count = |over: bool, frames: u32| if over { frames + 1 } else { 0 };
        self.pull_frames = count(pull > threshold, self.pull_frames);
        self.tension_frames = count(tension > spec.tension_factor.si() * threshold, self.tension_frames);
        let gave_way =
            self.pull_frames >= spec.pull_frames.get() || self.tension_frames >= spec.tension_frames.get();
        if gave_way {
            self.phase = Phase::InHand;
            self.begin_fall(p_world);
        }
        gave_way
    }

    /// True if the fruit hangs and counts no frames over a limit, or sleeps on the ground; and if it has met nothing that is not told yet.
    pub fn is_calm(&self) -> bool {
        let is_quiet = match self.phase {
            Phase::Hanging => [self.pull_frames, self.tension_frames] == [0; 2],
            Phase::Asleep(Resting::Ground(_) | Resting::Away(_)) => true,
            Phase::InHand | Phase::Free | Phase::Asleep(Resting::Base(_)) => false,
        };
        is_quiet && self.struck.is_none()
    }

    /// Takes the fruit off a stem that gave way in this frame: how, and the tension then \[N\].
    pub fn come_off(&mut self, p_world: &Vec3) -> Option<(Release, f64)> {
        let gave_way = self.stem.take_gave_way();
        if gave_way.is_some() {
            self.phase = Phase::InHand;
            self.begin_fall(p_world);
        }
        gave_way
    }

    /// Hands a fruit off its stem over between hand and engine by the rules.
    pub fn end_frame_off_stem(&mut self, spec: &FruitSpec, touch: &Touch) -> Option<HandOver> {
        match self.phase {
            Phase::Hanging => None,
            Phase::InHand => {
                let at_hand = touch.hand || touch.graspable;
                self.free_frames = if at_hand { 0 } else { self.free_frames + 1 };
                (self.free_frames >= spec.hand_over_frames.get()).then(|| {
                    self.phase = Phase::Free;
                    HandOver::ToEngine
                })
            }
            Phase::Asleep(Resting::Away(_)) => None,
            Phase::Free | Phase::Asleep(_) => touch.graspable.then(|| {
                (self.phase, self.free_frames) = (Phase::InHand, 0);
                HandOver::ToHand
            }),
        }
    }

    /// Puts the fruit to sleep.
    pub fn sleep(&mut self, resting: Resting) {
        self.phase = Phase::Asleep(resting);
    }

    /// Takes a fruit that has come to rest in the bucket off the field for good, and keeps it at a point of the world \[m\].
    pub fn take_away(&mut self, p_world: Vec3) {
        self.phase = Phase::Asleep(Resting::Away(p_world));
    }

    /// True once it was taken off the field.
    pub fn is_away(&self) -> bool {
        matches!(self.phase, Phase::Asleep(Resting::Away(_)))
    }

    /// Wakes a sleeping fruit on the field; does nothing to another one.
    pub fn wake(&mut self) {
        if matches!(self.phase, Phase::Asleep(_)) && !self.is_away() {
            self.phase = Phase::Free;
            self.quiet_frames = 0;
        }
    }

    /// Notes an impact. `z_world` is the height of the fruit's centre \[m\]; impacts on the hand do not end a fall.
    pub fn strike(&mut self, partner: Partner, energy: f64, z_world: f64) {
        self.bruise.strike(partner, energy);
        if self.struck.is_none_or(|(_, hardest)| energy > hardest) {
            self.struck = Some((partner, energy));
        }
        if partner != Partner::Hand {
            self.fall.height.get_or_insert((self.fall.from - z_world).max(0.0));
            self.fall.energy = self.fall.energy.max(energy);
        }
    }

    /// Takes the hardest impact of the frame.
    pub fn take_struck(&mut self) -> Option<(Partner, f64)> {
        self.struck.take()
    }

    /// Updates the flags of a fruit off its stem. `v_support_world` is the velocity of what carries it [m/s].
    #[expect(clippy::too_many_arguments, reason = "one call, each input a different kind of thing")]
    pub fn judge(
        &mut self,
        fruit: usize,
        touch: &Touch,
        rest: RestRule,
        p_world: &Vec3,
        v_world: &Vec3,
        v_support_world: &Vec3,
        events: &mut Vec<LooseEvent>,
    ) {
        if self.is_away() {
            return;
        }
        if touch.finger {
            self.begin_fall(p_world);
        }
        if touch.ground && !self.dropped {
            self.dropped = true;
            events.push(LooseEvent::Dropped { fruit, speed: self.speed_before });
        }
        let quiet = !touch.finger && (v_world - v_support_world).norm() < rest.speed;
        self.quiet_frames = if quiet { self.quiet_frames.saturating_add(1) } else { 0 };
        if !touch.in_bucket {
            self.deposited = false;
        } else if !self.deposited && self.quiet_frames >= rest.frames {
            (self.deposited, self.dropped) = (true, false);
            let Fall { height, energy, .. } = self.fall;
            let drop_height = height.unwrap_or(0.0);
            events.push(LooseEvent::Deposited { fruit, drop_height, impact_energy: energy });
        }
        self.speed_before = v_world.norm();
    }

    /// Starts a new fall at the present height.
    fn begin_fall(&mut self, p_world: &Vec3) {
        self.fall = Fall { from: p_world.z, ..Fall::default() };
    }
}

#[cfg(test)]
#[path = "life_tests.rs"]
mod tests;
