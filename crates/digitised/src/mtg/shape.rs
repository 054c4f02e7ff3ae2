//! Places the wood of an MTG file: from positions, or from lengths and two angles.

use orchard_geometry::{Vec3, math};

use super::Figures;
use super::parts::Part;

/// A piece of straight wood \[m\], its base at the tip of its parent. Parents stand before children.
#[derive(Debug, Clone)]
pub struct Piece {
    pub line: usize,
    pub index: Option<usize>,
    pub parent: Option<usize>,
    pub branches: bool,
    pub order: u8,
    pub p_base: Vec3,
    pub p_tip: Vec3,
    /// Diameters \[m\] at the tip and the base, if the file has them.
    pub top: Option<f64>,
    pub bottom: Option<f64>,
    /// True if its tip or its length is in the file.
    measured: bool,
}

/// The placed wood.
#[derive(Debug, Clone, Default)]
pub struct Shape {
    pub pieces: Vec<Piece>,
    /// Number of entities without wood: nothing was measured at or beyond them.
    pub left_out: usize,
    /// Number of entities shorter than the shortest segment.
    pub empty: usize,
}

/// Figures that place the pieces.
pub struct Rules<'a> {
    pub figures: &'a Figures,
    /// Unit of positions and lengths \[m\].
    pub unit: f64,
    /// Unit of diameters \[m\].
    pub diameter_unit: f64,
    /// Shorter pieces are left out \[m\].
    pub shortest: f64,
}

/// Facts about a part's tip.
struct Ends {
    p_base: Vec3,
    p_tip: Vec3,
    kept: bool,
    measured: bool,
}

impl Rules<'_> {
    /// Places wood by the positions of the file. A tip that is missing between two others lies on the line between them.
    pub fn by_positions(&self, parts: &[Part], p_base: Vec3) -> Shape {
        // The part towards the next position beyond a part without one: along the axis, else along its first branch.
        let mut next: Vec<Option<(bool, usize)>> = vec![None; parts.len()];
        for (i, part) in parts.iter().enumerate().rev() {
            if let Some(parent) = part.parent.filter(|_| part.values.point.is_some() || next[i].is_some()) {
                let here = Some((part.branches, i));
                next[parent] = next[parent].map_or(here, |other| here.min(Some(other)));
            }
        }
        let mut ahead: Vec<(Option<Vec3>, f64)> = vec![(None, 0.0); parts.len()];
        for (i, part) in parts.iter().enumerate().rev() {
            ahead[i] = match (part.values.point, next[i]) {
                (Some(point), _) => (Some(point * self.unit), 1.0),
                (None, Some((_, child))) => (ahead[child].0, ahead[child].1 + 1.0),
                (None, None) => (None, 0.0),
            };
        }
        let p_base = p_base * self.unit;
        self.place(parts, |i, p_parent: Option<Vec3>| {
            let p_start = p_parent.unwrap_or(p_base);
            let p_tip = ahead[i].0.map(|point| p_start + (point - p_start) / ahead[i].1);
            // A first part whose tip is at its own base has no length, even if the wood that bears it is thick.
            let own = parts[i].base.map_or(p_start, |base| base * self.unit);
            let empty = p_tip.is_some_and(|tip| (tip - own).norm() < self.shortest);
            Ends {
                p_base: p_start,
                p_tip: p_tip.filter(|_| !empty).unwrap_or(p_start),
                kept: p_tip.is_some(),
                measured: parts[i].values.point.is_some(),
            }
        })
    }

    /// Places wood by the lengths of the file. The trunk is vertical, axes are straight, and the branches of an axis leave it at the
    /// insertion angle, each turned by the divergence against the one before. A direction below the horizontal is mirrored upwards.
    pub fn by_lengths(&self, parts: &[Part]) -> Shape {
        let mut headings = vec![Vec3::z(); parts.len()];
        let mut axis: Vec<usize> = (0..parts.len()).collect();
        let mut borne = vec![0.0; parts.len()];
        for (i, part) in parts.iter().enumerate() {
            let Some(parent) = part.parent else { continue };
            if part.branches {
                let turn = borne[axis[parent]] * self.figures.divergence.si();
                // An entity without a length is no branch.
                borne[axis[parent]] += f64::from(u8::from(part.values.length.is_some()));
                headings[i] = branch(&headings[parent], self.figures.insertion_angle.si(), turn);
            } else {
                (axis[i], headings[i]) = (axis[parent], headings[parent]);
            }
        }
        self.place(parts, |i, p_parent| {
            let p_base = p_parent.unwrap_or_else(Vec3::zeros);
            let along = headings[i] * (parts[i].values.length.unwrap_or(0.0) * self.unit);
            let kept = parts[i].values.length.is_some();
            Ends { p_base, p_tip: p_base + along, kept, measured: kept && !parts[i].shared }
        })
    }

    fn place(&self, parts: &[Part], ends: impl Fn(usize, Option<Vec3>) -> Ends) -> Shape {
        let mut shape = Shape::default();
        // Piece at whose tip the children of a part begin.
        let mut piece_of: Vec<Option<usize>> = vec![None; parts.len()];
        for (i, part) in parts.iter().enumerate() {
            let parent = part.parent.and_then(|parent| piece_of[parent]);
            let Ends { p_base, p_tip, kept, measured } = ends(i, parent.map(|p| shape.pieces[p].p_tip));
            let order = |p: usize| shape.pieces[p].order.saturating_add(u8::from(part.branches));
            if !kept || (p_tip - p_base).norm() < self.shortest {
                shape.left_out += usize::from(!kept);
                shape.empty += usize::from(kept);
                piece_of[i] = parent;
                continue;
            }
            piece_of[i] = Some(shape.pieces.len());
            let diameter = |value: Option<f64>| value.map(|value| value * self.diameter_unit);
            let piece = Piece {
                line: part.line,
                index: part.index,
                parent,
                branches: part.branches,
                order: part.values.order.unwrap_or_else(|| parent.map_or(0, order)),
                p_base,
                p_tip,
                top: diameter(part.values.top),
                bottom: diameter(part.values.bottom),
                measured,
            };
            shape.pieces.push(piece);
        }
        merge(&mut shape.pieces);
        shape
    }
}

/// Heading of a branch at an angle with its parent's, turned about it.
fn branch(parent: &Vec3, angle: f64, turn: f64) -> Vec3 {
    let side = Vec3::z().cross(parent).try_normalize(1e-9).unwrap_or_else(Vec3::x);
    let ((sin, cos), (sin_turn, cos_turn)) = (math::sin_cos(angle), math::sin_cos(turn));
    let heading = (parent * cos + (side * cos_turn + parent.cross(&side) * sin_turn) * sin).normalize();
    Vec3::new(heading.x, heading.y, heading.z.abs())
}

/// Joins a piece that was not measured with the one that continues it: they lie on one line, and nothing branches off between them.
fn merge(pieces: &mut Vec<Piece>) {
    let mut children = vec![0_usize; pieces.len()];
    for piece in pieces.iter() {
        if let Some(parent) = piece.parent {
            children[parent] += 1;
        }
    }
    let mut kept: Vec<Piece> = Vec::with_capacity(pieces.len());
    let mut open: Vec<Option<Piece>> = vec![None; pieces.len()];
    let mut place = vec![0; pieces.len()];
    let continued: Vec<Option<usize>> = pieces.iter().map(|p| p.parent.filter(|_| !p.branches)).collect();
    let mut joined = vec![false; pieces.len()];
    for parent in continued.into_iter().flatten() {
        joined[parent] = children[parent] == 1 && !pieces[parent].measured && pieces[parent].top.is_none();
    }
    for (i, mut piece) in std::mem::take(pieces).into_iter().enumerate() {
        let before = piece.parent.and_then(|parent| open[parent].take());
        match before {
            Some(before) => {
                (piece.parent, piece.p_base, piece.branches) =
                    (before.parent, before.p_base, before.branches);
                piece.bottom = before.bottom.or(piece.bottom);
            }
            None => piece.parent = piece.parent.map(|parent| place[parent]),
        }
        if joined[i] {
            open[i] = Some(piece);
        } else {
            place[i] = kept.len();
            kept.push(piece);
        }
    }
    *pieces = kept;
}
