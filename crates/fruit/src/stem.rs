//! Stems that bend, twist and pull taut, and the rule by which they come off.
//!
//! A stem is a link without mass on a ball joint at the spur ([`orchard_multibody::JointKind::Ball`]): a rod that bends and twists there and
//! is straight from there to the fruit. It holds the fruit's rotational inertia; the fruit's mass sits at its end. Together they are a
//! compound pendulum. At the spur lies the abscission zone, with the axis n in which the stem grew. With T the tension along the stem,
//! theta the angle between the stem and n, and M the torque of the twisted stem, the zone bears the load
//!
//! `u^2 = (T cos theta / F)^2 + (T sin theta / (s F))^2 + (M / Q)^2`,
//!
//! a quadratic criterion as that of a cohesive zone under mixed modes (Camanho and Dávila 2002, eq. 4), with the strengths F along the axis, s F
//! across it and Q in twist; past a right angle the whole pull is across. Tissue bears a load u for `t / u^n`, so that a share
//! `h u^n / t` of its life passes in a substep h (linear damage: Gerhards 1977); the stem gives way when the life has passed.

use crate::Fruit;
use orchard_geometry::{Mat3, Pose, Rotation, Vec3, math};
use orchard_multibody::{Body, BodyId, Data, JointKind, Model, ModelBuilder, PointId, SpatialInertia};
use orchard_spec::fruit::{FruitSpec, ReleaseSpec, StemSpec};
use orchard_treegen::Skeleton;
use serde::{Deserialize, Serialize};

/// Way in which a fruit came off its tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Release {
    /// The stem was pulled off along the axis of its zone.
    Pull,
    /// It was pulled off across that axis.
    Bend,
    /// It was twisted off.
    Twist,
    /// The spur tore off with it, and next year's buds with that.
    Spur,
}

/// Loads on the zone at the end of a stem, and on its spur.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StemLoad {
    /// Tension along the stem \[N\]; 0 where the stem is pushed.
    pub tension: f64,
    /// Component along the axis of the zone \[N\].
    pub along: f64,
    /// Component across that axis \[N\].
    pub across: f64,
    /// Torque about the stem [N m].
    pub torque: f64,
}

impl StemLoad {
    /// Loads u over the strengths of a fruit: of its zone, and of its spur.
    pub(crate) fn over(&self, fruit: &Fruit, rule: &ReleaseSpec) -> [f64; 2] {
        Shares::of(self, fruit, rule).loads()
    }
}

/// Life \[s\] of a stem under the load below which batches of trees leave wear out. What is left out adds up to a life in twelve days.
const LONGEST_LIFE: f64 = 1e6;

/// Load over the strength that a stem bears for a million seconds: batches of trees count wear from there on.
pub fn least_load(rule: &ReleaseSpec) -> f64 {
    math::pow(rule.hold_time.si() / LONGEST_LIFE, 1.0 / rule.rate_exponent.si())
}

/// Loads over the strengths of one fruit.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shares {
    /// Of the zone, by mode: pull, bend, twist.
    zone: [f64; 3],
    spur: f64,
}

impl Shares {
    /// Loads over strengths.
    pub fn of(load: &StemLoad, fruit: &Fruit, rule: &ReleaseSpec) -> Self {
        let pull = fruit.detach_force;
        Self {
            zone: [
                load.along / pull,
                load.across / (rule.bent.si() * pull),
                load.torque / fruit.twist_strength,
            ],
            spur: load.tension / fruit.spur_strength,
        }
    }

    /// u of the zone, and of the spur.
    fn loads(&self) -> [f64; 2] {
        [self.zone.iter().map(|share| share * share).sum::<f64>().sqrt(), self.spur]
    }

    /// Shares of the lives of zone and spur that pass in a substep \[1\].
    pub fn wear(&self, rule: &ReleaseSpec, substep: f64) -> [f64; 2] {
        let share = substep / rule.hold_time.si();
        self.loads().map(|u| share * math::pow(u, rule.rate_exponent.si()))
    }

    /// The mode with the largest share of the zone's load.
    pub fn mode(&self) -> Release {
        let [pull, bend, twist] = self.zone;
        if twist > pull.max(bend) {
            Release::Twist
        } else if bend > pull {
            Release::Bend
        } else {
            Release::Pull
        }
    }
}

/// Used-up shares of the lives of a stem's zone and of its spur.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct StemLife {
    wear: [f64; 2],
    /// Way in which the stem gave way, and the tension then \[N\].
    gave_way: Option<(Release, f64)>,
}

impl StemLife {
    /// Wears zone and spur under the load of a substep of length `h` \[s\], and notes how they gave way. True from then on until that is taken.
    pub fn bear(&mut self, load: &StemLoad, fruit: &Fruit, rule: &ReleaseSpec, h: f64) -> bool {
        let shares = Shares::of(load, fruit, rule);
        for (sum, part) in self.wear.iter_mut().zip(shares.wear(rule, h)) {
            *sum += part;
        }
        let [zone, spur] = self.wear;
        if self.gave_way.is_none() && zone.max(spur) >= 1.0 {
            self.gave_way = Some((if spur > zone { Release::Spur } else { shares.mode() }, load.tension));
        }
        self.gave_way.is_some()
    }

    /// Shares of the lives of zone and spur that have passed.
    pub fn wear(&self) -> [f64; 2] {
        self.wear
    }

    /// Sets them, where a stem was worn elsewhere.
    pub fn set_wear(&mut self, wear: [f64; 2]) {
        self.wear = wear;
    }

    /// Takes how the stem gave way, and its tension then \[N\]; `None` if it has not.
    pub fn take_gave_way(&mut self) -> Option<(Release, f64)> {
        self.gave_way.take()
    }
}

/// The stems of a tree in a model. Arrays are per fruit.
#[derive(Debug, Clone)]
pub(crate) struct Stems {
    pub spec: StemSpec,
    pub bodies: Vec<BodyId>,
    /// Damping of bending and twist [N m s/rad].
    pub damping: Vec<[f64; 2]>,
}

impl Stems {
    /// Adds a stem for each fruit, hanging straight down from its anchor on the unloaded tree.
    pub fn add_to(
        builder: &mut ModelBuilder,
        fruit: &[Fruit],
        segments: &[BodyId],
        skeleton: &Skeleton,
        (spec, stem): (&FruitSpec, &StemSpec),
        gravity: f64,
    ) -> Self {
        let mut stems = Self { spec: stem.clone(), bodies: Vec::new(), damping: Vec::new() };
        let down = Rotation::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
        for f in fruit {
            let spin = f.spin_inertia();
            let r_segment_stem = skeleton.segments[f.segment].r_world_segment.inverse() * down;
            stems.bodies.push(builder.add_body(Body {
                parent: Some(segments[f.segment]),
                joint: JointKind::Ball,
                x_parent_joint: Pose::from_parts(f.p_segment.into(), r_segment_stem),
                inertia: SpatialInertia { mass: 0.0, p_com: Vec3::zeros(), i_com: Mat3::identity() * spin },
            }));
            let length = spec.stem_length.si() + f.radius;
            let swing = spin + f.mass * length * length;
            let bending = stem.bending_stiffness.si() + f.mass * gravity * length;
            let twice = 2.0 * stem.swing_damping_ratio.si();
            let critical = |stiffness: f64, inertia: f64| twice * (stiffness * inertia).sqrt();
            stems.damping.push([critical(bending, swing), critical(stem.twisting_stiffness.si(), spin)]);
        }
        stems
    }

    /// Writes springs and dampers of all stems into the inputs of the next step.
    pub fn reset(&self, model: &Model, data: &mut Data) {
        let [bending, twisting] =
            [&self.spec.bending_stiffness, &self.spec.twisting_stiffness].map(|k| k.si());
        for (body, [bend, twist]) in self.bodies.iter().zip(&self.damping) {
            let dofs = model.dofs(*body);
            data.stiffness[dofs.clone()].copy_from_slice(&[bending, bending, twisting]);
            data.damping[dofs].copy_from_slice(&[*bend, *bend, *twist]);
        }
    }

    /// Load that a fruit on its stem puts on the zone, as of the last kinematics.
    pub fn load(&self, model: &Model, data: &Data, fruit: usize, point: PointId) -> StemLoad {
        let body = self.bodies[fruit];
        let frame = &model.body(body).x_parent_joint.rotation;
        let parent =
            model.body(body).parent.map_or_else(Rotation::identity, |p| data.x_world_body(p).rotation);
        let axis = parent * (frame * Vec3::z());
        let stem = data.x_world_body(body).rotation * Vec3::z();
        // The spring pulls the fruit back; the stem feels the opposite.
        let tension = -data.tether_spring_force(model, point).dot(&stem);
        let torque = data
            .deflection(model, body)
            .map_or(0.0, |rod| rod.twist.abs() * self.spec.twisting_stiffness.si());
        if tension <= 0.0 {
            return StemLoad { torque, ..StemLoad::default() };
        }
        let cosine = axis.dot(&stem);
        let (along, across) = if cosine > 0.0 {
            (tension * cosine, tension * axis.cross(&stem).norm())
        } else {
            (0.0, tension)
        };
        StemLoad { tension, along, across, torque }
    }
}
