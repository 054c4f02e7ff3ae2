//! Checks every imported tree.

use std::ops::RangeInclusive;

use orchard_geometry::Vec3;
use orchard_spec::Spec;
use orchard_treegen::{
    FruitSite, LeafSite, Segment, Skeleton, Spur, dress_with_fruit_sites, dress_with_leaves,
};

/// Allowed lengths of segments and blades \[m\]. Lengths outside come from noise or another unit.
pub(crate) const LENGTH: RangeInclusive<f64> = 1e-4..=100.0;
/// Allowed radii \[m\].
pub(crate) const RADIUS: RangeInclusive<f64> = 1e-4..=5.0;
/// Most segments; most fruit sites, leaves and spurs of each kind. Our own choice: ten times those of the largest digitised apple trees. An
/// episode in a world of 49,000 segments took 185 MiB (measured).
const MOST_SEGMENTS: usize = 50_000;
const MOST_SITES: usize = 1_000_000;
/// Largest distance of a segment's base from its parent's tip, and of the root's base from the origin \[m\]: below the accuracy
/// of measurements, above the rounding of text with seven digits.
pub(crate) const GAP: f64 = 1e-6;
/// Largest difference of a quaternion's norm from 1: rounding of text with seven digits.
const NORM: f64 = 1e-6;

/// Fault of an imported tree.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{part} {index}: {field} is {value}: {rule}")]
pub struct TreeFault {
    /// `segment`, `fruit site`, `leaf` or `spur`.
    pub part: &'static str,
    /// Index of the part, from 0.
    pub index: usize,
    /// Name of the field.
    pub field: &'static str,
    /// Value of the field.
    pub value: String,
    /// Rule that the value breaks.
    pub rule: String,
}

/// An imported tree that has passed all checks: one root at the origin, parents before children, every base on its
/// parent's tip, finite positive sizes, no wood under the ground. Fruit sites and leaves may be unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct DigitisedTree {
    segments: Vec<Segment>,
    fruit_sites: Option<Vec<FruitSite>>,
    leaves: Option<Vec<LeafSite>>,
    spurs: Vec<Spur>,
}

impl DigitisedTree {
    /// Checks a tree.
    ///
    /// # Errors
    /// The first fault that is found.
    pub fn new(
        segments: Vec<Segment>,
        fruit_sites: Option<Vec<FruitSite>>,
        leaves: Option<Vec<LeafSite>>,
    ) -> Result<Self, TreeFault> {
        if segments.is_empty() {
            return Err(fault("segment", 0, "index", "absent".into(), "a tree has at least one segment"));
        }
        most("segment", segments.len(), MOST_SEGMENTS)?;
        most("fruit site", fruit_sites.as_ref().map_or(0, Vec::len), MOST_SITES)?;
        most("leaf", leaves.as_ref().map_or(0, Vec::len), MOST_SITES)?;
        for index in 0..segments.len() {
            check_segment(&segments, index)?;
        }
        for (index, site) in fruit_sites.iter().flatten().enumerate() {
            let at = ("fruit site", index);
            segment_index(at, site.segment, &segments)?;
            point(at, "p_segment", &site.p_segment)?;
            within(at, "outerness", site.outerness, &(0.0..=1.0))?;
        }
        for (index, leaf) in leaves.iter().flatten().enumerate() {
            let at = ("leaf", index);
            segment_index(at, leaf.segment, &segments)?;
            point(at, "x_segment_leaf.translation", &leaf.x_segment_leaf.translation.vector)?;
            unit(at, "x_segment_leaf.rotation", leaf.x_segment_leaf.rotation.quaternion().norm())?;
            within(at, "length", leaf.length, &LENGTH)?;
            within(at, "width", leaf.width, &LENGTH)?;
            within(at, "size_class", f64::from(leaf.size_class), &(0.0..=2.0))?;
        }
        Ok(Self { segments, fruit_sites, leaves, spurs: Vec::new() })
    }

    /// Adds short branches to the segments.
    ///
    /// # Errors
    /// The first fault that is found.
    pub fn with_spurs(self, spurs: Vec<Spur>) -> Result<Self, TreeFault> {
        most("spur", spurs.len(), MOST_SITES)?;
        for (index, spur) in spurs.iter().enumerate() {
            let at = ("spur", index);
            segment_index(at, spur.segment, &self.segments)?;
            point(at, "p_segment", &spur.p_segment)?;
            within(at, "norm of heading_segment", spur.heading_segment.norm(), &(1.0 - NORM..=1.0 + NORM))?;
            within(at, "length", spur.length, &LENGTH)?;
        }
        Ok(Self { spurs, ..self })
    }

    /// Segments of the tree.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Makes a skeleton. Fruit sites and leaves of the file are kept; absent ones are placed by the config's
    /// rules, leaves with the random numbers of one world of a seed.
    pub fn into_skeleton(self, spec: &Spec, seed: u64, world: u32) -> Skeleton {
        let fruit_sites = self.fruit_sites.unwrap_or_else(|| dress_with_fruit_sites(spec, &self.segments));
        let leaves = self.leaves.unwrap_or_else(|| dress_with_leaves(spec, &self.segments, seed, world));
        Skeleton { segments: self.segments, fruit_sites, leaves, spurs: self.spurs }
    }
}

type At = (&'static str, usize);

fn fault(
    part: &'static str,
    index: usize,
    field: &'static str,
    value: String,
    rule: impl Into<String>,
) -> TreeFault {
    TreeFault { part, index, field, value, rule: rule.into() }
}

fn most(part: &'static str, count: usize, most: usize) -> Result<(), TreeFault> {
    if count <= most {
        return Ok(());
    }
    Err(fault(part, most, "count", count.to_string(), format!("a tree has at most {most}")))
}

fn check_segment(segments: &[Segment], index: usize) -> Result<(), TreeFault> {
    let (at, segment) = (("segment", index), &segments[index]);
    let (p_joint, joint) = match segment.parent {
        None if index == 0 => (Vec3::zeros(), "the origin"),
        None => return Err(fault(at.0, index, "parent", "none".into(), "only segment 0 is a root")),
        Some(parent) if parent < index => (segments[parent].p_tip_world(), "its parent's tip"),
        Some(parent) => {
            let rule = "a parent must come before its children";
            return Err(fault(at.0, index, "parent", parent.to_string(), rule));
        }
    };
    within(at, "length", segment.length, &LENGTH)?;
    within(at, "radius", segment.radius, &RADIUS)?;
    point(at, "p_base_world", &segment.p_base_world)?;
    unit(at, "r_world_segment", segment.r_world_segment.quaternion().norm())?;
    if (segment.p_base_world - p_joint).norm() > GAP {
        let rule = format!("it must lie within {GAP:e} m of {joint}, {}", text(&p_joint));
        return Err(fault(at.0, index, "p_base_world", text(&segment.p_base_world), rule));
    }
    let tip = segment.p_tip_world();
    if tip.z < -GAP {
        return Err(fault(at.0, index, "tip", text(&tip), "wood stands above the ground, z = 0"));
    }
    Ok(())
}

fn segment_index(at: At, segment: usize, segments: &[Segment]) -> Result<(), TreeFault> {
    if segment < segments.len() {
        return Ok(());
    }
    let rule = format!("the tree has {} segments, numbered from 0", segments.len());
    Err(fault(at.0, at.1, "segment", segment.to_string(), rule))
}

/// Checks a range; NaN fails.
fn within(at: At, field: &'static str, value: f64, range: &RangeInclusive<f64>) -> Result<(), TreeFault> {
    if range.contains(&value) {
        return Ok(());
    }
    let rule = format!("the allowed range is [{}, {}]", range.start(), range.end());
    Err(fault(at.0, at.1, field, value.to_string(), rule))
}

fn unit(at: At, field: &'static str, norm: f64) -> Result<(), TreeFault> {
    if (norm - 1.0).abs() <= NORM {
        return Ok(());
    }
    Err(fault(at.0, at.1, field, format!("a quaternion of norm {norm}"), "a rotation has norm 1"))
}

fn point(at: At, field: &'static str, p: &Vec3) -> Result<(), TreeFault> {
    if p.iter().all(|x| x.abs() <= *LENGTH.end()) {
        return Ok(());
    }
    Err(fault(at.0, at.1, field, text(p), format!("coordinates lie within {} m", LENGTH.end())))
}

fn text(p: &Vec3) -> String {
    format!("({}, {}, {})", p.x, p.y, p.z)
}
