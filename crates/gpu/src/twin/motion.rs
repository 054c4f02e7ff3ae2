//! Axes of a link.

use super::math::{Vec3, sin_cos};

/// Orthonormal axes of a link, in world coordinates.
#[derive(Clone, Copy)]
pub(super) struct Axes {
    pub x: Vec3,
    pub y: Vec3,
    pub z: Vec3,
}

impl Axes {
    pub fn of(y: Vec3, z: Vec3) -> Self {
        Self { x: y.cross(&z), y, z }
    }

    pub fn world() -> Self {
        Self { x: Vec3::x(), y: Vec3::y(), z: Vec3::z() }
    }
}

/// Axes of a link from its parent's: the smallest rotation that carries z onto the direction c, with u = z + (c_x x + c_y y) / (1 + c_z), then the two joint angles [rad].
pub(super) fn joint_outward(parent: &Axes, c: Vec3, q: [f32; 2]) -> Axes {
    let across = parent.x * c.x + parent.y * c.y;
    let u = across * (1.0 / (1.0 + c.z)) + parent.z;
    let (first, frame_y) = (parent.x - u * c.x, parent.y - u * c.y);
    let frame_z = parent.z * c.z + across;
    let ([s_1, c_1], [s_2, c_2]) = (sin_cos(q[0]), sin_cos(q[1]));
    let y = frame_y * c_1 + frame_z * s_1;
    let third = frame_z * c_1 - frame_y * s_1;
    Axes { x: first * c_2 - third * s_2, y, z: first * s_2 + third * c_2 }
}
