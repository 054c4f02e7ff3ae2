//! Gentle interaction: push the hand through the canopy to a point behind it.

use orchard_geometry::{Shape, Vec3, inverse_transform, math};
use orchard_picker::Goal;
use orchard_spec::{Purpose, Stream};
use orchard_world::World;
use serde::{Deserialize, Serialize};

use crate::component::rules::{ComponentRules, GentleRules};
use crate::component::task::Component;
use crate::json::array;

/// The task.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gentle;

/// A point behind the canopy.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PointTarget {
    /// The point \[m, world\].
    pub p_world: [f64; 3],
    /// Point given to the controller \[m, odom\].
    pub p_odom: [f64; 3],
    /// Level direction from the stand-off to the point given to the controller, from the x axis of odom \[rad\].
    pub heading_odom: f64,
    /// Segments of wood near the level line from the stand-off.
    pub segments_before: u32,
}

/// Largest step between the checked points of the line outwards \[m\]: less than the thickness of a twig.
const STEP: f64 = 5e-3;

impl Component for Gentle {
    type Target = PointTarget;
    const NAME: &'static str = "gentle";
    const SUMMARY: &'static str = "gentle.json";

    fn targets(world: &World, rules: &ComponentRules, seed: u64) -> Vec<PointTarget> {
        let c = &rules.gentle;
        let mut stream = Stream::new(seed, world.index(), Purpose::ComponentTarget);
        let p_world_start = world.x_world_odom().translation.vector;
        let start = math::atan2(p_world_start.y, p_world_start.x);
        let wood = Wood::of(world);
        let mut targets = Vec::new();
        for _ in 0..c.draws.get() {
            let bearing = start + stream.within(c.bearing.si());
            let distance = stream.within(c.axis_distance.si());
            let height = stream.within(c.height.si());
            let (sin, cos) = math::sin_cos(bearing);
            let outwards = Vec3::new(cos, sin, 0.0);
            let p_world = outwards * distance + Vec3::z() * height;
            let Some(segments_before) = wood.before(&p_world, &outwards, c) else { continue };
            if !(world.reaches(&p_world) && world.reaches_by_ik(&p_world)) {
                continue;
            }
            let p_odom = inverse_transform(&world.x_world_odom(), &p_world);
            let ahead_odom = world.x_world_odom().rotation.inverse() * -outwards;
            targets.push(PointTarget {
                p_world: array(&p_world),
                p_odom: array(&p_odom),
                heading_odom: math::atan2(ahead_odom.y, ahead_odom.x),
                segments_before,
            });
            if targets.len() == c.targets.get() as usize {
                break;
            }
        }
        targets
    }

    fn goal(target: &PointTarget) -> Goal {
        Goal::Reach { p_odom: target.p_odom.into(), heading_odom: target.heading_odom }
    }

    fn time(rules: &ComponentRules) -> f64 {
        rules.gentle.time.si()
    }

    fn hold_frames(_: &ComponentRules, _: f64) -> u32 {
        1
    }

    fn is_met(world: &World, target: &PointTarget, rules: &ComponentRules) -> bool {
        let (handle, data) = (world.handle(), world.data());
        let p_odom = |p_world| inverse_transform(&world.x_world_odom(), &p_world);
        let p_tcp = p_odom(handle.x_world_tcp(data).translation.vector);
        let p_base = p_odom(handle.x_world_base(data).translation.vector);
        let p_target = Vec3::from(target.p_odom);
        let heading = math::atan2(p_target.y - p_base.y, p_target.x - p_base.x);
        let off = math::wrap_angle(heading - target.heading_odom).abs();
        (p_tcp - p_target).norm() <= rules.gentle.tolerance.si() && off <= rules.gentle.side.si()
    }

    fn named_fruit(_: &PointTarget) -> Option<u32> {
        None
    }

    fn trials(rules: &ComponentRules) -> u32 {
        rules.gentle.targets.get()
    }
}

/// Shapes of the wood at its present poses.
struct Wood {
    /// (shape, pose, whether it is the trunk's).
    segments: Vec<(Shape, orchard_geometry::Pose, bool)>,
}

impl Wood {
    fn of(world: &World) -> Self {
        let segments = world.skeleton().segments.iter().zip(&world.tree().bodies);
        let segments = segments.map(|(segment, &body)| {
            let shape = Shape::Capsule { radius: segment.radius, length: segment.length };
            (shape, *world.data().x_world_body(body), segment.order == 0)
        });
        Self { segments: segments.collect() }
    }

    /// Number of wood segments near the level line outwards from a point; `None` if the point is too close to wood or there are too few.
    fn before(&self, p_world: &Vec3, outwards: &Vec3, rules: &GentleRules) -> Option<u32> {
        let distance = |(shape, x, _): &(Shape, orchard_geometry::Pose, bool), p: &Vec3| {
            shape.signed_distance(&inverse_transform(x, p))
        };
        if self.segments.iter().any(|s| distance(s, p_world) < rules.clearance.si()) {
            return None;
        }
        let (length, radius) = (rules.corridor_length.si(), rules.corridor_radius.si());
        let steps = (length / STEP).ceil().max(1.0) as u32;
        let near = |s: &&(Shape, orchard_geometry::Pose, bool)| {
            let along = (0..=steps).map(|k| p_world + outwards * (length * f64::from(k) / f64::from(steps)));
            !s.2 && along.into_iter().any(|p| distance(s, &p) <= radius)
        };
        let count = self.segments.iter().filter(near).count() as u32;
        (count >= rules.corridor_segments.get()).then_some(count)
    }
}
