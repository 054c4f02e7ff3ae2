//! Clusters: several fruit on one spur, side by side, each on a stem of its own.

use crate::apple::{Fruit, hang_point};
use orchard_geometry::{Vec3, math};
use orchard_spec::Stream;
use orchard_spec::fruit::FruitSpec;
use orchard_treegen::Skeleton;
use std::f64::consts::{PI, TAU};

/// Directions about the vertical in which a cluster is tried.
const TURNS: u32 = 12;

/// Numbers of fruit of the clusters of a tree that bears `count` fruit, the largest first.
pub(crate) fn sizes(spec: &FruitSpec, count: usize, stream: &mut Stream) -> Vec<usize> {
    let (mut sizes, mut left) = (Vec::new(), count);
    while left > 0 {
        let size = spec.cluster.as_ref().map_or(1, |law| law.draw(stream)).min(left);
        sizes.push(size);
        left -= size;
    }
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes
}

/// A spur's fruit, hung as a cluster with `others`: on a level ring about the spur, as wide as neighbours need to hang side by side, turned about the
/// vertical until `has_room` for all of them. `None` if no turn has.
pub(crate) fn hung(
    spec: &FruitSpec,
    skeleton: &Skeleton,
    first: &Fruit,
    others: &[Fruit],
    has_room: impl Fn(&Fruit) -> bool,
) -> Option<Vec<Fruit>> {
    let law = spec.cluster.as_ref().filter(|_| !others.is_empty());
    let Some(law) = law else { return has_room(first).then(|| vec![first.clone()]) };
    let fruit: Vec<&Fruit> = std::iter::once(first).chain(others).collect();
    let n = fruit.len();
    let widest = (0..n).map(|i| fruit[i].radius + fruit[(i + 1) % n].radius).fold(0.0, f64::max);
    let ring = law.gap.si() * widest / (2.0 * math::sin_cos(PI / n as f64).0);
    let segment = &skeleton.segments[first.segment];
    let r_segment_world = segment.r_world_segment.inverse();
    let p_spur_world = segment.p_base_world + segment.r_world_segment * first.p_segment;
    let hung = |turn: u32, i: usize| {
        let angle = TAU * (f64::from(turn) / f64::from(TURNS) + i as f64) / n as f64;
        let (sine, cosine) = math::sin_cos(angle);
        let offset_world = Vec3::new(ring * cosine, ring * sine, 0.0);
        Fruit {
            p_segment: first.p_segment + r_segment_world * offset_world,
            p_hang_world: hang_point(spec, &(p_spur_world + offset_world), fruit[i].radius),
            ..fruit[i].clone()
        }
    };
    (0..TURNS).find_map(|turn| {
        let all = (0..n).map(|i| Some(hung(turn, i)).filter(&has_room));
        all.collect()
    })
}
