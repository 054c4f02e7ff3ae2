//! Reachability of fruit: the paper's sphere rule, and inverse kinematics.

use crate::World;
use crate::scenery::same_alley;
use orchard_geometry::{Pose, Rotation, Shape, Vec3, inverse_transform, math, transform};
use orchard_robot::{BaseJoint, IkTarget};
use orchard_spec::episode::ReachGridSpec;
use std::f64::consts::TAU;

impl World {
    /// The paper's reachability of every fruit as it hangs at the start, by fruit index: its centre lies within
    /// the arm's reach sphere from an admissible stand-off. A stand-off is a pose of the base on the ground
    /// that faces the fruit, with the shoulder at an admissible horizontal distance from it and the
    /// chassis clear of the trunk; in a row of trees it lies in the alley in which the robot starts. The stand-offs of a base that stands
    /// or slides are the places that it can take; the fruit may lie in any direction from them.
    pub fn reachable(&self) -> Vec<bool> {
        self.start_p_world().iter().map(|p| self.reaches(p)).collect()
    }

    /// True if a point is reachable by the rule of [`Self::reachable`].
    pub fn reaches(&self, p_world: &Vec3) -> bool {
        let reach = self.reach_radius();
        self.stand_offs(p_world).any(|s| s.distance <= reach)
    }

    /// True if a point is reachable by the rule of [`Self::reachable_by_ik`].
    pub fn reaches_by_ik(&self, p_world: &Vec3) -> bool {
        let reach = self.reach_radius();
        let kinematics = self.robot().kinematics();
        // Nearest stand-off of each bearing is enough: farther ones reach less.
        self.stand_offs(p_world)
            .filter(|s| s.distance <= reach)
            .take(self.spec().episode.reach_grid.stand_offs.get() as usize)
            .any(|s| {
                let p_base = inverse_transform(&s.x_world_base, p_world);
                slopes(&self.spec().episode.reach_grid).any(|slope| {
                    let (sin, cos) = math::sin_cos(slope);
                    let target = IkTarget::Axis { p_base, z_base: Vec3::new(cos, 0.0, sin) };
                    kinematics.solve(&target, &kinematics.home()).is_ok()
                })
            })
    }

    /// Number of fruit that inverse kinematics confirms: from some stand-off the arm brings its fingers to the fruit
    /// along an axis that leads away from the robot. Branches and leaves are not treated as obstacles.
    pub fn reachable_by_ik(&self) -> u32 {
        self.start_p_world().iter().filter(|p| self.reaches_by_ik(p)).count() as u32
    }

    /// Radius of the arm's reach sphere \[m\]: the robot's own, else the world config's.
    fn reach_radius(&self) -> f64 {
        let own = self.robot().config().reach.as_ref().map(|reach| &reach.radius);
        own.unwrap_or(&self.spec().episode.reach_radius).si()
    }

    /// Admissible horizontal distances from the shoulder to the fruit \[m\]: the robot's own, else the world config's.
    fn stand_off_range(&self) -> (f64, f64) {
        let own = self.robot().config().reach.as_ref().map(|reach| &reach.stand_off);
        own.unwrap_or(&self.spec().episode.stand_off).si()
    }

    fn start_p_world(&self) -> Vec<Vec3> {
        self.fruit().points.iter().map(|point| self.start().point_p_world[point.index()]).collect()
    }

    /// Admissible stand-offs before a fruit.
    fn stand_offs<'a>(&'a self, p_world: &Vec3) -> Box<dyn Iterator<Item = StandOff> + 'a> {
        match self.robot().base_joint() {
            BaseJoint::Planar(_) => Box::new(self.stand_offs_on_ground(p_world)),
            BaseJoint::Rail { .. } | BaseJoint::Fixed => Box::new(self.stand_offs_of_mount(*p_world)),
        }
    }

    /// Stand-offs of a base on its rail, equally spaced from end to end, or of a base that stands.
    fn stand_offs_of_mount(&self, p_world: Vec3) -> impl Iterator<Item = StandOff> + '_ {
        let p_base_shoulder = self.p_base_shoulder();
        let (near, far) = self.stand_off_range();
        let (axis, lower, upper) = match self.robot().base_joint() {
            BaseJoint::Rail { on, axis_base } => {
                let limit = self.robot().articulation().links[on].limit;
                limit.map_or((axis_base, 0.0, 0.0), |limit| (axis_base, limit.lower, limit.upper))
            }
            _ => (Vec3::zeros(), 0.0, 0.0),
        };
        let places = self.spec().episode.reach_grid.bearings.get();
        (0..places).filter_map(move |k| {
            let along = lower + (upper - lower) * f64::from(k) / f64::from((places - 1).max(1));
            let x_world_base =
                self.x_world_start() * Pose::from_parts((axis * along).into(), Default::default());
            let to_fruit = p_world - transform(&x_world_base, &p_base_shoulder);
            let distance = to_fruit.norm();
            (near..=far).contains(&to_fruit.xy().norm()).then_some(StandOff { x_world_base, distance })
        })
    }

    /// Stand-offs on the ground that keep the chassis off the trunk, in the robot's alley.
    fn stand_offs_on_ground<'a>(&'a self, p_world: &Vec3) -> impl Iterator<Item = StandOff> + 'a {
        let p_world = *p_world;
        let p_base_shoulder = self.p_base_shoulder();
        let (near, far) = self.stand_off_range();
        let trunk_radius = self.skeleton().segments[0].radius;
        let grid = &self.spec().episode.reach_grid;
        let (bearings, stand_offs) = (grid.bearings.get(), grid.stand_offs.get());
        (0..bearings * stand_offs).filter_map(move |k| {
            let heading = TAU * f64::from(k / stand_offs) / f64::from(bearings);
            let share = f64::from(k % stand_offs) / f64::from((stand_offs - 1).max(1));
            let stand_off = near + (far - near) * share;
            let (sin, cos) = math::sin_cos(heading);
            let ahead = Vec3::new(cos, sin, 0.0);
            let mut shoulder = Vec3::new(p_world.x, p_world.y, p_base_shoulder.z) - ahead * stand_off;
            let rotation = Rotation::from_axis_angle(&Vec3::z_axis(), heading);
            let p_world_base = shoulder - rotation * p_base_shoulder;
            let mut x_world_base =
                Pose::from_parts(Vec3::new(p_world_base.x, p_world_base.y, 0.0).into(), rotation);
            let ride_height = self.parts.ground.ride_height(&x_world_base);
            x_world_base.translation.z = ride_height;
            shoulder.z += ride_height;
            let distance = (p_world - shoulder).norm();
            (self.clears_trunk(&x_world_base, trunk_radius)
                && same_alley(&self.parts.struts, &self.x_world_start(), &x_world_base))
            .then_some(StandOff { x_world_base, distance })
        })
    }

    /// True if the chassis at a place of the base keeps off the trunk, which stands at the world's origin.
    fn clears_trunk(&self, x_world_base: &Pose, trunk_radius: f64) -> bool {
        self.chassis().iter().all(|(shape, x_base_shape)| {
            let x_world_shape = x_world_base * x_base_shape;
            let trunk = Vec3::new(0.0, 0.0, x_world_shape.translation.z);
            shape.signed_distance(&inverse_transform(&x_world_shape, &trunk)) > trunk_radius
        })
    }

    /// The chassis' shapes in the base frame.
    fn chassis(&self) -> Vec<(Shape, Pose)> {
        let handle = self.handle();
        let x_base_body = handle.x_body_base.inverse();
        let colliders = handle.colliders.base.iter().map(|&id| self.model().collider(id));
        colliders.map(|c| (c.shape.clone(), x_base_body * c.x_owner_shape)).collect()
    }

    /// The arm's shoulder, the origin of its second joint, in the base frame.
    fn p_base_shoulder(&self) -> Vec3 {
        let p_world = self.start().x_world_body(self.handle().arm[1]).translation.vector;
        inverse_transform(&self.handle().x_world_base(self.start()), &p_world)
    }
}

/// Slopes of the approach \[rad\], positive upwards: the horizontal first, then outwards to both sides.
fn slopes(grid: &ReachGridSpec) -> impl Iterator<Item = f64> + use<> {
    let step = grid.slope_step.si();
    let pair = move |k: u32| [f64::from(k) * step, -f64::from(k) * step];
    std::iter::once(0.0).chain((1..=grid.slopes.get()).flat_map(pair))
}

/// A place of the base before a fruit.
struct StandOff {
    x_world_base: Pose,
    /// From the shoulder to the fruit \[m\].
    distance: f64,
}
