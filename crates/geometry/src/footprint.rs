//! Highest ground under a turned rectangle: the height at which a flat chassis rests.

use crate::height_field::Cells;
use crate::{Aabb, HeightField, Vec3};

/// A rectangle over the ground, seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    /// Centre (x, y) \[m\].
    pub centre: [f64; 2],
    /// Unit vector along the rectangle's length.
    pub ahead: [f64; 2],
    /// Half of its length and of its width \[m\].
    pub half: [f64; 2],
}

impl Footprint {
    /// Corners in order around the rectangle.
    fn corners(&self) -> [[f64; 2]; 4] {
        let [c, s] = self.ahead;
        [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(along, across)| {
            let (along, across) = (along * self.half[0], across * self.half[1]);
            [self.centre[0] + c * along - s * across, self.centre[1] + s * along + c * across]
        })
    }

    fn contains(&self, x: f64, y: f64) -> bool {
        let [c, s] = self.ahead;
        let (dx, dy) = (x - self.centre[0], y - self.centre[1]);
        (c * dx + s * dy).abs() <= self.half[0] && (c * dy - s * dx).abs() <= self.half[1]
    }
}

impl HeightField {
    /// Height of the highest point of the surface under a rectangle in the field's frame \[m\]; `None` if no part of the
    /// rectangle lies over the field.
    ///
    /// The surface is flat on each triangle, so its highest point over the rectangle is a node inside or a point of the
    /// rectangle's border: a corner, or where the border crosses an edge of a triangle. The result is continuous in
    /// position and direction of a rectangle that stays on the field.
    pub fn highest_under(&self, footprint: &Footprint) -> Option<f64> {
        let corners = footprint.corners();
        let at = |[x, y]: [f64; 2]| Vec3::new(x, y, 0.0);
        let around =
            corners.iter().fold(Aabb { min: at(corners[0]), max: at(corners[0]) }, |all, &corner| {
                all.union(&Aabb { min: at(corner), max: at(corner) })
            });
        let cells: Cells = self.cells_under(&around)?;
        let inside = cells.nodes().filter_map(|node| self.node(node));
        let inside = inside.filter(|p| footprint.contains(p.x, p.y)).map(|p| p.z);
        let border = (0..4).filter_map(|k| self.highest_along(corners[k], corners[(k + 1) % 4]));
        inside.chain(border).reduce(f64::max)
    }

    /// Height of the highest point of the surface over a line segment.
    fn highest_along(&self, from: [f64; 2], to: [f64; 2]) -> Option<f64> {
        let between = |share: f64| [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])];
        let over = |share: f64| {
            let [x, y] = between(share);
            self.height(x, y)
        };
        let [mut best, end] = [over(0.0), over(1.0)];
        best = higher(best, end);
        // The segment crosses columns, rows and diagonals where one of these numbers is whole.
        let lines = |[x, y]: [f64; 2]| {
            let (column, row) = (self.column_at(x), self.row_at(y));
            [column, row, column + row]
        };
        for (start, stop) in lines(from).into_iter().zip(lines(to)) {
            let (low, high) = (start.min(stop).ceil(), start.max(stop).floor());
            let mut line = low;
            while line <= high && start != stop {
                best = higher(best, over((line - start) / (stop - start)));
                line += 1.0;
            }
        }
        best
    }
}

fn higher(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.max(b)),
        (one, other) => one.or(other),
    }
}
