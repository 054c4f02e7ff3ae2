//! Makes segments with frames from internodes and radii.

use orchard_geometry::{Rotation, Vec3, rotation_from_z};

use crate::{skeleton::Segment, turtle::Internode};

/// Places every internode and gives it a frame: the parent's frame, turned by the smallest rotation that
/// turns the parent's heading into its own. The frames therefore have no twist about the wood.
pub fn segments(internodes: &[Internode], radii: &[f64]) -> Vec<Segment> {
    let mut segments: Vec<Segment> = Vec::with_capacity(internodes.len());
    for (internode, &radius) in internodes.iter().zip(radii) {
        let (p_base_world, r_world_parent) = match internode.parent {
            Some(parent) => (segments[parent].p_tip_world(), segments[parent].r_world_segment),
            None => (Vec3::zeros(), Rotation::identity()),
        };
        let heading_parent = r_world_parent.inverse() * internode.heading;
        segments.push(Segment {
            parent: internode.parent,
            p_base_world,
            // Composition rounds the quaternion's norm; normalising keeps the error from growing along a limb.
            r_world_segment: Rotation::new_normalize(
                (r_world_parent * rotation_from_z(&heading_parent.normalize())).into_inner(),
            ),
            length: internode.length,
            radius,
            order: internode.order,
        });
    }
    segments
}
