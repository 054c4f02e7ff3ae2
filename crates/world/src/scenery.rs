//! Posts and wires of a row: static solids that the robot, loose fruit and debris meet and the camera sees.
//!
//! The row runs along the world's x axis through the tree. Wood does not touch them: the ties between them and the tree
//! are left out, so the wood hangs as it grew (`docs/conventions.md`).

use crate::groups;
use orchard_camera::{Geometry, Item, Label, Rgb};
use orchard_geometry::{Pose, Shape, Vec3, math, rotation_from_z};
use orchard_multibody::{Collider, ColliderId, ModelBuilder, Owner};
use orchard_spec::scenery::ScenerySpec;
use orchard_spec::{Spec, Stream};
use orchard_treegen::Skeleton;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Galvanised steel.
const STEEL: Rgb = [0.42, 0.43, 0.44];

/// A post or a wire: a capsule.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Strut {
    pub p_base_world: Vec3,
    pub p_tip_world: Vec3,
    pub radius: f64,
    pub is_wire: bool,
}

impl Strut {
    fn shape(&self) -> Shape {
        Shape::Capsule { radius: self.radius, length: (self.p_tip_world - self.p_base_world).norm() }
    }

    fn x_world_shape(&self) -> Pose {
        let along = self.p_tip_world - self.p_base_world;
        Pose::from_parts(self.p_base_world.into(), rotation_from_z(&along.normalize()))
    }

    /// Distance from its surface to a point, negative inside \[m\].
    pub fn distance(&self, p_world: &Vec3) -> f64 {
        let along = self.p_tip_world - self.p_base_world;
        let share = (p_world - self.p_base_world).dot(&along) / along.norm_squared();
        (p_world - self.p_base_world - along * share.clamp(0.0, 1.0)).norm() - self.radius
    }
}

/// The posts and wires of a config, none without a row.
pub(crate) fn struts(spec: Option<&ScenerySpec>) -> Vec<Strut> {
    let Some(spec) = spec else { return Vec::new() };
    let planes = planes(spec);
    let half_row = 0.5 * f64::from(spec.posts.get() - 1) * spec.post_spacing.si();
    let (radius, wire_radius) = (spec.post_radius.si(), spec.wire_radius.si());
    let strut = |p_base_world, p_tip_world| Strut { p_base_world, p_tip_world, radius, is_wire: false };
    let mut struts = Vec::new();
    for k in 0..spec.posts.get() {
        let along_row = Vec3::x() * (f64::from(k) * spec.post_spacing.si() - half_row);
        let fork = along_row + Vec3::z() * spec.fork_height.si();
        if spec.fork_height.si() > 0.0 {
            struts.push(strut(along_row, fork));
        }
        // A post no taller than its fork ends there.
        let arms = if spec.post_height.si() > spec.fork_height.si() { planes.as_slice() } else { &[] };
        for plane in arms {
            struts.push(strut(fork, along_row + plane.at_height(spec.post_height.si())));
        }
    }
    for plane in &planes {
        for k in 0..spec.wires.get() {
            let p = plane.at_height(spec.lowest_wire.si())
                + plane.up * (f64::from(k) * spec.wire_spacing.si())
                + plane.outward * spec.wire_offset.si();
            let [p_base_world, p_tip_world] = [p - Vec3::x() * half_row, p + Vec3::x() * half_row];
            struts.push(Strut { p_base_world, p_tip_world, radius: wire_radius, is_wire: true });
        }
    }
    struts
}

/// A plane of wires through the row.
struct Plane {
    fork_height: f64,
    /// Unit vector up the plane, across the row.
    up: Vec3,
    /// Unit normal to the alley and the ground.
    outward: Vec3,
}

impl Plane {
    /// Point of the plane over the row's middle at a height \[m\].
    fn at_height(&self, z: f64) -> Vec3 {
        Vec3::z() * self.fork_height + self.up * ((z - self.fork_height) / self.up.z)
    }
}

/// One upright plane, or two that lean into the alleys.
fn planes(spec: &ScenerySpec) -> Vec<Plane> {
    let lean = spec.lean.si();
    let (sin, cos) = math::sin_cos(lean);
    let sides: &[f64] = if lean < FRAC_PI_2 { &[1.0, -1.0] } else { &[1.0] };
    let plane = |&side: &f64| Plane {
        fork_height: spec.fork_height.si(),
        up: Vec3::new(0.0, side * cos, sin),
        outward: Vec3::new(0.0, side * sin, -cos),
    };
    sides.iter().map(plane).collect()
}

/// Adds the colliders of posts and wires.
pub(crate) fn add_to(
    builder: &mut ModelBuilder,
    spec: Option<&ScenerySpec>,
    struts: &[Strut],
) -> Vec<ColliderId> {
    let Some(spec) = spec else { return Vec::new() };
    let collider = |strut: &Strut| Collider {
        owner: Owner::World,
        shape: strut.shape(),
        x_owner_shape: strut.x_world_shape(),
        groups: groups::SCENERY_GROUPS,
        friction: spec.friction.si(),
        stiffness: spec.contact_stiffness.si(),
    };
    struts.iter().map(|strut| builder.add_collider(collider(strut))).collect()
}

/// Takes away the sites whose largest fruit would hang in a post or a wire, or nearer to one than the contact margin.
pub(crate) fn clear_fruit_sites(skeleton: &mut Skeleton, struts: &[Strut], spec: &Spec) {
    let (fruit, margin) = (&spec.fruit, spec.sim.contact_margin.si());
    let radius = fruit.radius.si().1;
    let hang = Vec3::z() * (fruit.stem_length.si() + radius);
    let Skeleton { segments, fruit_sites, .. } = skeleton;
    fruit_sites.retain(|site| {
        let segment = &segments[site.segment];
        let p_hang = segment.p_base_world + segment.r_world_segment * site.p_segment - hang;
        is_clear(struts, &p_hang, radius, margin)
    });
}

/// True if a fruit about a point is farther than `margin` \[m\] from every post and wire.
pub(crate) fn is_clear(struts: &[Strut], p_world: &Vec3, radius: f64, margin: f64) -> bool {
    struts.iter().all(|strut| strut.distance(p_world) > radius + margin)
}

/// Bearing of the robot's start, seen from the trunk \[rad\]: any bearing around a tree that stands alone, in either alley
/// of a row.
pub(crate) fn start_bearing(spec: Option<&ScenerySpec>, stream: &mut Stream) -> f64 {
    let bearing = stream.uniform(0.0, TAU);
    match spec {
        None => bearing,
        Some(spec) => {
            let alley = if bearing < PI { FRAC_PI_2 } else { -FRAC_PI_2 };
            alley + stream.within(spec.start_bearing.si())
        }
    }
}

/// Posts and wires as the camera sees them; the instance is their number.
pub(crate) fn items(struts: &[Strut]) -> impl Iterator<Item = Item> {
    struts.iter().enumerate().map(|(i, strut)| Item {
        geometry: Geometry::Shape(strut.shape()),
        x_world_item: strut.x_world_shape(),
        label: Label::Scenery,
        instance: i as u32,
        color: strut.is_wire.then_some(STEEL),
        tint: None,
    })
}

/// True if a place of the robot's base lies in an alley that it can reach from its start without crossing the row.
pub(crate) fn same_alley(struts: &[Strut], x_world_start: &Pose, x_world_base: &Pose) -> bool {
    struts.is_empty() || x_world_start.translation.y * x_world_base.translation.y > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_spec::{Preset, Purpose};

    fn scenery(preset: Preset) -> (ScenerySpec, Vec<Strut>) {
        let spec = Spec::preset(preset).scenery.unwrap();
        let struts = struts(Some(&spec));
        (spec, struts)
    }

    #[test]
    fn a_post_no_taller_than_its_fork_has_no_arms() {
        let mut spec = Spec::preset(Preset::VTrellis).scenery.unwrap();
        let whole = struts(Some(&spec)).len();
        spec.post_height = spec.post_height.with_value(spec.fork_height.value()).unwrap();
        let cut = struts(Some(&spec));
        assert_eq!(cut.len(), whole - 2 * spec.posts.get() as usize);
        assert!(cut.iter().all(|strut| (strut.p_tip_world - strut.p_base_world).norm() > 0.0));
    }

    #[test]
    fn a_tree_alone_has_none() {
        assert!(Spec::paper().scenery.is_none() && struts(None).is_empty());
    }

    /// Wires lie level along the row, at their distance from the posts, from the first post to the last.
    #[test]
    fn wires_run_along_the_posts() {
        for preset in [Preset::TallSpindle, Preset::VTrellis, Preset::VerticalUfo] {
            let (spec, struts) = scenery(preset);
            let (wires, posts): (Vec<_>, Vec<_>) = struts.iter().partition(|s| s.is_wire);
            let planes = if spec.lean.si() < FRAC_PI_2 { 2 } else { 1 };
            assert_eq!(wires.len(), planes * spec.wires.get() as usize);
            let most = (planes + 1) * spec.posts.get() as usize;
            assert!(posts.len() == most || posts.len() == spec.posts.get() as usize);
            for wire in wires {
                let along = wire.p_tip_world - wire.p_base_world;
                assert!(along.yz().norm() == 0.0 && (along.x - 15.0).abs() < 1e-12);
                for end in [&wire.p_base_world, &wire.p_tip_world] {
                    let gap = posts.iter().map(|p| p.distance(end)).fold(f64::INFINITY, f64::min);
                    assert!(
                        (gap + spec.post_radius.si() - spec.wire_offset.si()).abs() < 1e-12,
                        "{preset}: {gap}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_v_leans_into_both_alleys() {
        let (spec, struts) = scenery(Preset::VTrellis);
        let top = struts.iter().filter(|s| s.is_wire).map(|s| s.p_base_world.y).fold(0.0, f64::max);
        let rise = spec.lowest_wire.si() - spec.fork_height.si()
            + f64::from(spec.wires.get() - 1) * spec.wire_spacing.si() * math::sin(spec.lean.si());
        let (sin, cos) = math::sin_cos(spec.lean.si());
        let off = spec.wire_offset.si() * sin;
        assert!((top - (rise * cos / sin + off)).abs() < 1e-12, "{top}");
        let sum: f64 = struts.iter().map(|s| s.p_tip_world.y).sum();
        assert!(sum.abs() < 1e-12, "{sum}");
    }

    #[test]
    fn the_robot_starts_in_an_alley() {
        let (spec, _) = scenery(Preset::VerticalUfo);
        let (mut left, mut right) = (0, 0);
        for world in 0..200 {
            let bearing = start_bearing(Some(&spec), &mut Stream::new(3, world, Purpose::RobotStart));
            assert!(math::sin(bearing).abs() >= 0.5_f64.sqrt() - 1e-12);
            if math::sin(bearing) > 0.0 { left += 1 } else { right += 1 }
        }
        assert!(left > 60 && right > 60, "{left} {right}");
    }
}
