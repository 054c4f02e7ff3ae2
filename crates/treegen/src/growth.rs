//! Grows trees of annual shoots: the skeleton and its growth units.

use std::f64::consts::PI;

use orchard_geometry::{Rotation, Vec3, transform};
use orchard_spec::{Purpose, Spec, Stream, tree::annual_shoots::AnnualShootsSpec};

use crate::grammar::annual_shoots::AnnualShoots;
use crate::leaves::{Piece, Shoot};
use crate::links::{self, Links, Place};
use crate::lsystem::{self, AxisKind, Grammar as _};
use crate::skeleton::{FruitSite, Segment, Skeleton, Spur};
use crate::turtle::Internode;
use crate::{TreegenError, assemble, clearance, fruit_sites, leaves, radii, turtle};

/// A tree with its growth units, which are finer than its segments.
#[derive(Debug, Clone, PartialEq)]
pub struct Growth {
    /// The skeleton that is simulated.
    pub skeleton: Skeleton,
    /// Growth units, an axis before its branches' later ones, those of one axis from its base outwards.
    pub units: Vec<GrowthUnit>,
}

/// Growth unit: the shoot that one apex made in one season.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrowthUnit {
    /// Branch order: 0 the leader.
    pub order: u8,
    /// Season in which it grew, from 0.
    pub season: u8,
    /// Kind of the axis that it lengthens.
    pub axis: AxisKind,
    /// True if it ends in an inflorescence.
    pub floral: bool,
    /// True if it is the first of its axis.
    pub first: bool,
    /// Length \[m\].
    pub length: f64,
    /// Unit heading at its base, world.
    pub heading_world: Vec3,
    /// Index of the segment on which it stands or with which it begins.
    pub segment: usize,
}

/// Most pieces of wood of a tree, our own choice: two hundred times those of the trees of this project. Grown and written as JSON, 128,932
/// pieces took 268 MiB and 518,166 took 965 MiB (measured).
const MOST_PIECES: f64 = 1e5;
/// Most leaves, and most fruit sites, of a tree, our own choice: ten times those of the largest measured tree.
const MOST_SITES: f64 = 1e6;

/// Checks a number of parts before memory is taken for them.
fn few(field: &'static str, parts: &'static str, count: f64, most: f64) -> Result<(), TreegenError> {
    if count <= most { Ok(()) } else { Err(TreegenError::TooMany { field, parts, count, most }) }
}

/// Grows the tree of one world of one seed by annual shoots.
pub(crate) fn grow(
    spec: &Spec,
    grammar: &AnnualShootsSpec,
    seed: u64,
    world: u32,
) -> Result<Growth, TreegenError> {
    radii::check(grammar)?;
    let mut grammar_of_tree = AnnualShoots::new(grammar, Stream::new(seed, world, Purpose::Growth));
    let derivations = grammar_of_tree.derivations();
    let drawn = turtle::interpret(&lsystem::derive(&mut grammar_of_tree, derivations));
    let (least, most) = grammar.link_length.si();
    few(
        "tree.grammar.annual-shoots.link_length",
        "pieces of wood",
        links::all_pieces(&drawn, most),
        MOST_PIECES,
    )?;
    let mut linked = links::link(&drawn, least, most);
    if linked.links.is_empty() {
        return Err(TreegenError::NoShoot);
    }

    let structural = structural(&linked.links);
    let trunk_radius = grammar_of_tree.trunk_radius();
    let radii =
        radii::radii(&spec.tree, grammar, &linked.links, &structural, trunk_radius, grammar_of_tree.stream());
    let clearance = spec.tree.clearance.si();
    let lifts = clearance::lift(&mut linked.links, &radii, clearance).map_err(|segment| {
        let height = linked.links[0].length;
        TreegenError::Clearance { segment, clearance, height }
    })?;
    let segments = assemble::segments(&linked.links, &radii);
    let spurs = spurs(&linked, &lifts, &segments);
    let fruit_sites = fruit_site_list(grammar, &linked.links, &structural, &segments, &spurs)?;
    let units = growth_units(&linked, &lifts);
    let leaves = match &spec.foliage.leaf_area {
        Some(law) => {
            let shoots = shoots(&linked, &segments, &spurs, derivations.saturating_sub(1));
            few(
                "foliage.leaf_area",
                "leaves",
                leaves::count_of_shoots(&spec.foliage, law, &shoots),
                MOST_SITES,
            )?;
            leaves::leaves_of_shoots(
                &spec.foliage,
                law,
                &shoots,
                &segments,
                Stream::new(seed, world, Purpose::Foliage),
            )
        }
        None => leaves::leaves(&spec.foliage, &segments, Stream::new(seed, world, Purpose::Foliage)),
    };
    Ok(Growth { skeleton: Skeleton { segments, fruit_sites, leaves, spurs }, units })
}

/// True for each link of the leader or of a limb; all links of an axis are of the kind of its first.
fn structural(links: &[Internode]) -> Vec<bool> {
    let mut structural: Vec<bool> = Vec::with_capacity(links.len());
    for link in links {
        let own = link.unit.is_some_and(|(_, unit)| unit.axis != AxisKind::Lateral);
        let before = link.parent.filter(|&parent| links[parent].order == link.order);
        structural.push(before.map_or(own, |parent| structural[parent]));
    }
    structural
}

/// The growth units in the order in which they are drawn.
fn growth_units(linked: &Links, lifts: &[Rotation]) -> Vec<GrowthUnit> {
    let mut units: Vec<GrowthUnit> = Vec::new();
    let mut at = Numbered::default();
    for (internode, &place) in linked.drawn.iter().zip(&linked.places) {
        let Some((number, unit)) = internode.unit else { continue };
        let segment = place.link(linked);
        let index = at.index(number, || {
            units.push(GrowthUnit {
                order: internode.order,
                season: unit.season,
                axis: unit.axis,
                floral: unit.floral,
                first: internode.parent.is_none_or(|parent| linked.drawn[parent].order != internode.order),
                length: 0.0,
                heading_world: lifts[segment] * internode.heading,
                segment,
            });
        });
        units[index].length += internode.length;
    }
    units
}

/// Index of each growth unit in a list, in the order of first occurrence.
#[derive(Debug, Default)]
struct Numbered {
    of_number: Vec<Option<usize>>,
    count: usize,
}

impl Numbered {
    /// Index of a unit; `push` adds it at its first occurrence.
    fn index(&mut self, number: u32, push: impl FnOnce()) -> usize {
        let number = number as usize;
        if self.of_number.len() <= number {
            self.of_number.resize(number + 1, None);
        }
        *self.of_number[number].get_or_insert_with(|| {
            push();
            self.count += 1;
            self.count - 1
        })
    }
}

/// The short branches in the frames of their segments, with bases on the bark.
fn spurs(linked: &Links, lifts: &[Rotation], segments: &[Segment]) -> Vec<Spur> {
    let spur = |branch: &links::ShortBranch| {
        let segment = &segments[branch.link];
        let heading_segment = segment.r_world_segment.inverse() * (lifts[branch.link] * branch.heading);
        let across = Vec3::new(heading_segment.x, heading_segment.y, 0.0);
        let outward = across.try_normalize(1e-6).unwrap_or_else(Vec3::x);
        Spur {
            segment: branch.link,
            p_segment: Vec3::z() * (branch.part * segment.length) + outward * segment.radius,
            heading_segment,
            length: branch.length,
            floral: linked.drawn[branch.first].unit.is_some_and(|(_, unit)| unit.floral),
        }
    };
    linked.short.iter().map(spur).collect()
}

/// Fruit sites: the tips of spurs, and points along limbs and along the laterals that stand on them and on the
/// leader, as far out on a lateral as it bears fruit.
fn fruit_site_list(
    grammar: &AnnualShootsSpec,
    links: &[Internode],
    structural: &[bool],
    segments: &[Segment],
    spurs: &[Spur],
) -> Result<Vec<FruitSite>, TreegenError> {
    let canopy_radius = fruit_sites::canopy_radius(segments);
    let bearing = bearing_lengths(grammar, links, structural, segments);
    let on_spurs = spurs
        .iter()
        .filter(|spur| links[spur.segment].order == 0 || spur.p_segment.z <= bearing[spur.segment])
        .map(|spur| (spur.segment, spur.p_segment + spur.heading_segment * spur.length));
    let along = bearing.iter().sum::<f64>() / grammar.fruit_site_spacing.si();
    few("tree.grammar.annual-shoots.fruit_site_spacing", "fruit sites", along, MOST_SITES)?;
    let (spacing, stub) = (grammar.fruit_site_spacing.si(), grammar.fruit_stub.si());
    let along_wood = segments.iter().zip(&bearing).enumerate().flat_map(|(i, (segment, bearing))| {
        let underside = fruit_sites::underside(segment);
        let count = (bearing / spacing).round() as u32;
        (1..=count).map(move |k| {
            let along = bearing * f64::from(k) / f64::from(count);
            // Stubs on limbs alternate between left and right.
            let level = if k % 2 == 0 { Vec3::z().cross(&underside) } else { underside.cross(&Vec3::z()) };
            let out = if structural[i] { level * stub } else { Vec3::zeros() };
            (i, Vec3::z() * along + underside * segment.radius + out)
        })
    });
    let mut sites: Vec<FruitSite> = on_spurs
        .chain(along_wood)
        .map(|(segment, p_segment)| {
            let p_world = transform(&segments[segment].x_world_segment(), &p_segment);
            FruitSite { segment, p_segment, outerness: fruit_sites::outerness(&p_world, canopy_radius) }
        })
        .collect();
    // The sort is stable: spurs of a segment come first.
    sites.sort_by_key(|site| site.segment);
    Ok(sites)
}

/// Length of every link, from its base, on which fruit may hang \[m\]: a limb bears fruit from its base over a length that its
/// cross-section there allows, a lateral on bearing wood over `fruit_reach`.
fn bearing_lengths(
    grammar: &AnnualShootsSpec,
    links: &[Internode],
    structural: &[bool],
    segments: &[Segment],
) -> Vec<f64> {
    let per_area = grammar.fruit_per_area.si() * grammar.fruit_site_spacing.si();
    // Remaining bearing length of an axis from a link's base on [m].
    let mut left: Vec<f64> = Vec::with_capacity(links.len());
    for (i, link) in links.iter().enumerate() {
        let bears = match link.parent {
            Some(parent) if links[parent].order == link.order => left[parent] - links[parent].length,
            Some(_) if structural[i] => per_area * PI * segments[i].radius * segments[i].radius,
            Some(parent) if structural[parent] => {
                let on_bearing_wood = links[parent].order == 0 || left[parent] >= links[parent].length;
                if on_bearing_wood { grammar.fruit_reach.si() } else { 0.0 }
            }
            _ => 0.0,
        };
        left.push(bears);
    }
    links.iter().zip(left).map(|(link, left)| left.clamp(0.0, link.length)).collect()
}

/// The shoots of one season, in pieces for the placement of leaves.
fn shoots(linked: &Links, segments: &[Segment], spurs: &[Spur], season: u32) -> Vec<Shoot> {
    let mut shoots: Vec<Shoot> = Vec::new();
    let mut at = Numbered::default();
    for (internode, &place) in linked.drawn.iter().zip(&linked.places) {
        let Some((number, unit)) = internode.unit else { continue };
        if u32::from(unit.season) != season {
            continue;
        }
        let piece = match place {
            Place::Link { link, from, to } => {
                let Segment { length, radius, .. } = segments[link];
                let point = |part: f64| Vec3::z() * (part * length);
                Piece {
                    segment: link,
                    p_base_segment: point(from),
                    p_tip_segment: point(to),
                    radius,
                    length: internode.length,
                }
            }
            Place::Short { branch, from, to } => {
                let spur = &spurs[branch];
                let point = |part: f64| spur.p_segment + spur.heading_segment * (spur.length * part);
                Piece {
                    segment: spur.segment,
                    p_base_segment: point(from),
                    p_tip_segment: point(to),
                    radius: 0.0,
                    length: internode.length,
                }
            }
        };
        let index = at.index(number, || shoots.push(Shoot { floral: unit.floral, pieces: Vec::new() }));
        shoots[index].pieces.push(piece);
    }
    shoots
}
