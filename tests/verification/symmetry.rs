//! A turned or mirrored tree under turned or mirrored loads gives the turned or mirrored answer.

use super::fixture::{GRAVITY, Wood};
use orchard_geometry::{Rotation, Vec3};
use orchard_spec::Spec;
use orchard_treegen::{Skeleton, grow};

/// Round-off of 180 steps of a tree of some 150 links, grown at the rate of a pendulum at most: the answers
/// differ by less than a nanometre.
const ROUND_OFF: f64 = 1e-9;

fn grown() -> Skeleton {
    let mut skeleton = grow(&Spec::paper(), 42, 0).unwrap();
    skeleton.fruit_sites.clear();
    skeleton.leaves.clear();
    skeleton
}

/// Tips after a second of gravity and a push on every tenth segment, switched on at once.
fn answer(skeleton: Skeleton, load: impl Fn(usize) -> Vec3) -> Vec<Vec3> {
    let mut wood = Wood::new(skeleton, Spec::paper().wood);
    wood.settings.gravity = Vec3::new(0.0, 0.0, -GRAVITY);
    for i in (0..wood.tree.len()).step_by(10) {
        let body = wood.tree.bodies[i].index();
        wood.data.body_force_world[body] = load(i);
    }
    for _ in 0..180 {
        wood.step();
    }
    (0..wood.tree.len()).map(|i| wood.p_tip(i)).collect()
}

fn push(segment: usize) -> Vec3 {
    Vec3::new(5.0, -3.0, 2.0) * (1.0 + segment as f64 % 3.0)
}

#[test]
fn a_turned_tree_gives_the_turned_answer() {
    let straight = answer(grown(), push);
    let rest = grown().segments;
    let moved = straight.iter().zip(&rest).map(|(p, s)| (p - s.p_tip_world()).norm());
    assert!(moved.fold(0.0, f64::max) > 0.05, "the loads move nothing");
    for yaw in [0.3, 1.7, -2.6] {
        let turn = Rotation::from_axis_angle(&Vec3::z_axis(), yaw);
        let mut skeleton = grown();
        for segment in &mut skeleton.segments {
            segment.p_base_world = turn * segment.p_base_world;
            segment.r_world_segment = turn * segment.r_world_segment;
        }
        let turned = answer(skeleton, |i| turn * push(i));
        let error = turned.iter().zip(&straight).map(|(a, b)| (a - turn * b).norm()).fold(0.0, f64::max);
        assert!(error < ROUND_OFF, "yaw {yaw}: {error} m");
    }
}

/// The mirror y -> -y. A rotation R becomes S R S, S = diag(1, -1, 1): of its quaternion, x and z change sign.
/// A universal joint's Rx(a) Ry(b) becomes Rx(-a) Ry(b), a rotation of the same joint.
#[test]
fn a_mirrored_tree_gives_the_mirrored_answer() {
    let mirror = |p: Vec3| Vec3::new(p.x, -p.y, p.z);
    let straight = answer(grown(), push);
    let mut skeleton = grown();
    for segment in &mut skeleton.segments {
        segment.p_base_world = mirror(segment.p_base_world);
        let q = segment.r_world_segment;
        let mirrored = nalgebra::Quaternion::new(q.w, -q.i, q.j, -q.k);
        segment.r_world_segment = Rotation::new_unchecked(mirrored);
    }
    let mirrored = answer(skeleton, |i| mirror(push(i)));
    let error = mirrored.iter().zip(&straight).map(|(a, b)| (a - mirror(*b)).norm()).fold(0.0, f64::max);
    assert!(error < ROUND_OFF, "{error} m");
}
