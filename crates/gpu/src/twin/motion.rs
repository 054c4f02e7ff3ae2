//! How a link's tip moves, and a joint between two links.

use super::Lane;
use super::math::{Vec3, sin_cos};
use crate::layout::link;

/// Axes.
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

/// Motion of a tip. The bias accelerations are those with all joints at constant rates.
#[derive(Clone, Copy)]
pub(super) struct Motion {
    pub axes: Axes,
    pub w: Vec3,
    pub b_w: Vec3,
    pub v: Vec3,
    pub b_v: Vec3,
}

impl Motion {
    /// The ground's.
    pub fn still() -> Self {
        let zero = Vec3::zeros();
        Self { axes: Axes::world(), w: zero, b_w: zero, v: zero, b_v: zero }
    }
}

/// A link's constants and state. A kernel reads them at once and ahead, so that it waits for memory once.
#[derive(Clone, Copy)]
pub(super) struct Link {
    pub direction: Vec3,
    pub length: f32,
    pub mass: f32,
    pub across: f32,
    pub excess: f32,
    pub stiffness: f32,
    pub q: [f32; 2],
    pub v: [f32; 2],
}

/// What the way out needs of it.
#[derive(Clone, Copy)]
pub(super) struct Hinge {
    pub direction: Vec3,
    pub length: f32,
    pub q: [f32; 2],
    pub v: [f32; 2],
}

/// A joint turned by its angles: the first axis, the link's axes (of which y is the second joint axis), and the direction into which the
/// rate about the second turns the first.
#[derive(Clone, Copy)]
pub(super) struct Joint {
    pub first: Vec3,
    pub third: Vec3,
    pub axes: Axes,
}

/// From the parent's axes outwards: the smallest turn that carries z onto the direction c, u = z + (c_x x + c_y y) / (1 + c_z), then the angles.
pub(super) fn joint_outward(parent: &Axes, c: Vec3, q: [f32; 2]) -> Joint {
    let across = parent.x * c.x + parent.y * c.y;
    let u = across * (1.0 / (1.0 + c.z)) + parent.z;
    let (first, frame_y) = (parent.x - u * c.x, parent.y - u * c.y);
    let frame_z = parent.z * c.z + across;
    let ([s_1, c_1], [s_2, c_2]) = (sin_cos(q[0]), sin_cos(q[1]));
    let y = frame_y * c_1 + frame_z * s_1;
    let third = frame_z * c_1 - frame_y * s_1;
    Joint { first, third, axes: Axes { x: first * c_2 - third * s_2, y, z: first * s_2 + third * c_2 } }
}

/// From the link's axes inwards, the same joint; and the parent's axes.
pub(super) fn joint_inward(link: &Axes, c: Vec3, q: [f32; 2]) -> (Joint, Axes) {
    let ([s_1, c_1], [s_2, c_2]) = (sin_cos(q[0]), sin_cos(q[1]));
    let first = link.x * c_2 + link.z * s_2;
    let third = link.z * c_2 - link.x * s_2;
    let frame_y = link.y * c_1 - third * s_1;
    let frame_z = link.y * s_1 + third * c_1;
    let across = first * c.x + frame_y * c.y;
    let u = frame_z - across * (1.0 / (1.0 + c.z));
    let parent = Axes { x: first + u * c.x, y: frame_y + u * c.y, z: frame_z * c.z - across };
    (Joint { first, third, axes: *link }, parent)
}

impl Lane<'_> {
    pub(super) fn read_link(&self, row: usize) -> Link {
        let number = |field: usize| self.link(row, field);
        Link {
            direction: Vec3::from_fn(|k, _| number(link::DIRECTION + k)),
            length: number(link::LENGTH),
            mass: number(link::MASS),
            across: number(link::ACROSS),
            excess: number(link::EXCESS),
            stiffness: number(link::STIFFNESS),
            q: [0, 1].map(|k| number(link::Q + k)),
            v: [0, 1].map(|k| number(link::V + k)),
        }
    }

    pub(super) fn read_hinge(&self, row: usize) -> Hinge {
        let Link { direction, length, q, v, .. } = self.read_link(row);
        Hinge { direction, length, q, v }
    }

    /// A motion from `field` on.
    pub(super) fn motion(&self, at: usize, field: usize) -> Motion {
        let [y, z, w, b_w, v, b_v] = self.vectors(at, field);
        Motion { axes: Axes::of(y, z), w, b_w, v, b_v }
    }

    pub(super) fn set_motion(&mut self, at: usize, field: usize, motion: &Motion) {
        let Motion { axes, w, b_w, v, b_v } = *motion;
        self.set_vectors(at, field, &[axes.y, axes.z, w, b_w, v, b_v]);
    }
}
