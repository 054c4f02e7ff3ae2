//! Poses of everything that moves, recorded when they are due.

use foxglove::messages::{FrameTransform, FrameTransforms, Quaternion, Vector3};
use orchard_geometry::{Pose, Rotation};
use orchard_multibody::{BodyId, PointId};
use orchard_world::World;

use crate::clock::{Clock, timestamp};
use crate::config::TransformRules;

/// The frame that does not move.
pub const WORLD: &str = "world";
/// The robot's base at the start of the episode.
pub const ODOM: &str = "odom";
/// Optical frame of the wrist camera.
pub const CAMERA: &str = "camera";

/// Frame of a segment of wood: +z along the wood, origin at its base.
pub fn segment_frame(segment: usize) -> String {
    format!("segment/{segment}")
}

/// Frame of a fruit: origin at its centre; it does not turn.
pub fn fruit_frame(fruit: usize) -> String {
    format!("fruit/{fruit}")
}

/// Frame of a moving link of the robot.
pub fn link_frame(name: &str) -> String {
    format!("robot/{name}")
}

/// Source of a frame's pose in a world.
#[derive(Debug, Clone, Copy)]
enum Place {
    Odom,
    Base,
    Camera,
    Tcp,
    Body(BodyId),
    Point(PointId),
}

impl Place {
    fn pose(self, world: &World) -> Pose {
        let (data, handle) = (world.data(), world.handle());
        match self {
            Self::Odom => world.x_world_odom(),
            Self::Base => handle.x_world_base(data),
            Self::Camera => world.x_world_camera(),
            Self::Tcp => handle.x_world_tcp(data),
            Self::Body(body) => *data.x_world_body(body),
            Self::Point(point) => {
                Pose::from_parts(data.point_p_world[point.index()].into(), Rotation::identity())
            }
        }
    }
}

/// A frame and its last recorded pose.
#[derive(Debug, Clone)]
struct Tracked {
    name: String,
    place: Place,
    /// True if the frame is left out while it stands still: there are hundreds of segments and fruit, and few frames of the robot,
    /// on which images and clouds hang.
    spared: bool,
    kept: Option<Pose>,
}

/// All frames of a world.
#[derive(Debug, Clone)]
pub struct Transforms(Vec<Tracked>);

impl Transforms {
    /// Lists the frames of a world.
    pub fn of(world: &World) -> Self {
        let fixed =
            [(ODOM, Place::Odom), ("base", Place::Base), (CAMERA, Place::Camera), ("tcp", Place::Tcp)];
        let fixed = fixed.into_iter().map(|(name, place)| (name.to_owned(), place));
        let links = world.robot().articulation().links.iter().zip(&world.handle().bodies);
        let links = links.map(|(link, &body)| (link_frame(&link.name), Place::Body(body)));
        let wood = world.tree().bodies.iter().enumerate();
        let wood = wood.map(|(i, &body)| (segment_frame(i), Place::Body(body)));
        let fruit = world.fruit().points.iter().enumerate();
        let fruit = fruit.map(|(i, &point)| (fruit_frame(i), Place::Point(point)));
        let tracked = |spared| move |(name, place)| Tracked { name, place, spared, kept: None };
        let robot = fixed.chain(links).map(tracked(false));
        Self(robot.chain(wood.chain(fruit).map(tracked(true))).collect())
    }

    /// The poses that are due in a frame: of the robot and of what else has moved, or of everything.
    pub fn due(&mut self, world: &World, clock: &Clock, rules: &TransformRules) -> Option<FrameTransforms> {
        if clock.is_due(1.0 / rules.whole.si()) {
            return Some(self.keep(world, clock.now(), |_, _| true));
        }
        let (distance, angle) = (rules.distance.si(), rules.angle.si());
        clock
            .is_due(rules.rate.si())
            .then(|| self.keep(world, clock.now(), |old, new| has_moved(old, new, distance, angle)))
    }

    /// All poses.
    pub fn all(&mut self, world: &World, clock: &Clock) -> FrameTransforms {
        self.keep(world, clock.now(), |_, _| true)
    }

    fn keep(&mut self, world: &World, now: u64, is_due: impl Fn(&Pose, &Pose) -> bool) -> FrameTransforms {
        let mut transforms = Vec::new();
        for tracked in &mut self.0 {
            let pose = tracked.place.pose(world);
            let kept = tracked.kept.as_ref().filter(|_| tracked.spared);
            if kept.is_none_or(|kept| is_due(kept, &pose)) {
                transforms.push(transform(now, &tracked.name, &pose));
                tracked.kept = Some(pose);
            }
        }
        FrameTransforms { transforms }
    }
}

/// True if two poses differ by more than a distance \[m\] or an angle \[rad\], or are not finite.
fn has_moved(old: &Pose, new: &Pose, distance: f64, angle: f64) -> bool {
    let moved = (new.translation.vector - old.translation.vector).norm();
    let (p, q) = (old.rotation.coords, new.rotation.coords);
    // A quaternion's chord is half a small angle; q and -q are one rotation.
    let turned = 2.0 * (p - q).norm().min((p + q).norm());
    !(moved <= distance && turned <= angle)
}

fn transform(now: u64, name: &str, x_world: &Pose) -> FrameTransform {
    let (p, q) = (x_world.translation.vector, x_world.rotation.coords);
    FrameTransform {
        timestamp: Some(timestamp(now)),
        parent_frame_id: WORLD.to_owned(),
        child_frame_id: name.to_owned(),
        translation: Some(Vector3 { x: p.x, y: p.y, z: p.z }),
        rotation: Some(Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_geometry::Vec3;

    #[test]
    fn small_moves_are_none() {
        let at = |x: f64, angle: f64| Pose::new(Vec3::new(x, 0.0, 0.0), Vec3::new(0.0, angle, 0.0));
        let moved = |x, angle| has_moved(&at(0.0, 0.0), &at(x, angle), 1e-3, 1e-2);
        assert!(!moved(0.9e-3, 0.9e-2));
        assert!(moved(1.1e-3, 0.0) && moved(0.0, 1.1e-2) && moved(0.0, -1.1e-2));
        assert!(moved(f64::NAN, 0.0));
        // The same rotation, written with the other sign.
        let mut other = at(0.0, 0.0);
        other.rotation = Rotation::new_unchecked(-other.rotation.into_inner());
        assert!(!has_moved(&at(0.0, 0.0), &other, 1e-3, 1e-2));
    }
}
