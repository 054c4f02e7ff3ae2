//! Poses of the engine's obstacles at the end of a substep, also of one within a frame of which only start and end are known.

use crate::build::Parts;
use orchard_geometry::{Pose, Rotation, Vec3};
use orchard_multibody::{BodyId, Data, Owner, Twist};

/// Thing that an obstacle of the engine moves with.
#[derive(Debug, Clone, Copy)]
pub(super) enum Mover {
    Still,
    Collider(usize),
    Fruit(usize),
}

/// Motion of the robot's links, in the order of the handle, and of the fruit, at an instant.
#[derive(Debug, Default)]
pub(super) struct Before {
    /// Velocity and pose of each link.
    pub links: Vec<(Twist, Pose)>,
    /// Velocity and place of each fruit.
    pub fruit: Vec<(Vec3, Vec3)>,
}

impl Before {
    /// Keeps the present motion.
    pub fn keep(&mut self, parts: &Parts, data: &Data) {
        self.links.clear();
        self.links.extend(parts.handle.bodies.iter().map(|&b| (data.velocity(b), *data.x_world_body(b))));
        self.fruit.clear();
        let points = parts.fruit.points.iter().map(|p| p.index());
        self.fruit.extend(points.map(|p| (data.point_v_world[p], data.point_p_world[p])));
    }

    /// Velocity that a point of a link had \[m/s\]; zero of what is no link of the robot.
    pub fn v_world(&self, parts: &Parts, body: Option<BodyId>, p_world: &Vec3) -> Vec3 {
        let place = body.and_then(|body| parts.handle.bodies.iter().position(|&b| b == body));
        place.map_or_else(Vec3::zeros, |k| {
            let (twist, x_world) = &self.links[k];
            twist.linear_at(&(p_world - x_world.translation.vector))
        })
    }
}

impl Mover {
    /// Pose of the obstacle now.
    pub fn x_world(self, parts: &Parts, data: &Data) -> Pose {
        match self {
            Self::Still => Pose::identity(),
            Self::Collider(c) => x_world_shape(parts, data, c),
            Self::Fruit(i) => at(&data.point_p_world[parts.fruit.points[i].index()]),
        }
    }

    /// Pose of the obstacle at the end of a substep within a frame, of which `before` is the motion at the start and the present one that at the end.
    pub fn x_world_within(self, parts: &Parts, data: &Data, before: &Before, within: Within) -> Pose {
        match self {
            Self::Still => Pose::identity(),
            Self::Collider(c) => {
                let collider = &parts.model.colliders()[c];
                let Owner::Body(body) = collider.owner else { return x_world_shape(parts, data, c) };
                let Some(k) = parts.handle.bodies.iter().position(|&b| b == body) else {
                    return x_world_shape(parts, data, c);
                };
                let (now, x_now) = (data.velocity(body), data.x_world_body(body));
                let (then, x_then) = &before.links[k];
                let p_then = &x_then.translation.vector;
                let way = x_now.translation.vector - p_then;
                let p = p_then + within.part(&way, &then.linear, &now.linear);
                let turn = (x_now.rotation * x_then.rotation.inverse()).scaled_axis();
                let turn = within.part(&turn, &then.angular, &now.angular);
                let rotation = Rotation::from_scaled_axis(turn) * x_then.rotation;
                Pose::from_parts(p.into(), rotation) * collider.x_owner_shape
            }
            Self::Fruit(i) => {
                let point = parts.fruit.points[i].index();
                let (v, p) = &before.fruit[i];
                let way = data.point_p_world[point] - p;
                at(&(p + within.part(&way, v, &data.point_v_world[point])))
            }
        }
    }
}

fn at(p_world: &Vec3) -> Pose {
    Pose::translation(p_world.x, p_world.y, p_world.z)
}

/// Pose of a collider of the model now.
fn x_world_shape(parts: &Parts, data: &Data, collider: usize) -> Pose {
    let collider = &parts.model.colliders()[collider];
    match collider.owner {
        Owner::World => collider.x_owner_shape,
        Owner::Body(body) => data.x_world_body(body) * collider.x_owner_shape,
        Owner::Point(point) => at(&data.point_p_world[point.index()]) * collider.x_owner_shape,
    }
}

/// End of a substep within a frame: number of the substep, of how many, each of `h` \[s\].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Within {
    pub substep: u32,
    pub of: u32,
    pub h: f64,
}

impl Within {
    /// Way up to here, by the way and the velocities at the two ends of the frame. A substep moves by the velocity at its end, so that the last one begins h v before the frame's end. Of the n others the first k make
    /// s way - s (1 - s) n h dv / 2, with s = k / n and dv the change of the velocity in them: exact under a constant acceleration.
    fn part(self, way: &Vec3, v_before: &Vec3, v_after: &Vec3) -> Vec3 {
        let way = way - v_after * self.h;
        let n = f64::from(self.of - 1);
        let s = f64::from(self.substep) / n;
        let dv = (v_after - v_before) * (n / f64::from(self.of));
        way * s - dv * (0.5 * s * (1.0 - s) * n * self.h)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Substeps under a constant acceleration, which end where the parts of the whole way do.
    #[test]
    fn a_part_of_a_frame_is_that_of_its_substeps() {
        let (substeps, h) = (4_u32, 1.0 / 240.0);
        let (mut v, mut p, a) = (Vec3::new(0.4, -0.2, 0.0), Vec3::zeros(), Vec3::new(3.0, 1.0, -9.81));
        let (v_before, mut ways) = (v, Vec::new());
        for _ in 0..substeps {
            v += a * h;
            p += v * h;
            ways.push(p);
        }
        for (substep, expected) in (1..substeps).zip(&ways) {
            let way = Within { substep, of: substeps, h }.part(&p, &v_before, &v);
            assert!((way - expected).norm() < 1e-15, "substep {substep}: {way} {expected}");
        }
    }
}
