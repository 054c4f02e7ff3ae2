//! Diameters of the wood of an MTG file: those of the file, and by rule where it has none.

use orchard_geometry::math;

use super::Figures;
use super::shape::Piece;

/// Radii \[m\] of all pieces, and the number of those whose diameter is not in the file.
///
/// Along an axis a diameter is interpolated between those above and below it; beyond the outermost one it stays the same. An axis without
/// any has those of the pipe model, `r^n` = the sum of the children's `r^n`, from the tips of its twigs, and is nowhere thicker than the
/// wood that bears it.
pub fn radii(pieces: &[Piece], figures: &Figures) -> (Vec<f64>, usize) {
    let mut axes: Vec<Vec<usize>> = Vec::new();
    let mut axis_of = Vec::with_capacity(pieces.len());
    let mut continued = vec![false; pieces.len()];
    for (i, piece) in pieces.iter().enumerate() {
        match piece.parent.filter(|parent| !piece.branches && !continued[*parent]) {
            Some(parent) => {
                continued[parent] = true;
                axis_of.push(axis_of[parent]);
            }
            None => {
                axis_of.push(axes.len());
                axes.push(Vec::new());
            }
        }
        axes[axis_of[i]].push(i);
    }
    let mut radii: Vec<Option<f64>> = vec![None; pieces.len()];
    for axis in &axes {
        interpolate(pieces, axis, &mut radii);
    }
    let (n, tip) = (figures.pipe_exponent.si(), 0.5 * figures.tip_diameter.si());
    let mut pipes = vec![0.0; pieces.len()];
    let known = radii.clone();
    for (i, piece) in pieces.iter().enumerate().rev() {
        if known[i].is_none() {
            radii[i] = Some(if pipes[i] > 0.0 { math::pow(pipes[i], 1.0 / n) } else { tip });
        }
        if let (Some(parent), Some(radius)) = (piece.parent, radii[i]) {
            pipes[parent] += math::pow(radius, n);
        }
    }
    let mut all: Vec<f64> = Vec::with_capacity(pieces.len());
    for (i, piece) in pieces.iter().enumerate() {
        let most = piece.parent.filter(|_| known[i].is_none()).map_or(f64::INFINITY, |parent| all[parent]);
        all.push(radii[i].unwrap_or(tip).min(most));
    }
    let derived = pieces.iter().filter(|piece| piece.top.is_none()).count();
    (all, derived)
}

/// Radii at the tips of an axis, if any diameter of it is known.
fn interpolate(pieces: &[Piece], axis: &[usize], radii: &mut [Option<f64>]) {
    let (mut s, mut tips, mut known) = (0.0, Vec::with_capacity(axis.len()), Vec::new());
    for &i in axis {
        known.extend(pieces[i].bottom.map(|diameter| (s, diameter)));
        s += (pieces[i].p_tip - pieces[i].p_base).norm();
        known.extend(pieces[i].top.map(|diameter| (s, diameter)));
        tips.push(s);
    }
    let mut above = 0;
    for (&i, s) in axis.iter().zip(tips) {
        while above < known.len() && known[above].0 < s {
            above += 1;
        }
        let between = match (above.checked_sub(1).map(|k| known[k]), known.get(above)) {
            (Some((low, a)), Some(&(high, b))) => Some(a + (b - a) * (s - low) / (high - low)),
            (Some((_, only)), None) | (None, Some(&(_, only))) => Some(only),
            (None, None) => None,
        };
        radii[i] = pieces[i].top.or(between).map(|diameter| 0.5 * diameter);
    }
}
