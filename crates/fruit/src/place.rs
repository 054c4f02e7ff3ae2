//! Placement of fruit on spurs, and the draw of their properties.

use crate::apple::{Fruit, hang_point};
use crate::clear::Wood;
use crate::cluster;
use orchard_spec::fruit::{FruitSpec, ReleaseSpec, Strength};
use orchard_spec::{Purpose, Stream};
use orchard_treegen::{FruitSite, Skeleton};

/// A spur that may bear fruit.
struct Free {
    /// Fruit that it bears, if any.
    fruit: Fruit,
    /// Further fruit if it bears a cluster.
    others: Vec<Fruit>,
    /// Chance that a visit places its fruit.
    chance: f64,
}

/// Chooses the spurs that bear fruit and draws each fruit's size, mass and stem strength.
///
/// The sites are visited in random order, as often as needed, each accepted with the placement probability
/// times (base + outer * outerness), until the tree bears `spec.count` fruit or no free site is left.
/// A site is free if its fruit would hang clear of wood, ground and every fruit already placed.
///
/// With `spec.cluster` the sizes of clusters are drawn first, until they hold `spec.count` fruit, and are placed from the largest to the smallest: a
/// site that has no room for a large cluster is left for a smaller one. A cluster that no site has room for loses a fruit, which hangs alone.
pub fn place(spec: &FruitSpec, skeleton: &Skeleton, seed: u64, world: u32) -> Vec<Fruit> {
    let mut sizes = Stream::new(seed, world, Purpose::FruitSize);
    let mut stems = Stream::new(seed, world, Purpose::Stem);
    let mut draws = Stream::new(seed, world, Purpose::FruitPlacement);
    let count = spec.count.get() as usize;
    let mut clusters = cluster::sizes(spec, count, &mut Stream::new(seed, world, Purpose::FruitCluster));
    let largest = clusters.first().copied().unwrap_or(0);

    let wood = Wood::new(skeleton);
    // Every site draws its fruit whether or not it is used, so that the count never shifts a fruit's size.
    let sites = skeleton.fruit_sites.iter().enumerate();
    let mut free: Vec<Free> = sites
        .filter(|(_, site)| eligible(spec, skeleton, site))
        .map(|(index, site)| {
            let fruit = grow(spec, skeleton, index, [&mut sizes, &mut stems]);
            let of_site = |purpose| Stream::of_frame(seed, world, 1 + index as u32, purpose);
            let mut own = [of_site(Purpose::FruitSize), of_site(Purpose::FruitCluster)];
            let [sizes, stems] = &mut own;
            let others = (1..largest).map(|_| grow(spec, skeleton, index, [sizes, stems])).collect();
            let chance = spec.placement_probability.si()
                * (spec.placement_base.si() + spec.placement_outer.si() * site.outerness);
            Free { fruit, others, chance }
        })
        .filter(|site| wood.leaves_clear(&site.fruit))
        .collect();
    draws.shuffle(&mut free);

    let spacing = spec.spacing.si();
    let mut placed: Vec<Fruit> = Vec::with_capacity(count);
    let mut next = 0;
    while next < clusters.len() && !free.is_empty() {
        let (before, mut has_room) = (free.len(), false);
        free.retain(|site| {
            let Some(&size) = clusters.get(next) else { return true };
            let fruit = cluster::hung(spec, skeleton, &site.fruit, &site.others[..size - 1], |fruit| {
                (size == 1 || wood.leaves_clear(fruit)) && !crowded(&placed, fruit, spacing)
            });
            let Some(fruit) = fruit else { return size > 1 };
            has_room |= site.chance > 0.0;
            let accepted = draws.chance(site.chance);
            if accepted {
                placed.extend(fruit);
                next += 1;
            }
            !accepted
        });
        let no_chance_left = free.iter().all(|site| site.chance <= 0.0);
        let Some(size) = clusters.get_mut(next) else { break };
        if *size > 1 && !has_room {
            *size -= 1;
            clusters.push(1);
        } else if free.len() == before && no_chance_left {
            break;
        }
    }
    placed.sort_by_key(|fruit| fruit.segment);
    placed
}

/// Draws a fruit of a site, which hangs straight down from it; the streams are those of size and stem.
fn grow(spec: &FruitSpec, skeleton: &Skeleton, index: usize, [sizes, stems]: [&mut Stream; 2]) -> Fruit {
    let site = &skeleton.fruit_sites[index];
    let segment = &skeleton.segments[site.segment];
    let radius = draw_radius(spec, sizes);
    let p_anchor = segment.p_base_world + segment.r_world_segment * site.p_segment;
    Fruit {
        segment: site.segment,
        site: index,
        p_segment: site.p_segment,
        p_hang_world: hang_point(spec, &p_anchor, radius),
        radius,
        mass: draw_mass(spec, radius, sizes),
        detach_force: strength(stems, spec, |release| &release.pull_strength)
            .unwrap_or_else(|| stems.within(spec.detach_force.si())),
        twist_strength: strength(stems, spec, |release| &release.twist_strength).unwrap_or(f64::INFINITY),
        spur_strength: strength(stems, spec, |release| &release.spur_strength).unwrap_or(f64::INFINITY),
    }
}

/// Draws a strength of a stem; `None` of a tether.
fn strength(stream: &mut Stream, spec: &FruitSpec, which: impl Fn(&ReleaseSpec) -> &Strength) -> Option<f64> {
    spec.stem.as_ref().map(|stem| which(&stem.release).draw(stream))
}

/// True if a fruit would hang nearer to one of the others than the spacing allows.
pub(crate) fn crowded(others: &[Fruit], fruit: &Fruit, spacing: f64) -> bool {
    others.iter().any(|other| {
        (other.p_hang_world - fruit.p_hang_world).norm() < spacing * (other.radius + fruit.radius)
    })
}

fn eligible(spec: &FruitSpec, skeleton: &Skeleton, site: &FruitSite) -> bool {
    let segment = &skeleton.segments[site.segment];
    u32::from(segment.order) >= spec.min_order.get() && segment.radius < spec.spur_radius_max.si()
}

/// Mass of a fruit of a given radius.
fn draw_mass(spec: &FruitSpec, radius: f64, stream: &mut Stream) -> f64 {
    match &spec.mass_per_cube {
        Some(law) => {
            let diameter = 2.0 * radius;
            stream.cut_normal(law) * diameter * diameter * diameter
        }
        None => stream.within(spec.mass.si()),
    }
}

/// Radius by the distribution of diameters, else uniform on the grid of `radius_step` that starts at the smallest radius.
fn draw_radius(spec: &FruitSpec, stream: &mut Stream) -> f64 {
    if let Some(diameter) = &spec.diameter {
        return 0.5 * stream.cut_normal(diameter);
    }
    let (low, high) = spec.radius.si();
    let step = spec.radius_step.si();
    let drawn = stream.uniform(low, high);
    if step > 0.0 { (low + ((drawn - low) / step).round() * step).min(high) } else { drawn }
}
