//! Leaves on the twigs.

use orchard_geometry::{Pose, Rotation, Vec3, math};
use orchard_spec::{Stream, foliage::FoliageSpec};

use crate::{
    skeleton::{LeafSite, Segment},
    turtle::droop_rotation,
};

/// Leaves of every twig internode of high enough order, evenly spaced along it on a spiral, the last at its tip.
pub(crate) fn leaves(spec: &FoliageSpec, segments: &[Segment], mut stream: Stream) -> Vec<LeafSite> {
    let per_internode = spec.leaves_per_internode();
    let (blade_length, blade_width) = spec.blade_size();
    let mut leaves = Vec::new();
    for (i, segment) in segments.iter().enumerate() {
        if u32::from(segment.order) < spec.lowest_order() {
            continue;
        }
        let mut azimuth = stream.uniform(0.0, std::f64::consts::TAU);
        for k in 1..=per_internode {
            azimuth += stream.within(spec.divergence.si());
            let along = segment.length * f64::from(k) / f64::from(per_internode);
            let petiole_angle = stream.within(spec.petiole_angle.si());
            let droop = stream.within(spec.blade_droop.si());
            let size_class = stream.integer(0, 2) as u8;
            let scale = 1.0 + (f64::from(size_class) - 1.0) * spec.size_step.si();

            let (sin_azimuth, cos_azimuth) = math::sin_cos(azimuth);
            let outward = Vec3::new(cos_azimuth, sin_azimuth, 0.0);
            let (sin_petiole, cos_petiole) = math::sin_cos(petiole_angle);
            let petiole = outward * sin_petiole + Vec3::z() * cos_petiole;
            let p_segment = Vec3::z() * along + outward * segment.radius + petiole * spec.petiole_length.si();
            leaves.push(LeafSite {
                segment: i,
                x_segment_leaf: Pose::from_parts(
                    p_segment.into(),
                    blade_rotation(&segment.r_world_segment, &petiole, &outward, droop),
                ),
                length: blade_length * scale,
                width: blade_width * scale,
                size_class,
            });
        }
    }
    leaves
}

/// Rotation of the blade in the segment's frame: the midrib (+x) goes on from the petiole, bent towards the
/// ground by `droop` [rad]; the upper face (+z) looks as far up as the midrib allows.
fn blade_rotation(r_world_segment: &Rotation, petiole: &Vec3, outward: &Vec3, droop: f64) -> Rotation {
    let petiole_world = r_world_segment * petiole;
    let midrib = (droop_rotation(&petiole_world, droop) * petiole_world).normalize();
    face_up(r_world_segment, midrib, outward)
}

/// Rotation in the segment's frame of a blade with a given midrib (unit, world): its upper face looks as far up as the
/// midrib allows; straight down it looks `outward` (segment frame).
pub(crate) fn face_up(r_world_segment: &Rotation, midrib: Vec3, outward: &Vec3) -> Rotation {
    let across = |v: Vec3| (v - midrib * midrib.dot(&v)).try_normalize(1e-6);
    // A blade that hangs straight down faces away from the twig.
    let upper = across(Vec3::z()).or_else(|| across(r_world_segment * outward)).unwrap_or_else(|| {
        // Midrib vertical and twig level: any face across the midrib will do.
        Vec3::x()
    });
    let r_world_leaf = Rotation::from_basis_unchecked(&[midrib, upper.cross(&midrib), upper]);
    r_world_segment.inverse() * r_world_leaf
}
