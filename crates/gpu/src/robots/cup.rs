//! The suction cup of a robot, as the kernels read it.

use bytemuck::{Pod, Zeroable};
use orchard_geometry::Pose;
use orchard_multibody::ColliderId;
use orchard_robot::{RobotHandle, Suction};

use crate::layout::{QUAD, robot};

/// Constants of a suction cup; all zeros without one. `kernels/robot.wgsl` has the same fields in the same order, and explains them.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct CupTable {
    points: u32,
    link: i32,
    first: u32,
    radius: f32,
    half_thickness: f32,
    follow: f32,
    curve_radius_min: f32,
    leaf_gap: f32,
    vacuum_max: f32,
    leak_half: f32,
    rise_time: f32,
    area: f32,
    p_link: [f32; 3],
    spacing: f32,
    x_link: [f32; 3],
    unused: f32,
    z_link: [f32; 3],
    unused_too: f32,
    p_lip: [[f32; QUAD]; robot::LIP],
}

impl CupTable {
    /// Constants of a robot's cup. Of the last arm link, its link and the pose of its frame there.
    ///
    /// # Errors
    /// The lip has more points than the kernels know.
    pub fn new(handle: &RobotHandle, link: i32, x_link_frame: &Pose) -> Result<Self, String> {
        let Some(cup) = &handle.cup else { return Ok(Self::zeroed()) };
        let (points, most) = (cup.lip_p_lip.len(), robot::LIP);
        if points > most {
            return Err(format!("the lip of its suction cup has {points} points, the kernels know {most}"));
        }
        let x_link_lip = x_link_frame * cup.x_wrist_lip;
        let axes = x_link_lip.rotation.to_rotation_matrix().into_inner();
        let mut own = Self {
            points: points as u32,
            link,
            first: handle.colliders.cup.first().map_or(0, |id: &ColliderId| id.index() as u32),
            radius: cup.lip_radius as f32,
            half_thickness: cup.half_thickness as f32,
            follow: cup.follow as f32,
            curve_radius_min: cup.curve_radius_min as f32,
            leaf_gap: cup.leaf_gap as f32,
            vacuum_max: cup.vacuum_max as f32,
            leak_half: cup.leak_half as f32,
            rise_time: cup.rise_time as f32,
            area: cup.area() as f32,
            p_link: x_link_lip.translation.vector.cast().into(),
            spacing: cup.spacing() as f32,
            x_link: axes.column(0).into_owned().cast().into(),
            z_link: axes.column(2).into_owned().cast().into(),
            ..Self::zeroed()
        };
        for (to, p) in own.p_lip.iter_mut().zip(&cup.lip_p_lip) {
            to[..3].copy_from_slice(p.cast().as_slice());
        }
        Ok(own)
    }
}

/// Fields of a robot's state that tell of its suction cup, with their values.
pub(super) fn fields_of(suction: &Suction) -> [(usize, f32); 3] {
    let fruit = suction.fruit.map_or(0, |fruit| fruit as u32 + 1);
    [
        (robot::VACUUM, suction.vacuum as f32),
        (robot::CUP_FRUIT, f32::from_bits(fruit)),
        // Points beyond the largest number are refused.
        (robot::CUP_CLOSED, f32::from_bits(suction.closed as u32)),
    ]
}

/// Vacuum of a suction cup, given as the fields of a robot's state.
pub(crate) fn suction(number: impl Fn(usize) -> f32) -> Suction {
    Suction {
        vacuum: f64::from(number(robot::VACUUM)),
        fruit: (number(robot::CUP_FRUIT).to_bits() as usize).checked_sub(1),
        closed: u64::from(number(robot::CUP_CLOSED).to_bits()),
    }
}
