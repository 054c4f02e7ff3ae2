//! Stem, loose, at rest: the life of every fruit of one tree.

use crate::FruitSet;
use orchard_geometry::{Pose, Vec3, inverse_transform, transform};
use orchard_multibody::{Data, Model};
use orchard_spec::fruit::FruitSpec;
use serde::{Deserialize, Serialize};

/// Where a fruit rests for good.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Resting {
    /// In the bucket, at a point of the bucket's frame [m].
    Bucket(Vec3),
    /// On the ground, at a point of the world [m].
    Ground(Vec3),
}

/// What a fruit is doing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Phase {
    /// On its stem.
    Hanging,
    /// Off its stem: gripped, falling or rolling.
    Loose,
    /// Asleep: held where it rests.
    Asleep(Resting),
}

/// Something that happened to a fruit in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FruitEvent {
    /// The stem gave way.
    Detached {
        /// Index of the fruit.
        fruit: usize,
        /// Stem tension at that moment [N].
        tension: f64,
    },
    /// It came to rest in the bucket.
    Deposited {
        /// Index of the fruit.
        fruit: usize,
    },
    /// Loose, it touched the ground for the first time.
    Dropped {
        /// Index of the fruit.
        fruit: usize,
        /// Its speed just before [m/s].
        speed: f64,
    },
}

/// Counters and phase of one fruit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Life {
    phase: Phase,
    pull_frames: u32,
    tension_frames: u32,
    quiet_frames: u32,
    dropped: bool,
    speed_before: f64,
}

/// The state of every fruit of one tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FruitLives {
    lives: Vec<Life>,
    frame_peak: f64,
    peak: f64,
}

/// What the world tells about one fruit at the end of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Touch {
    /// It touches the ground.
    pub ground: bool,
    /// A finger touches it.
    pub finger: bool,
    /// Its centre is inside the bucket.
    pub in_bucket: bool,
}

/// Rest rule: slower than `speed` against what carries it for `frames` frames in a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestRule {
    /// Speed [m/s].
    pub speed: f64,
    /// Frames.
    pub frames: u32,
}

impl FruitLives {
    /// Everything hangs.
    pub fn new(set: &FruitSet) -> Self {
        let life = Life {
            phase: Phase::Hanging,
            pull_frames: 0,
            tension_frames: 0,
            quiet_frames: 0,
            dropped: false,
            speed_before: 0.0,
        };
        Self { lives: vec![life; set.len()], frame_peak: 0.0, peak: 0.0 }
    }

    /// Whether this is the state of as many fruit.
    pub fn fits(&self, set: &FruitSet) -> bool {
        self.lives.len() == set.len()
    }

    /// Phase of a fruit.
    pub fn phase(&self, fruit: usize) -> Phase {
        self.lives[fruit].phase
    }

    /// Whether a fruit has ever touched the ground off its stem.
    pub fn has_dropped(&self, fruit: usize) -> bool {
        self.lives[fruit].dropped
    }

    /// Largest stem tension of any fruit in the latest whole frame [N].
    pub fn peak_tension(&self) -> f64 {
        self.peak
    }

    /// Ends a substep: notes stem tensions, and holds sleeping fruit where it rests; a bucket carries its
    /// fruit along.
    pub fn end_substep(
        &mut self,
        set: &FruitSet,
        model: &Model,
        data: &mut Data,
        x_world_bucket: &Pose,
        bucket_velocity: impl Fn(&Vec3) -> Vec3,
    ) {
        for (i, life) in self.lives.iter().enumerate() {
            match life.phase {
                Phase::Hanging => {
                    let tension = data.tether_spring_force(model, set.points[i]).norm();
                    self.frame_peak = self.frame_peak.max(tension);
                }
                Phase::Loose => {}
                Phase::Asleep(resting) => {
                    let point = set.points[i].index();
                    (data.point_p_world[point], data.point_v_world[point]) = match resting {
                        Resting::Bucket(p_bucket) => {
                            let p_world = transform(x_world_bucket, &p_bucket);
                            (p_world, bucket_velocity(&p_world))
                        }
                        Resting::Ground(p_world) => (p_world, Vec3::zeros()),
                    };
                }
            }
        }
    }

    /// Ends a frame: tests the two detachment paths of hanging fruit and the rest rule of loose fruit.
    ///
    /// `touch` is per fruit; `x_world_bucket` and `bucket_velocity` (point velocity in the world, [m/s]) say
    /// where the bucket is and how it moves.
    #[expect(clippy::too_many_arguments, reason = "one call a frame, each input a different kind of thing")]
    pub fn end_frame(
        &mut self,
        set: &FruitSet,
        model: &Model,
        data: &mut Data,
        spec: &FruitSpec,
        touch: &[Touch],
        rest: RestRule,
        x_world_bucket: &Pose,
        bucket_velocity: impl Fn(&Vec3) -> Vec3,
    ) -> Vec<FruitEvent> {
        let mut events = Vec::new();
        self.peak = std::mem::take(&mut self.frame_peak);
        for (i, life) in self.lives.iter_mut().enumerate() {
            let point = set.points[i].index();
            match life.phase {
                Phase::Hanging => {
                    let tension = data.tether_spring_force(model, set.points[i]).norm();
                    let pull = data.point_force_world[point].norm();
                    let threshold = set.fruit[i].detach_force;
                    let count = |over: bool, frames: u32| if over { frames + 1 } else { 0 };
                    life.pull_frames = count(pull > threshold, life.pull_frames);
                    life.tension_frames =
                        count(tension > spec.tension_factor.si() * threshold, life.tension_frames);
                    if life.pull_frames >= spec.pull_frames.get()
                        || life.tension_frames >= spec.tension_frames.get()
                    {
                        life.phase = Phase::Loose;
                        set.detach(data, i);
                        events.push(FruitEvent::Detached { fruit: i, tension });
                    }
                }
                Phase::Loose => {
                    let p_world = data.point_p_world[point];
                    let v_world = data.point_v_world[point];
                    if touch[i].ground && !life.dropped {
                        life.dropped = true;
                        events.push(FruitEvent::Dropped { fruit: i, speed: life.speed_before });
                    }
                    let carrier = if touch[i].in_bucket { bucket_velocity(&p_world) } else { Vec3::zeros() };
                    let supported = touch[i].ground || touch[i].in_bucket;
                    let quiet = supported && !touch[i].finger && (v_world - carrier).norm() < rest.speed;
                    life.quiet_frames = if quiet { life.quiet_frames + 1 } else { 0 };
                    if life.quiet_frames >= rest.frames {
                        data.groups[set.colliders[i].index()] = set.groups.asleep;
                        data.point_carried[point] = true;
                        let resting = if touch[i].in_bucket {
                            events.push(FruitEvent::Deposited { fruit: i });
                            Resting::Bucket(inverse_transform(x_world_bucket, &p_world))
                        } else {
                            Resting::Ground(p_world)
                        };
                        life.phase = Phase::Asleep(resting);
                    }
                    life.speed_before = v_world.norm();
                }
                Phase::Asleep(_) => {}
            }
        }
        events
    }
}
