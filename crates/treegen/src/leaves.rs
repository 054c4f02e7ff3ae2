//! Leaves on twigs.

use orchard_geometry::{Pose, Rotation, Vec3, math, rotation_from_z};
use orchard_spec::Stream;
use orchard_spec::foliage::{FoliageSpec, LeafAreaSpec};

use crate::{
    skeleton::{LeafSite, Segment},
    turtle::droop_rotation,
};

/// Places leaves on every twig internode of high enough order, evenly spaced on a spiral, the last at its tip.
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
            let (sin_azimuth, cos_azimuth) = math::sin_cos(azimuth);
            let outward = Vec3::new(cos_azimuth, sin_azimuth, 0.0);
            let blade = blade(spec, &mut stream, &segment.r_world_segment, &Vec3::z(), &outward);
            let p_segment =
                Vec3::z() * along + outward * segment.radius + blade.petiole * spec.petiole_length.si();
            leaves.push(LeafSite {
                segment: i,
                x_segment_leaf: Pose::from_parts(p_segment.into(), blade.r_segment_leaf),
                length: blade_length * blade.scale,
                width: blade_width * blade.scale,
                size_class: blade.size_class,
            });
        }
    }
    leaves
}

/// A piece of a shoot, in the frame of its segment.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    pub segment: usize,
    /// Ends on the shoot's axis \[m\].
    pub p_base_segment: Vec3,
    pub p_tip_segment: Vec3,
    /// Radius of the wood \[m\].
    pub radius: f64,
    /// Length \[m\].
    pub length: f64,
}

/// A shoot that bears leaves.
#[derive(Debug, Clone)]
pub(crate) struct Shoot {
    pub floral: bool,
    /// Pieces from the base outwards.
    pub pieces: Vec<Piece>,
}

impl Shoot {
    /// Length \[m\].
    fn length(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.length).sum()
    }
}

/// Number of leaves that [`leaves_of_shoots`] places.
pub(crate) fn count_of_shoots(spec: &FoliageSpec, law: &LeafAreaSpec, shoots: &[Shoot]) -> f64 {
    let of =
        |shoot: &Shoot| f64::from(law.leaves(spec.density.si() * law.of_shoot(shoot.length(), shoot.floral)));
    shoots.iter().map(of).sum()
}

/// Places leaves on shoots whose leaf area follows from their length: blades of about the mean area that add up to it,
/// evenly spaced on a spiral, the last at the tip.
pub(crate) fn leaves_of_shoots(
    spec: &FoliageSpec,
    law: &LeafAreaSpec,
    shoots: &[Shoot],
    segments: &[Segment],
    mut stream: Stream,
) -> Vec<LeafSite> {
    let mut leaves = Vec::new();
    for shoot in shoots {
        let length = shoot.length();
        let area = spec.density.si() * law.of_shoot(length, shoot.floral);
        let count = law.leaves(area);
        let mut azimuth = stream.uniform(0.0, std::f64::consts::TAU);
        let first = leaves.len();
        for k in 1..=count {
            azimuth += stream.within(spec.divergence.si());
            let along = length * f64::from(k) / f64::from(count);
            let Some((piece, p_axis)) = point_along(&shoot.pieces, along) else { continue };
            let along =
                (piece.p_tip_segment - piece.p_base_segment).try_normalize(0.0).unwrap_or_else(Vec3::z);
            let (sin, cos) = math::sin_cos(azimuth);
            let outward = rotation_from_z(&along) * Vec3::new(cos, sin, 0.0);
            let blade = blade(spec, &mut stream, &segments[piece.segment].r_world_segment, &along, &outward);
            let p_segment = p_axis + outward * piece.radius + blade.petiole * spec.petiole_length.si();
            leaves.push(LeafSite {
                segment: piece.segment,
                x_segment_leaf: Pose::from_parts(p_segment.into(), blade.r_segment_leaf),
                length: blade.scale,
                width: law.aspect.si() * blade.scale,
                size_class: blade.size_class,
            });
        }
        // The three size classes share the shoot's area.
        let drawn: f64 = leaves[first..].iter().map(LeafSite::area).sum();
        let scale = if drawn > 0.0 { (area / drawn).sqrt() } else { 0.0 };
        for leaf in &mut leaves[first..] {
            leaf.length *= scale;
            leaf.width *= scale;
        }
    }
    leaves
}

/// Point at a length \[m\] along a shoot, and its piece.
fn point_along(pieces: &[Piece], along: f64) -> Option<(&Piece, Vec3)> {
    let mut left = along;
    let (last, before) = pieces.split_last()?;
    let mut piece = last;
    for earlier in before {
        if left <= earlier.length {
            piece = earlier;
            break;
        }
        left -= earlier.length;
    }
    let part = if piece.length > 0.0 { (left / piece.length).min(1.0) } else { 1.0 };
    Some((piece, piece.p_base_segment + (piece.p_tip_segment - piece.p_base_segment) * part))
}

/// Random draws of one blade.
struct Blade {
    /// Direction of the petiole, segment frame.
    petiole: Vec3,
    r_segment_leaf: Rotation,
    size_class: u8,
    /// Size relative to the middle class.
    scale: f64,
}

/// Draws the petiole's angle, the droop and the size class of a blade on wood along `along`, on its side
/// `outward` (unit vectors, segment frame).
fn blade(
    spec: &FoliageSpec,
    stream: &mut Stream,
    r_world_segment: &Rotation,
    along: &Vec3,
    outward: &Vec3,
) -> Blade {
    let petiole_angle = stream.within(spec.petiole_angle.si());
    let droop = stream.within(spec.blade_droop.si());
    let size_class = stream.integer(0, 2) as u8;
    let scale = 1.0 + (f64::from(size_class) - 1.0) * spec.size_step.si();
    let (sin_petiole, cos_petiole) = math::sin_cos(petiole_angle);
    let petiole = outward * sin_petiole + along * cos_petiole;
    let r_segment_leaf = blade_rotation(r_world_segment, &petiole, outward, droop);
    Blade { petiole, r_segment_leaf, size_class, scale }
}

/// Rotation of the blade in the segment's frame: the midrib (+x) continues the petiole, bent towards the
/// ground by `droop` \[rad\]; the upper face (+z) faces up as far as the midrib allows.
fn blade_rotation(r_world_segment: &Rotation, petiole: &Vec3, outward: &Vec3, droop: f64) -> Rotation {
    let petiole_world = r_world_segment * petiole;
    let midrib = (droop_rotation(&petiole_world, droop) * petiole_world).normalize();
    face_up(r_world_segment, midrib, outward)
}

/// Rotation in the segment's frame of a blade with a given midrib (unit, world): its upper face faces up as far as the
/// midrib allows; on a vertical midrib it faces `outward` (segment frame).
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
