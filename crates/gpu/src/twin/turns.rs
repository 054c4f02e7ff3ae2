//! Rotations as quaternions (vector, scalar), and the rotations that change a tree's habit, as in `orchard_treegen::habit`.

use std::f32::consts::PI;

use nalgebra::Vector4;

use super::math::{Vec3, angle_of, sin_cos};

/// Rotation as a quaternion.
pub(super) type Turn = Vector4<f32>;

/// Below this value of 1 + cos, two directions count as opposite, and any axis is used.
const STRAIGHT_BACK: f32 = 1e-12;

pub(super) fn no_turn() -> Turn {
    Turn::w()
}

/// Rotation b followed by a.
pub(super) fn product(a: &Turn, b: &Turn) -> Turn {
    let (u, v) = (a.xyz(), b.xyz());
    let vector = v * a.w + u * b.w + u.cross(&v);
    Turn::new(vector.x, vector.y, vector.z, a.w * b.w - u.dot(&v))
}

/// Rotated vector.
pub(super) fn turned(turn: &Turn, v: &Vec3) -> Vec3 {
    let twice = turn.xyz().cross(v) * 2.0;
    v + twice * turn.w + turn.xyz().cross(&twice)
}

/// Quaternion with unit norm; products change the norm by rounding.
pub(super) fn unit_turn(turn: &Turn) -> Turn {
    turn * (1.0 / turn.dot(turn).sqrt())
}

pub(super) fn unit_vector(v: &Vec3) -> Vec3 {
    v * (1.0 / v.dot(v).sqrt())
}

/// Rotation by a rotation vector [rad].
pub(super) fn turn_by(v: &Vec3) -> Turn {
    let angle = v.dot(v).sqrt();
    if angle == 0.0 {
        return no_turn();
    }
    let [sine, cosine] = sin_cos(0.5 * angle);
    (v * (sine / angle)).push(cosine)
}

/// Smallest rotation that carries one unit vector onto another.
pub(super) fn turn_between(start: &Vec3, end: &Vec3) -> Turn {
    let turn = start.cross(end).push(1.0 + start.dot(end));
    if turn.w < STRAIGHT_BACK {
        return Turn::x();
    }
    unit_turn(&turn)
}

/// Rotation that multiplies a lateral's angle to its parent's heading by a factor, in the plane of both.
pub(super) fn spread_turn(along: &Vec3, heading: &Vec3, factor: f32) -> Turn {
    let axis = along.cross(heading);
    let sine = axis.dot(&axis).sqrt();
    if sine == 0.0 {
        return no_turn();
    }
    let angle = angle_of(sine, along.dot(heading));
    turn_by(&(axis * (((angle * factor).min(PI) - angle) / sine)))
}

/// Rotation of a heading by an angle [rad] towards the ground, or away from it if negative, at most to straight down (up).
pub(super) fn droop_turn(heading: &Vec3, angle: f32) -> Turn {
    let axis = Vec3::new(-heading.y, heading.x, 0.0);
    let sine = axis.dot(&axis).sqrt();
    if sine == 0.0 {
        return no_turn();
    }
    let to_ground = angle_of(sine, -heading.z);
    turn_by(&(axis * (angle.clamp(to_ground - PI, to_ground) / sine)))
}

/// Rotation of a heading h about an axis a across it. The azimuth is counted in the frame that the smallest rotation carries from the world's z axis to h:
/// a = c - (c . h) (h_xy / w, 1) with the level vector c and w = 1 + h_z, which is computed from h_xy for a heading towards the ground.
pub(super) fn bend_turn(heading: &Vec3, [angle, azimuth]: [f32; 2]) -> Turn {
    let [sine, cosine] = sin_cos(azimuth);
    let across = Vec3::new(cosine, sine, 0.0);
    let level = Vec3::new(heading.x, heading.y, 0.0);
    let w = if heading.z < 0.0 { level.dot(&level) / (1.0 - heading.z) } else { 1.0 + heading.z };
    if w < STRAIGHT_BACK {
        return turn_by(&(Vec3::new(across.x, -across.y, 0.0) * angle));
    }
    let along = level.dot(&across);
    let mut axis = across - level * (along / w);
    axis.z = -along;
    turn_by(&(axis * angle))
}
