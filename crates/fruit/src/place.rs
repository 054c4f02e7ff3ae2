//! Placement of fruit on spurs, and the draw of their properties.

use crate::apple::Fruit;
use crate::clear::Wood;
use orchard_geometry::Vec3;
use orchard_spec::fruit::FruitSpec;
use orchard_spec::{Purpose, Stream};
use orchard_treegen::{FruitSite, Skeleton};

/// Chooses the spurs that bear fruit and draws each fruit's size, mass and stem strength.
///
/// The sites are visited in random order, as often as needed, each accepted with the placement probability
/// times (base + outer * outerness), until the tree bears `spec.count` fruit or no free site is left.
/// A site is free if its fruit would hang clear of wood, ground and every fruit already placed.
pub fn place(spec: &FruitSpec, skeleton: &Skeleton, seed: u64, world: u32) -> Vec<Fruit> {
    let mut sizes = Stream::new(seed, world, Purpose::FruitSize);
    let mut stems = Stream::new(seed, world, Purpose::Stem);
    let mut draws = Stream::new(seed, world, Purpose::FruitPlacement);

    let wood = Wood::new(skeleton);
    // Every site draws its fruit whether or not it is used, so that the count never shifts a fruit's size.
    let mut free: Vec<(Fruit, f64)> = skeleton
        .fruit_sites
        .iter()
        .filter(|site| eligible(spec, skeleton, site))
        .map(|site| {
            let segment = &skeleton.segments[site.segment];
            let radius = draw_radius(spec, &mut sizes);
            let p_anchor = segment.p_base_world + segment.r_world_segment * site.p_segment;
            let fruit = Fruit {
                segment: site.segment,
                p_segment: site.p_segment,
                p_hang_world: hang_point(spec, &p_anchor, radius),
                radius,
                mass: sizes.within(spec.mass.si()),
                detach_force: stems.within(spec.detach_force.si()),
            };
            let chance = spec.placement_probability.si()
                * (spec.placement_base.si() + spec.placement_outer.si() * site.outerness);
            (fruit, chance)
        })
        .filter(|(fruit, _)| wood.leaves_clear(fruit))
        .collect();
    draws.shuffle(&mut free);

    let count = spec.count.get() as usize;
    let spacing = spec.spacing.si();
    let mut placed: Vec<Fruit> = Vec::with_capacity(count);
    while placed.len() < count && !free.is_empty() {
        let before = free.len();
        free.retain(|(fruit, chance)| {
            if placed.len() == count {
                return true;
            }
            if crowded(&placed, fruit, spacing) {
                return false;
            }
            if draws.chance(*chance) {
                placed.push(fruit.clone());
                return false;
            }
            true
        });
        let no_chance_left = free.iter().all(|(_, chance)| *chance <= 0.0);
        if free.len() == before && no_chance_left {
            break;
        }
    }
    placed.sort_by_key(|fruit| fruit.segment);
    placed
}

/// Centre of a fruit that hangs straight down from its stem's anchor \[m\], world.
pub(crate) fn hang_point(spec: &FruitSpec, p_anchor_world: &Vec3, radius: f64) -> Vec3 {
    p_anchor_world - Vec3::new(0.0, 0.0, spec.stem_length.si() + radius)
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

/// Uniform radius on the grid of `radius_step` that starts at the smallest radius.
fn draw_radius(spec: &FruitSpec, stream: &mut Stream) -> f64 {
    let (low, high) = spec.radius.si();
    let step = spec.radius_step.si();
    let drawn = stream.uniform(low, high);
    if step > 0.0 { (low + ((drawn - low) / step).round() * step).min(high) } else { drawn }
}
