//! Reshapes a grown tree to another habit and other dimensions: the same segments, lengthened, thickened and turned.
//!
//! Rotations pass from parents to children, so that the droop of each internode adds up to
//! the arch of a limb. Equations: `docs/computation/randomisation.md`.

use orchard_geometry::{Pose, Rotation, Vec3, math, rotation_from_z};
use std::f64::consts::PI;

use crate::{
    FruitSite, LeafSite, Segment, Skeleton, Spur, TreegenError, assemble, clearance,
    fruit_sites::{canopy_radius, outerness},
    leaves::face_up,
    segment_map::SegmentMap,
    turtle::{Internode, droop_rotation},
};

/// Changes of a tree's wood. Lists have one entry a segment.
#[derive(Debug, Clone, PartialEq)]
pub struct Habit {
    /// Factors on lengths.
    pub length: Vec<f64>,
    /// Factors on radii.
    pub radius: Vec<f64>,
    /// Bend at each segment's base \[rad\], about an axis across the heading, and that axis's azimuth \[rad\]. The bend of
    /// the trunk's first segment is ignored.
    pub bend: Vec<(f64, f64)>,
    /// Downward bend at the base of every segment of a limb (order 1 and higher) \[rad\].
    pub droop: f64,
    /// Rotation vector of the whole tree about its foot, world \[rad\].
    pub lean_world: Vec3,
    /// Factor on the angle between a lateral and its parent.
    pub fork_spread: f64,
    /// Roll of the n-th lateral of an axis about its parent, over n (from 0) \[rad\].
    pub twist: f64,
}

impl Habit {
    /// True if the habit changes nothing.
    pub fn is_neutral(&self) -> bool {
        let ones = |factors: &[f64]| factors.iter().all(|&f| f == 1.0);
        ones(&self.length)
            && ones(&self.radius)
            && self.bend.iter().all(|&(angle, _)| angle == 0.0)
            && (self.droop, self.fork_spread, self.twist) == (0.0, 1.0, 0.0)
            && self.lean_world == Vec3::zeros()
    }
}

/// Returns the tree in another habit: the same segments with the same spurs, fruit sites and leaves, which keep their places on the
/// wood; blades are turned about their midribs to face up again. No segment is thicker than its parent, and branches
/// are again lifted above the ground clearance \[m\]. The height is not restored.
///
/// # Errors
/// A branch starts too low to clear the ground.
pub fn reshape(base: &Skeleton, habit: &Habit, clearance: f64) -> Result<Skeleton, TreegenError> {
    let mut internodes = turned(&base.segments, habit);
    let radii = thickened(&base.segments, &habit.radius);
    clearance::lift(&mut internodes, &radii, clearance).map_err(|segment| TreegenError::Clearance {
        segment,
        clearance,
        height: clearance::top(&internodes),
    })?;
    let segments = assemble::segments(&internodes, &radii);
    let maps: Vec<SegmentMap> =
        base.segments.iter().zip(&segments).map(|(a, b)| SegmentMap::new(a, b)).collect();
    let canopy_radius = canopy_radius(&segments);
    let fruit_site = |site: &FruitSite| {
        let p_segment = maps[site.segment].point(&site.p_segment);
        let segment = &segments[site.segment];
        let p_world = segment.p_base_world + segment.heading() * p_segment.z;
        FruitSite { p_segment, outerness: outerness(&p_world, canopy_radius), ..site.clone() }
    };
    let leaf = |leaf: &LeafSite| mapped_leaf(leaf, &maps[leaf.segment], &segments[leaf.segment]);
    let spur = |spur: &Spur| {
        let map = &maps[spur.segment];
        Spur {
            p_segment: map.point(&spur.p_segment),
            heading_segment: map.direction(&spur.heading_segment),
            ..spur.clone()
        }
    };
    Ok(Skeleton {
        spurs: base.spurs.iter().map(spur).collect(),
        fruit_sites: base.fruit_sites.iter().map(fruit_site).collect(),
        leaves: base.leaves.iter().map(leaf).collect(),
        segments,
    })
}

fn mapped_leaf(leaf: &LeafSite, map: &SegmentMap, segment: &Segment) -> LeafSite {
    let p_segment = map.point(&leaf.x_segment_leaf.translation.vector);
    let midrib = segment.r_world_segment * map.direction(&(leaf.x_segment_leaf.rotation * Vec3::x()));
    let outward = Vec3::new(p_segment.x, p_segment.y, 0.0);
    let rotation = face_up(&segment.r_world_segment, midrib.normalize(), &outward);
    LeafSite { x_segment_leaf: Pose::from_parts(p_segment.into(), rotation), ..leaf.clone() }
}

/// Radii times their factors, none above its parent's.
fn thickened(segments: &[Segment], factors: &[f64]) -> Vec<f64> {
    let mut radii: Vec<f64> = Vec::with_capacity(segments.len());
    for (segment, factor) in segments.iter().zip(factors) {
        let radius = segment.radius * factor;
        radii.push(segment.parent.map_or(radius, |parent| radius.min(radii[parent])));
    }
    radii
}

/// Headings and lengths of all segments, parents first.
fn turned(segments: &[Segment], habit: &Habit) -> Vec<Internode> {
    let mut internodes: Vec<Internode> = Vec::with_capacity(segments.len());
    // Rotation of each segment, which its children inherit.
    let mut turns: Vec<Rotation> = Vec::with_capacity(segments.len());
    // The first segment of a segment's axis, and laterals of the axis so far (counted there).
    let mut axes: Vec<usize> = Vec::with_capacity(segments.len());
    let mut laterals = vec![0_u32; segments.len()];
    for (i, segment) in segments.iter().enumerate() {
        let base_heading = segment.heading();
        let mut turn = segment.parent.map_or(Rotation::from_scaled_axis(habit.lean_world), |p| turns[p]);
        let mut axis = i;
        if let Some(parent) = segment.parent {
            let along = &internodes[parent].heading;
            if segment.order == segments[parent].order {
                axis = axes[parent];
            } else {
                let ordinal = &mut laterals[axes[parent]];
                turn = Rotation::from_scaled_axis(along * (habit.twist * f64::from(*ordinal))) * turn;
                *ordinal += 1;
                turn = spread(along, &(turn * base_heading), habit.fork_spread) * turn;
            }
            if segment.order > 0 {
                turn = droop_rotation(&(turn * base_heading), habit.droop) * turn;
            }
            turn = bent(&(turn * base_heading), habit.bend[i]) * turn;
        }
        internodes.push(Internode {
            parent: segment.parent,
            heading: (turn * base_heading).normalize(),
            length: segment.length * habit.length[i],
            width: segment.radius,
            order: segment.order,
            unit: None,
        });
        turns.push(Rotation::new_normalize(turn.into_inner()));
        axes.push(axis);
    }
    internodes
}

/// Rotation that multiplies a lateral's angle to its parent's heading by a factor, in the plane of both.
fn spread(along: &Vec3, heading: &Vec3, factor: f64) -> Rotation {
    let axis = along.cross(heading);
    let sine = axis.norm();
    if sine == 0.0 {
        return Rotation::identity();
    }
    let angle = math::atan2(sine, along.dot(heading));
    Rotation::from_scaled_axis(axis * (((angle * factor).min(PI) - angle) / sine))
}

/// Rotation that bends a heading about an axis across it.
fn bent(heading: &Vec3, (angle, azimuth): (f64, f64)) -> Rotation {
    let (sin, cos) = math::sin_cos(azimuth);
    Rotation::from_scaled_axis(rotation_from_z(heading) * Vec3::new(cos, sin, 0.0) * angle)
}

#[cfg(test)]
#[path = "habit_tests.rs"]
mod tests;
