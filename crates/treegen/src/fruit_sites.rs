//! Sites where fruit may hang.

use orchard_geometry::Vec3;
use orchard_spec::Spec;

use crate::skeleton::{FruitSite, Segment};

/// Fruit sites on wood of high enough order and a radius below the limit: evenly spaced
/// along the segment, the last at its tip, on the bark's underside. `outerness` is the site's horizontal
/// distance from the trunk's axis over the largest of any tip.
pub(crate) fn fruit_sites(spec: &Spec, segments: &[Segment]) -> Vec<FruitSite> {
    let canopy_radius = canopy_radius(segments);
    let per_segment = spec.tree.fruit_sites.get();
    let mut sites = Vec::new();
    for (i, segment) in segments.iter().enumerate() {
        if u32::from(segment.order) < spec.fruit.min_order.get()
            || segment.radius >= spec.fruit.spur_radius_max.si()
        {
            continue;
        }
        let underside = underside(segment);
        for k in 1..=per_segment {
            let along = segment.length * f64::from(k) / f64::from(per_segment);
            let p_segment = Vec3::z() * along + underside * segment.radius;
            let p_world = segment.p_base_world + segment.heading() * along;
            let outerness = outerness(&p_world, canopy_radius);
            sites.push(FruitSite { segment: i, p_segment, outerness });
        }
    }
    sites
}

/// Largest horizontal distance of any tip from the trunk's axis \[m\].
pub(crate) fn canopy_radius(segments: &[Segment]) -> f64 {
    segments.iter().map(|s| s.p_tip_world().xy().norm()).fold(0.0, f64::max)
}

/// Horizontal distance of a point from the trunk's axis over the canopy's radius, at most 1.
pub(crate) fn outerness(p_world: &Vec3, canopy_radius: f64) -> f64 {
    if canopy_radius > 0.0 { (p_world.xy().norm() / canopy_radius).min(1.0) } else { 0.0 }
}

/// Unit vector across the wood to its lower side, in the segment's frame; zero where the wood is vertical.
pub fn underside(segment: &Segment) -> Vec3 {
    let down = segment.r_world_segment.inverse() * -Vec3::z();
    let across = Vec3::new(down.x, down.y, 0.0);
    // Within a microradian of the vertical the lower side is rounding noise.
    across.try_normalize(1e-6).unwrap_or_else(Vec3::zeros)
}
