//! The fruit of one tree in a multibody model.

use crate::stem::{StemLoad, Stems};
use crate::{Ball, Fruit};
use orchard_geometry::{Pose, Shape, Vec3};
use orchard_multibody::{
    BodyId, Collider, ColliderId, Data, Groups, Model, ModelBuilder, Owner, PointBody, PointId, Tether,
};
use orchard_spec::fruit::FruitSpec;
use orchard_treegen::Skeleton;
use std::f64::consts::PI;

/// Collision groups of fruit in the model.
#[derive(Debug, Clone, Copy)]
pub struct FruitGroups {
    /// On the stem.
    pub hanging: Groups,
    /// Off the stem, in the coupled solve.
    pub loose: Groups,
    /// Moved by the rigid-body engine, or at rest: an obstacle for fruit in the hand.
    pub passed: Groups,
}

/// The fruit of one tree with their point bodies and colliders. Arrays are per fruit.
#[derive(Debug, Clone)]
pub struct FruitSet {
    /// The fruit as they grew.
    pub fruit: Vec<Fruit>,
    /// Point bodies.
    pub points: Vec<PointId>,
    /// Colliders.
    pub colliders: Vec<ColliderId>,
    /// Collision groups.
    pub groups: FruitGroups,
    pub(crate) stems: Option<Stems>,
    quadratic_drag: Vec<f64>,
    rolling_loss: f64,
    restitution: f64,
    friction: f64,
}

impl FruitSet {
    /// Adds one tethered point body a fruit, and a stem between it and its segment where the spec has stems; `segments` are the links
    /// of the skeleton's segments.
    pub fn add_to(
        builder: &mut ModelBuilder,
        fruit: Vec<Fruit>,
        segments: &[BodyId],
        skeleton: &Skeleton,
        spec: &FruitSpec,
        gravity: f64,
        groups: FruitGroups,
    ) -> Self {
        let stem = spec.stem.as_ref();
        let stems =
            stem.map(|stem| Stems::add_to(builder, &fruit, segments, skeleton, (spec, stem), gravity));
        let (mut points, mut colliders, mut quadratic_drag) = (Vec::new(), Vec::new(), Vec::new());
        for (i, f) in fruit.iter().enumerate() {
            let length = spec.stem_length.si() + f.radius;
            let damping = |stiffness: f64, ratio: f64| 2.0 * ratio * (stiffness * f.mass).sqrt();
            let tether = match &stems {
                Some(Stems { spec, bodies, .. }) => Tether {
                    body: bodies[i],
                    p_body: Vec3::new(0.0, 0.0, length),
                    offset_world: Vec3::zeros(),
                    stiffness: spec.stiffness.si(),
                    damping: damping(spec.stiffness.si(), spec.damping_ratio.si()),
                    anchor_bias_world: Vec3::zeros(),
                    reaction_cap: f64::INFINITY,
                    turns: true,
                },
                None => Tether {
                    body: segments[f.segment],
                    p_body: f.p_segment,
                    offset_world: Vec3::new(0.0, 0.0, -length),
                    stiffness: spec.stem_stiffness.si(),
                    damping: damping(spec.stem_stiffness.si(), spec.stem_damping_ratio.si()),
                    anchor_bias_world: Vec3::new(
                        0.0,
                        0.0,
                        if spec.weight_compensated { f.mass * gravity } else { 0.0 },
                    ),
                    reaction_cap: spec.reaction_cap.si(),
                    turns: false,
                },
            };
            let point = builder.add_point(PointBody {
                mass: f.mass,
                spin_inertia: f.spin_inertia(),
                tether: Some(tether),
            });
            points.push(point);
            colliders.push(builder.add_collider(Collider {
                owner: Owner::Point(point),
                shape: Shape::Sphere { radius: f.radius },
                x_owner_shape: Pose::identity(),
                groups: groups.hanging,
                friction: spec.friction.si(),
                stiffness: spec.contact_stiffness.si(),
            }));
            // F = 1/2 rho C_d A |v| v.
            let area = PI * f.radius * f.radius;
            quadratic_drag.push(0.5 * spec.air_density.si() * spec.drag_coefficient.si() * area);
        }
        Self {
            fruit,
            points,
            colliders,
            groups,
            stems,
            quadratic_drag,
            rolling_loss: spec.rolling_loss.si(),
            restitution: spec.restitution.si(),
            friction: spec.friction.si(),
        }
    }

    /// Load of a fruit on the zone at the end of its stem; `None` on a tether. Holds while the fruit is on its stem.
    pub fn stem_load(&self, model: &Model, data: &Data, fruit: usize) -> Option<StemLoad> {
        self.stems.as_ref().map(|stems| stems.load(model, data, fruit, self.points[fruit]))
    }

    /// Load of the stem that a fruit hangs on over its strength \[1\]: the larger of those of its zone and its spur; on a tether, tension over the
    /// pull that detaches the fruit. Holds while the fruit is on its stem.
    pub fn stem_load_share(&self, model: &Model, data: &Data, fruit: usize) -> f64 {
        let (own, point) = (&self.fruit[fruit], self.points[fruit]);
        match &self.stems {
            Some(stems) => {
                let [zone, spur] = stems.load(model, data, fruit, point).over(own, &stems.spec.release);
                zone.max(spur)
            }
            None => data.tether_spring_force(model, point).norm() / own.detach_force,
        }
    }

    /// Raises the strengths of fruit whose stems bear more than `release.rest_load` in the state of a tree at rest. On tethers nothing changes.
    pub fn strengthen_to_hang(&mut self, model: &Model, data: &Data) {
        let Some(stems) = &self.stems else { return };
        for (i, (fruit, point)) in self.fruit.iter_mut().zip(&self.points).enumerate() {
            let rule = &stems.spec.release;
            let [zone, spur] = stems.load(model, data, i, *point).over(fruit, rule);
            let [zone, spur] = [zone, spur].map(|u| (u / rule.rest_load.si()).max(1.0));
            fruit.detach_force *= zone;
            fruit.twist_strength *= zone;
            fruit.spur_strength *= spur;
        }
    }

    /// Fruit that overlap one of lower number by more than a share of both their radii, as they hang; one that is listed itself does not count.
    pub fn inside_others(&self, data: &Data, share: f64) -> Vec<usize> {
        let mut inside = Vec::new();
        for i in 0..self.len() {
            let reaches = |j: usize| {
                let reach = self.fruit[i].radius + self.fruit[j].radius;
                let [a, b] = [i, j].map(|k| data.point_p_world[self.points[k].index()]);
                (a - b).norm() < (1.0 - share) * reach
            };
            if (0..i).any(|j| reaches(j) && inside.binary_search(&j).is_err()) {
                inside.push(i);
            }
        }
        inside
    }

    /// The link of a fruit's stem; `None` on a tether.
    pub fn stem(&self, fruit: usize) -> Option<BodyId> {
        self.stems.as_ref().map(|stems| stems.bodies[fruit])
    }

    /// Damping of a fruit's stem in bending and in twist [N m s/rad]; 0 on a tether.
    pub fn stem_damping(&self, fruit: usize) -> [f64; 2] {
        self.stems.as_ref().map_or([0.0; 2], |stems| stems.damping[fruit])
    }

    /// Point body, segment and radius \[m\] of each fruit.
    pub fn balls(&self) -> impl Iterator<Item = (PointId, usize, f64)> {
        self.points.iter().zip(&self.fruit).map(|(point, fruit)| (*point, fruit.segment, fruit.radius))
    }

    /// Number of fruit.
    pub fn len(&self) -> usize {
        self.fruit.len()
    }

    /// True if the tree bears no fruit.
    pub fn is_empty(&self) -> bool {
        self.fruit.is_empty()
    }

    /// Air drag of a fruit off its stem [N s^2/m^2]: the force `-coefficient * |v| v`.
    pub fn air_drag(&self, fruit: usize) -> f64 {
        self.quadratic_drag[fruit]
    }

    /// The ball of a fruit for the rigid-body engine, with its present motion.
    pub fn ball(&self, data: &Data, fruit: usize) -> Ball {
        let (point, grown) = (self.points[fruit].index(), &self.fruit[fruit]);
        Ball {
            fruit,
            radius: grown.radius,
            mass: grown.mass,
            p_world: data.point_p_world[point],
            v_world: data.point_v_world[point],
            w_world: data.point_w_world[point],
            force_world: data.point_force_world[point],
            quadratic_drag: self.quadratic_drag[fruit],
            rolling_loss: self.rolling_loss,
            restitution: self.restitution,
            friction: self.friction,
        }
    }

    /// Hangs every fruit on its stem, without air drag (the wood's drag surrogate and the stem damp it there).
    pub fn reset(&self, model: &Model, data: &mut Data) {
        if let Some(stems) = &self.stems {
            stems.reset(model, data);
        }
        for i in 0..self.len() {
            let point = self.points[i].index();
            data.tethered[point] = true;
            data.point_quadratic_drag[point] = 0.0;
            data.point_spin_damping[point] = self.rolling_loss;
            data.groups[self.colliders[i].index()] = self.groups.hanging;
        }
    }

    /// Applies the full load of their fruit to broken limbs. The paper's rules compensate the weight on live wood, and cap the
    /// reaction so that a yank cannot snap more of it; a capped, and so one-way, reaction would keep shaking a limb that hangs
    /// free.
    pub fn weigh_on(&self, data: &mut Data, is_debris: impl Fn(usize) -> bool) {
        for (fruit, point) in self.fruit.iter().zip(&self.points) {
            if is_debris(fruit.segment) {
                data.anchor_bias_world[point.index()] = Vec3::zeros();
                data.reaction_cap[point.index()] = f64::INFINITY;
            }
        }
    }

    /// Takes a fruit off its stem: one flag, no model edit. Position and momentum do not change.
    pub(crate) fn detach(&self, data: &mut Data, i: usize) {
        let point = self.points[i].index();
        data.tethered[point] = false;
        if let Some(stems) = &self.stems {
            data.point_w_world[point] = data.velocity(stems.bodies[i]).angular;
        }
        data.point_quadratic_drag[point] = self.quadratic_drag[i];
        data.groups[self.colliders[i].index()] = self.groups.loose;
    }

    /// Hands a fruit over to the rigid-body engine: to the model it is then a point with a given motion.
    pub(crate) fn pass_to_engine(&self, data: &mut Data, i: usize) {
        data.point_carried[self.points[i].index()] = true;
        data.groups[self.colliders[i].index()] = self.groups.passed;
    }

    /// Takes a fruit back into the coupled solve, with its present motion.
    pub(crate) fn take_back(&self, data: &mut Data, i: usize) {
        data.point_carried[self.points[i].index()] = false;
        data.groups[self.colliders[i].index()] = self.groups.loose;
    }
}
