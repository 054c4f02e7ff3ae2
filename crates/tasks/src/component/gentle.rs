//! Gentle interaction: push the hand through the canopy to a point behind it.

use orchard_geometry::{Pose, Shape, Vec3, inverse_transform, math, transform};
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

/// Speed that no tool reaches \[m/s\], our own choice: 2.6 rad/s at a reach of 1.2 m on a base of 1.1 m/s.
const FASTEST_TOOL: f64 = 4.5;
/// Largest step between the checked points of the line outwards \[m\]: less than the thickness of a twig.
const STEP: f64 = 5e-3;
/// Added to the radius of a sphere around a segment, so that rounding does not make the sphere too small \[m\].
const ROUNDING: f64 = 1e-6;

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
        let p_base = p_odom(handle.x_world_base(data).translation.vector);
        let p_target = Vec3::from(target.p_odom);
        let heading = math::atan2(p_target.y - p_base.y, p_target.x - p_base.x);
        let off = math::wrap_angle(heading - target.heading_odom).abs();
        distance(world, target) <= rules.gentle.tolerance.si() && off <= rules.gentle.side.si()
    }

    fn frames_to_meet(world: &World, target: &PointTarget, rules: &ComponentRules, frame: f64) -> u32 {
        let left = distance(world, target) - rules.gentle.tolerance.si();
        ((left / (FASTEST_TOOL * frame)) as u32).saturating_add(1)
    }

    fn named_fruit(_: &PointTarget) -> Option<u32> {
        None
    }

    fn trials(rules: &ComponentRules) -> u32 {
        rules.gentle.targets.get()
    }
}

/// Distance of the tool from the point that the controller was given \[m\].
fn distance(world: &World, target: &PointTarget) -> f64 {
    let p_world_tcp = world.handle().x_world_tcp(world.data()).translation.vector;
    (inverse_transform(&world.x_world_odom(), &p_world_tcp) - Vec3::from(target.p_odom)).norm()
}

/// Wood at its present poses.
struct Wood {
    segments: Vec<Piece>,
}

/// A segment of the wood.
struct Piece {
    shape: Shape,
    x_world: Pose,
    is_trunk: bool,
    /// Sphere around the shape \[m\].
    p_world_middle: Vec3,
    radius: f64,
}

impl Piece {
    /// Distance of a point from the surface \[m\], negative inside.
    fn distance(&self, p_world: &Vec3) -> f64 {
        self.shape.signed_distance(&inverse_transform(&self.x_world, p_world))
    }

    /// False if all of the segment is farther from a point than this, which takes a fraction of the time of [`Self::distance`].
    fn may_be_within(&self, distance: f64, p_world: &Vec3) -> bool {
        (self.p_world_middle - p_world).norm() <= self.radius + distance + ROUNDING
    }
}

impl Wood {
    fn of(world: &World) -> Self {
        let segments = world.skeleton().segments.iter().zip(&world.tree().bodies);
        let segments = segments.map(|(segment, &body)| {
            let x_world = *world.data().x_world_body(body);
            Piece {
                shape: Shape::Capsule { radius: segment.radius, length: segment.length },
                x_world,
                is_trunk: segment.order == 0,
                p_world_middle: transform(&x_world, &(0.5 * segment.length * Vec3::z())),
                radius: 0.5 * segment.length + segment.radius,
            }
        });
        Self { segments: segments.collect() }
    }

    /// Number of wood segments near the level line outwards from a point; `None` if the point is too close to wood or there are too few.
    fn before(&self, p_world: &Vec3, outwards: &Vec3, rules: &GentleRules) -> Option<u32> {
        let clearance = rules.clearance.si();
        let close = |s: &Piece| s.may_be_within(clearance, p_world) && s.distance(p_world) < clearance;
        if self.segments.iter().any(close) {
            return None;
        }
        let (length, radius) = (rules.corridor_length.si(), rules.corridor_radius.si());
        let steps = (length / STEP).ceil().max(1.0) as u32;
        let middle = p_world + outwards * (0.5 * length);
        let near = |s: &&Piece| {
            let along = (0..=steps).map(|k| p_world + outwards * (length * f64::from(k) / f64::from(steps)));
            !s.is_trunk
                && s.may_be_within(0.5 * length + radius, &middle)
                && along.into_iter().any(|p| s.distance(&p) <= radius)
        };
        let count = self.segments.iter().filter(near).count() as u32;
        (count >= rules.corridor_segments.get()).then_some(count)
    }
}

#[cfg(test)]
mod tests {
    use orchard_scenario::Scenario;

    use super::*;

    /// The sphere around a segment never leaves out a segment that is near.
    #[test]
    fn spheres_leave_out_only_what_is_farther() {
        let world = Scenario::of(&[]).unwrap().world(20250704, 0, 0).unwrap();
        let (wood, mut draws) = (Wood::of(&world), Stream::new(1, 0, Purpose::Test));
        let mut left_out = 0;
        for _ in 0..100 {
            let mut within = |low, high| draws.uniform(low, high);
            let p_world = Vec3::new(within(-0.6, 0.6), within(-0.6, 0.6), within(0.5, 2.0));
            let most = within(0.01, 0.3);
            for piece in &wood.segments {
                if !piece.may_be_within(most, &p_world) {
                    assert!(piece.distance(&p_world) > most);
                    left_out += 1;
                }
            }
        }
        assert!(left_out > 100 * wood.segments.len() / 2, "{left_out}");
    }
}
