//! Places that a hand can hold.

use orchard_geometry::{Shape, Vec3, inverse_transform, transform};
use orchard_multibody::{BodyId, Data};
use orchard_world::World;

/// A grabbed place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grip {
    /// A place on the wood.
    Wood {
        /// Segment of the tree.
        segment: usize,
        /// The place \[m\], frame of the segment.
        p_segment: Vec3,
    },
    /// The centre of a fruit on its stem.
    Fruit {
        /// Index of the fruit.
        fruit: usize,
    },
    /// A place on the robot.
    Robot {
        /// Body of the link.
        body: BodyId,
        /// The place \[m\], frame of the body.
        p_body: Vec3,
    },
}

/// Things that a ray may grab.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// Living wood, and fruit on their stems.
    Tree,
    /// These, and the robot.
    All,
}

impl Grip {
    /// The thing within reach that a ray meets first, or else misses by the smallest angle, up to `grab_angle` \[rad\]. `p_world` \[m\] is the
    /// ray's start, `along` its direction. The robot must be met.
    pub fn along(world: &World, p_world: &Vec3, along: &Vec3, grab_angle: f64, reach: Reach) -> Option<Self> {
        let length = along.norm();
        if length.is_nan() || length <= 0.0 {
            return None;
        }
        let along = along / length;
        let mut best: Option<(f64, f64, Self)> = None;
        let mut offer = |gap: f64, distance: f64, grip: Self| {
            if distance <= 0.0 {
                return;
            }
            let miss = gap.max(0.0) / distance;
            let is_better = best.is_none_or(|(m, d, _)| miss < m || miss == m && distance < d);
            if miss <= grab_angle && is_better {
                best = Some((miss, distance, grip));
            }
        };
        for (segment, wood) in world.skeleton().segments.iter().enumerate() {
            if world.rupture().is_debris(segment) {
                continue;
            }
            let x_world = world.data().x_world_body(world.tree().bodies[segment]);
            let tip = Vec3::new(0.0, 0.0, wood.length);
            let (on_ray, on_wood) =
                nearest(p_world, &along, &x_world.translation.vector, &transform(x_world, &tip));
            let gap = (p_world + along * on_ray - on_wood).norm() - wood.radius;
            offer(gap, on_ray, Self::Wood { segment, p_segment: inverse_transform(x_world, &on_wood) });
        }
        let set = world.fruit();
        for (fruit, (point, apple)) in set.points.iter().zip(&set.fruit).enumerate() {
            if !world.data().tethered[point.index()] {
                continue;
            }
            let p_fruit = world.data().point_p_world[point.index()];
            let on_ray = (p_fruit - p_world).dot(&along);
            let gap = (p_world + along * on_ray - p_fruit).norm() - apple.radius;
            offer(gap, on_ray - apple.radius, Self::Fruit { fruit });
        }
        if reach == Reach::All
            && let Some((distance, grip)) = on_robot(world, p_world, &along)
        {
            offer(0.0, distance, grip);
        }
        best.map(|(_, _, grip)| grip)
    }

    /// The place in a state of a world \[m\], world.
    pub fn place(&self, world: &World, data: &Data) -> Vec3 {
        match *self {
            Self::Wood { segment, p_segment } => {
                transform(data.x_world_body(world.tree().bodies[segment]), &p_segment)
            }
            Self::Fruit { fruit } => data.point_p_world[world.fruit().points[fruit].index()],
            Self::Robot { body, p_body } => transform(data.x_world_body(body), &p_body),
        }
    }

    /// True while it can be held: the wood has not broken, the fruit is on its stem.
    pub(crate) fn holds(&self, world: &World) -> bool {
        match *self {
            Self::Wood { segment, .. } => !world.rupture().is_debris(segment),
            Self::Fruit { fruit } => world.data().tethered[world.fruit().points[fruit].index()],
            Self::Robot { .. } => true,
        }
    }

    /// Force and torque on the link, or force on the fruit, that a force \[N\] at the place makes.
    pub(crate) fn loads(&self, world: &World, data: &Data, force_world: &Vec3) -> [Vec3; 2] {
        let body = match *self {
            Self::Wood { segment, .. } => world.tree().bodies[segment],
            Self::Robot { body, .. } => body,
            Self::Fruit { .. } => return [*force_world, Vec3::zeros()],
        };
        let arm = self.place(world, data) - data.com_p_world(body);
        [*force_world, arm.cross(force_world)]
    }

    /// The inputs of a step that push the held thing.
    pub(crate) fn inputs(&self, world: &World) -> Inputs {
        match *self {
            Self::Wood { segment, .. } => Inputs::Body(world.tree().bodies[segment].index()),
            Self::Fruit { fruit } => Inputs::Point(world.fruit().points[fruit].index()),
            Self::Robot { body, .. } => Inputs::Body(body.index()),
        }
    }
}

/// External force and torque of a link, or force of a point body, in a state.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Inputs {
    Body(usize),
    Point(usize),
}

impl Inputs {
    pub fn read(self, data: &Data) -> [Vec3; 2] {
        match self {
            Self::Body(body) => [data.body_force_world[body], data.body_torque_world[body]],
            Self::Point(point) => [data.point_force_world[point], Vec3::zeros()],
        }
    }

    pub fn write(self, data: &mut Data, [force, torque]: [Vec3; 2]) {
        match self {
            Self::Body(body) => {
                (data.body_force_world[body], data.body_torque_world[body]) = (force, torque);
            }
            Self::Point(point) => data.point_force_world[point] = force,
        }
    }

    pub fn add(self, data: &mut Data, [force, torque]: [Vec3; 2]) {
        let [f, t] = self.read(data);
        self.write(data, [f + force, t + torque]);
    }
}

/// Nearest points of a ray and a line from `a` to `b` \[m\]: the distance along the ray, and the point between `a` and `b`.
pub(crate) fn nearest(p_world: &Vec3, along: &Vec3, a: &Vec3, b: &Vec3) -> (f64, Vec3) {
    let (line, from) = (b - a, a - p_world);
    let (slope, square) = (line.dot(along), line.norm_squared());
    let across = square - slope * slope;
    let share = if across > 0.0 { (from.dot(along) * slope - from.dot(&line)) / across } else { 0.0 };
    let on_line = a + line * share.clamp(0.0, 1.0);
    ((on_line - p_world).dot(along), on_line)
}

/// Distance along a ray at which it meets the robot, and the place there; `along` is a unit vector.
fn on_robot(world: &World, p_world: &Vec3, along: &Vec3) -> Option<(f64, Grip)> {
    let links = world.robot().articulation().links.iter().zip(&world.handle().bodies);
    let shapes = links.flat_map(|(link, &body)| link.shapes.iter().map(move |shape| (body, shape)));
    let met = shapes.filter_map(|(body, shape)| {
        let x_world_shape = world.data().x_world_body(body) * shape.x_link_shape;
        let p_shape = inverse_transform(&x_world_shape, p_world);
        let along_shape = x_world_shape.rotation.inverse() * along;
        Some((first_meeting(&shape.shape, &p_shape, &along_shape)?, body))
    });
    let (distance, body) = met.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let p_body = inverse_transform(world.data().x_world_body(body), &(p_world + along * distance));
    Some((distance, Grip::Robot { body, p_body }))
}

/// Distance along a ray at which it meets a shape, by steps as long as the distance to the surface.
fn first_meeting(shape: &Shape, p: &Vec3, along: &Vec3) -> Option<f64> {
    const STEPS: usize = 64;
    /// Distance that counts as met \[m\].
    const MET: f64 = 1e-3;
    /// Farther away nothing is drawn \[m\].
    const FAR: f64 = 60.0;
    let mut distance = 0.0;
    for _ in 0..STEPS {
        let gap = shape.signed_distance(&(p + along * distance));
        if gap < MET {
            return Some(distance);
        }
        distance += gap;
        if distance > FAR {
            break;
        }
    }
    None
}
