//! Stem, hand, loose, at rest: the life of every fruit of one tree.

use crate::bruise::{Bruise, Partner};
use crate::{FruitSet, Impact};
use orchard_geometry::{Pose, Vec3, transform};
use orchard_multibody::{Data, Model};
use orchard_spec::fruit::FruitSpec;
use serde::{Deserialize, Serialize};

/// What a fruit at rest lies on, directly or on other fruit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Resting {
    /// The robot's base or its bucket, at a point of the base frame [m].
    Base(Vec3),
    /// The ground, at a point of the world [m].
    Ground(Vec3),
}

/// What a fruit is doing, and who moves it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Phase {
    /// On its stem, in the model.
    Hanging,
    /// Off its stem and in the coupled solve of the model, as long as the hand is at it.
    InHand,
    /// Free of stem and hand, moved by the rigid-body engine.
    Free,
    /// Asleep: held where it rests until something moves it.
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
        /// How far it fell from where the hand (or its stem) let go to its first contact [m].
        drop_height: f64,
        /// Energy of the hardest impact on that way [J].
        impact_energy: f64,
    },
    /// Loose, it touched the ground for the first time since it left stem or bucket.
    Dropped {
        /// Index of the fruit.
        fruit: usize,
        /// Its speed just before [m/s].
        speed: f64,
    },
    /// The hardest impact of a fruit in this frame, where it is over the floor of reporting.
    Struck(Impact),
}

/// The way of a fruit since stem or hand let it go.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Fall {
    /// Height of its centre then [m], world.
    from: f64,
    /// How far it had fallen at its first contact [m].
    height: Option<f64>,
    /// Hardest impact since [J].
    energy: f64,
}

/// Counters and phase of one fruit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Life {
    phase: Phase,
    pull_frames: u32,
    tension_frames: u32,
    quiet_frames: u32,
    free_frames: u32,
    dropped: bool,
    deposited: bool,
    speed_before: f64,
    fall: Fall,
    bruise: Bruise,
    /// Hardest impact of the present frame.
    struck: Option<(Partner, f64)>,
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
    /// It touched the ground in this frame.
    pub ground: bool,
    /// A finger touches it.
    pub finger: bool,
    /// Hand or finger touches it.
    pub hand: bool,
    /// Both fingers, or a finger and the hand, are near enough to hold it.
    pub graspable: bool,
    /// Its centre is inside the bucket.
    pub in_bucket: bool,
    /// The robot's base carries it: it is in the bucket or lies on the chassis.
    pub on_base: bool,
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
            free_frames: 0,
            dropped: false,
            deposited: false,
            speed_before: 0.0,
            fall: Fall::default(),
            bruise: Bruise::default(),
            struck: None,
        };
        Self { lives: vec![life; set.len()], frame_peak: 0.0, peak: 0.0 }
    }

    /// Whether this is the state of as many fruit.
    pub fn fits(&self, set: &FruitSet) -> bool {
        let partner_fits = |p: &Partner| !matches!(p, Partner::Fruit(i) if *i >= set.len());
        let bruise_fits = |life: &Life| life.bruise.peak_partner.iter().all(partner_fits);
        self.lives.len() == set.len() && self.lives.iter().all(bruise_fits)
    }

    /// Phase of a fruit.
    pub fn phase(&self, fruit: usize) -> Phase {
        self.lives[fruit].phase
    }

    /// Whether any fruit is off its stem.
    pub fn any_off_stem(&self) -> bool {
        self.lives.iter().any(|life| life.phase != Phase::Hanging)
    }

    /// Whether a fruit has touched the ground since it left its stem, or since it last lay in the bucket.
    pub fn has_dropped(&self, fruit: usize) -> bool {
        self.lives[fruit].dropped
    }

    /// Whether a fruit lies in the bucket and has come to rest there.
    pub fn is_deposited(&self, fruit: usize) -> bool {
        self.lives[fruit].deposited
    }

    /// Whether a fruit has been still for as long as the rest rule asks.
    pub fn is_quiet(&self, fruit: usize, rest: RestRule) -> bool {
        self.lives[fruit].quiet_frames >= rest.frames
    }

    /// What a fruit has suffered.
    pub fn bruise(&self, fruit: usize) -> Bruise {
        self.lives[fruit].bruise
    }

    /// Largest stem tension of any fruit in the latest whole frame [N].
    pub fn peak_tension(&self) -> f64 {
        self.peak
    }

    /// Notes a pressing contact of a substep with something hard; the energy [J] is that of the approach before it.
    /// `z_world` is the height of the fruit's centre [m].
    pub fn strike(&mut self, fruit: usize, partner: Partner, energy: f64, z_world: f64) {
        let life = &mut self.lives[fruit];
        life.bruise.strike(partner, energy);
        if life.struck.is_none_or(|(_, hardest)| energy > hardest) {
            life.struck = Some((partner, energy));
        }
        if partner != Partner::Hand {
            life.fall.height.get_or_insert((life.fall.from - z_world).max(0.0));
            life.fall.energy = life.fall.energy.max(energy);
        }
    }

    /// Notes the normal force of one finger on a fruit in a substep [N].
    pub fn squeeze(&mut self, fruit: usize, force: f64) {
        self.lives[fruit].bruise.squeeze(force);
    }

    /// Lets a fruit sleep where it is.
    pub fn sleep(&mut self, fruit: usize, resting: Resting) {
        self.lives[fruit].phase = Phase::Asleep(resting);
    }

    /// Wakes a sleeping fruit.
    pub fn wake(&mut self, fruit: usize) {
        let life = &mut self.lives[fruit];
        if matches!(life.phase, Phase::Asleep(_)) {
            life.phase = Phase::Free;
            life.quiet_frames = 0;
        }
    }

    /// Ends a substep: notes stem tensions, and holds sleeping fruit where it rests; the base carries its fruit along.
    pub fn end_substep(
        &mut self,
        set: &FruitSet,
        model: &Model,
        data: &mut Data,
        x_world_base: &Pose,
        base_velocity: impl Fn(&Vec3) -> Vec3,
    ) {
        for (i, life) in self.lives.iter().enumerate() {
            match life.phase {
                Phase::Hanging => {
                    let tension = data.tether_spring_force(model, set.points[i]).norm();
                    self.frame_peak = self.frame_peak.max(tension);
                }
                Phase::InHand | Phase::Free => {}
                Phase::Asleep(resting) => {
                    let point = set.points[i].index();
                    (data.point_p_world[point], data.point_v_world[point]) = match resting {
                        Resting::Base(p_base) => {
                            let p_world = transform(x_world_base, &p_base);
                            (p_world, base_velocity(&p_world))
                        }
                        Resting::Ground(p_world) => (p_world, Vec3::zeros()),
                    };
                }
            }
        }
    }

    /// Ends a frame: tests the two detachment paths of hanging fruit and the rest rule of loose fruit.
    ///
    /// `touch` is per fruit; `base_velocity` (point velocity in the world, [m/s]) says how the base moves.
    #[expect(clippy::too_many_arguments, reason = "one call a frame, each input a different kind of thing")]
    pub fn end_frame(
        &mut self,
        set: &FruitSet,
        model: &Model,
        data: &mut Data,
        spec: &FruitSpec,
        touch: &[Touch],
        rest: RestRule,
        base_velocity: impl Fn(&Vec3) -> Vec3,
    ) -> Vec<FruitEvent> {
        let mut events = Vec::new();
        self.peak = std::mem::take(&mut self.frame_peak);
        for (i, life) in self.lives.iter_mut().enumerate() {
            let point = set.points[i].index();
            if let Some((partner, energy)) = life.struck.take()
                && energy > spec.impact_floor.si()
            {
                events.push(FruitEvent::Struck(Impact { fruit: i, partner, energy }));
            }
            if life.phase == Phase::Hanging {
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
                    life.phase = Phase::InHand;
                    life.let_go(&data.point_p_world[point]);
                    set.detach(data, i);
                    events.push(FruitEvent::Detached { fruit: i, tension });
                }
                continue;
            }
            let (p_world, v_world) = (data.point_p_world[point], data.point_v_world[point]);
            let carrier = if touch[i].on_base { base_velocity(&p_world) } else { Vec3::zeros() };
            life.judge(i, &touch[i], rest, &p_world, &v_world, &carrier, &mut events);
        }
        events
    }

    /// After [`FruitLives::end_frame`], where there is an engine: settles who moves each loose fruit from here on. It changes
    /// hands with its position, velocity and spin as they are.
    pub fn hand_over(&mut self, set: &FruitSet, data: &mut Data, spec: &FruitSpec, touch: &[Touch]) {
        for (i, life) in self.lives.iter_mut().enumerate() {
            match life.phase {
                Phase::Hanging => {}
                Phase::InHand => {
                    let at_hand = touch[i].hand || touch[i].graspable;
                    life.free_frames = if at_hand { 0 } else { life.free_frames + 1 };
                    if life.free_frames >= spec.hand_over_frames.get() {
                        life.phase = Phase::Free;
                        set.pass_to_engine(data, i);
                    }
                }
                Phase::Free | Phase::Asleep(_) => {
                    if touch[i].graspable {
                        (life.phase, life.free_frames) = (Phase::InHand, 0);
                        set.take_back(data, i);
                    }
                }
            }
        }
    }
}

impl Life {
    /// Its way begins here.
    fn let_go(&mut self, p_world: &Vec3) {
        self.fall = Fall { from: p_world.z, ..Fall::default() };
    }

    /// Whether a fruit off its stem has dropped, come to rest, been deposited.
    #[expect(clippy::too_many_arguments, reason = "one call, each input a different kind of thing")]
    fn judge(
        &mut self,
        fruit: usize,
        touch: &Touch,
        rest: RestRule,
        p_world: &Vec3,
        v_world: &Vec3,
        v_carrier: &Vec3,
        events: &mut Vec<FruitEvent>,
    ) {
        if touch.finger {
            self.let_go(p_world);
        }
        if touch.ground && !self.dropped {
            self.dropped = true;
            events.push(FruitEvent::Dropped { fruit, speed: self.speed_before });
        }
        let quiet = !touch.finger && (v_world - v_carrier).norm() < rest.speed;
        self.quiet_frames = if quiet { self.quiet_frames.saturating_add(1) } else { 0 };
        if !touch.in_bucket {
            self.deposited = false;
        } else if !self.deposited && self.quiet_frames >= rest.frames {
            (self.deposited, self.dropped) = (true, false);
            let Fall { height, energy, .. } = self.fall;
            let drop_height = height.unwrap_or(0.0);
            events.push(FruitEvent::Deposited { fruit, drop_height, impact_energy: energy });
        }
        self.speed_before = v_world.norm();
    }
}
