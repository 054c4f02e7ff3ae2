//! Terrain as heights on a regular grid.

use crate::{Aabb, Vec3};

/// Steps in columns and rows from a node to the six that share an edge with it, counter-clockwise.
pub const NEIGHBOURS: [[i64; 2]; 6] = [[1, 0], [0, 1], [-1, 1], [-1, 0], [0, -1], [1, -1]];

/// Sine of the angle between two triangles below which they count as one plane.
const COPLANAR: f64 = 1e-9;

/// Reason why a height field cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HeightFieldError {
    /// Fewer than two columns or rows.
    #[error("a height field needs at least 2 columns and 2 rows, not {columns} x {rows}")]
    Size {
        /// Columns.
        columns: usize,
        /// Rows.
        rows: usize,
    },
    /// The number of heights differs from the number of nodes.
    #[error("a height field of {columns} columns and {rows} rows has {count} heights")]
    Count {
        /// Columns.
        columns: usize,
        /// Rows.
        rows: usize,
        /// Number of heights given.
        count: usize,
    },
    /// A spacing is not positive and finite.
    #[error("the spacing of a height field is not positive and finite")]
    Spacing,
    /// A height is not finite.
    #[error("the height at column {column}, row {row} is not finite")]
    Height {
        /// Column of the node.
        column: usize,
        /// Row of the node.
        row: usize,
    },
}

/// A node of the grid: column and row. Nodes off the grid have no height.
pub type Node = [i64; 2];

/// A rectangle of grid cells, first and last included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cells {
    /// First and last column of cells.
    pub columns: (i64, i64),
    /// First and last row of cells.
    pub rows: (i64, i64),
}

impl Cells {
    /// Iterates over the cells as (column, row), row by row.
    pub fn iter(self) -> impl Iterator<Item = Node> {
        (self.rows.0..=self.rows.1)
            .flat_map(move |row| (self.columns.0..=self.columns.1).map(move |column| [column, row]))
    }

    /// Iterates over the nodes at the corners of the cells, row by row.
    pub fn nodes(self) -> impl Iterator<Item = Node> {
        Cells { columns: (self.columns.0, self.columns.1 + 1), rows: (self.rows.0, self.rows.1 + 1) }.iter()
    }
}

/// Ground whose height is given on a regular grid centred on the origin; solid below.
///
/// Columns run along x, rows along y. The square between four nodes has two triangles, split by the diagonal from its
/// corner (x, y + spacing) to (x + spacing, y). The surface ends at the outermost nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    columns: usize,
    rows: usize,
    spacing: [f64; 2],
    /// Row by row.
    heights: Vec<f64>,
    /// True for each node that lies in one plane with its neighbours, so that it is no corner of the surface.
    is_flat: Vec<bool>,
    /// Lowest and highest height.
    range: (f64, f64),
}

impl HeightField {
    /// Makes terrain from heights \[m\], row by row, and the spacing \[m\] of columns (along x) and rows (along y).
    ///
    /// # Errors
    /// [`HeightFieldError`] for fewer than two columns or rows, a wrong number of heights, or a number that is not finite.
    pub fn new(
        columns: usize,
        rows: usize,
        spacing: [f64; 2],
        heights: Vec<f64>,
    ) -> Result<HeightField, HeightFieldError> {
        if columns < 2 || rows < 2 {
            return Err(HeightFieldError::Size { columns, rows });
        }
        if columns.checked_mul(rows) != Some(heights.len()) {
            return Err(HeightFieldError::Count { columns, rows, count: heights.len() });
        }
        let count = [columns, rows];
        if !(0..2).all(|k| spacing[k] > 0.0 && (spacing[k] * count[k] as f64).is_finite()) {
            return Err(HeightFieldError::Spacing);
        }
        if let Some(index) = heights.iter().position(|z| !z.is_finite()) {
            return Err(HeightFieldError::Height { column: index % columns, row: index / columns });
        }
        let range = heights
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |range, &z| (range.0.min(z), range.1.max(z)));
        let mut field = HeightField { columns, rows, spacing, heights, is_flat: Vec::new(), range };
        field.is_flat = field.cells().nodes().map(|node| field.lies_in_a_plane(node)).collect();
        Ok(field)
    }

    /// Number of columns of nodes.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of rows of nodes.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Spacing of columns and of rows \[m\].
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }

    /// Heights \[m\], row by row.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// All cells.
    pub fn cells(&self) -> Cells {
        Cells { columns: (0, self.columns as i64 - 2), rows: (0, self.rows as i64 - 2) }
    }

    /// Index of a node in row order; `None` off the grid.
    fn index(&self, [column, row]: Node) -> Option<usize> {
        let is_on = (0..self.columns as i64).contains(&column) && (0..self.rows as i64).contains(&row);
        is_on.then(|| row as usize * self.columns + column as usize)
    }

    /// Position of a node \[m\]; `None` off the grid.
    pub fn node(&self, node: Node) -> Option<Vec3> {
        self.index(node).map(|index| self.p_node(node, self.heights[index]))
    }

    /// True if a node and its neighbours lie in one plane, so that the node is no corner of the surface.
    pub fn is_flat(&self, node: Node) -> bool {
        self.index(node).is_some_and(|index| self.is_flat[index])
    }

    /// Bounding box of the surface.
    pub fn bounds(&self) -> Aabb {
        let [x, y] = [0, 1].map(|k| self.reach(k));
        Aabb { min: Vec3::new(-x, -y, self.range.0), max: Vec3::new(x, y, self.range.1) }
    }

    /// Cells under a box in the field's frame; `None` if the box lies beside the field.
    pub fn cells_under(&self, aabb: &Aabb) -> Option<Cells> {
        let count = [self.columns, self.rows];
        let [columns, rows] = [0, 1].map(|k| {
            let last = count[k] as f64 - 2.0;
            let cell = |x: f64| ((x + self.reach(k)) / self.spacing[k]).floor();
            let (low, high) = (cell(aabb.min[k]), cell(aabb.max[k]));
            // The last node belongs to the last cell.
            (low <= last + 1.0 && high >= 0.0)
                .then(|| (low.clamp(0.0, last) as i64, high.clamp(0.0, last) as i64))
        });
        Some(Cells { columns: columns?, rows: rows? })
    }

    /// Nodes of the two triangles of a cell, each counter-clockwise from above.
    pub fn triangles_of([column, row]: Node) -> [[Node; 3]; 2] {
        let [p00, p10] = [[column, row], [column + 1, row]];
        let [p01, p11] = [[column, row + 1], [column + 1, row + 1]];
        [[p00, p10, p01], [p10, p11, p01]]
    }

    /// Corners of all triangles of some cells \[m\].
    pub fn triangles(&self, cells: Cells) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        cells
            .iter()
            .flat_map(HeightField::triangles_of)
            .filter_map(|[a, b, c]| Some([self.node(a)?, self.node(b)?, self.node(c)?]))
    }

    /// Height of the surface over (x, y) \[m\]; `None` beside the field.
    pub fn height(&self, x: f64, y: f64) -> Option<f64> {
        let p = Vec3::new(x, y, 0.0);
        if !(x.abs() <= self.reach(0) && y.abs() <= self.reach(1)) {
            return None;
        }
        let cells = self.cells_under(&Aabb { min: p, max: p })?;
        let [column, row] = [cells.columns.0, cells.rows.0];
        let [s, t] = [
            (x + self.reach(0)) / self.spacing[0] - column as f64,
            (y + self.reach(1)) / self.spacing[1] - row as f64,
        ];
        let z = |node: Node| self.index(node).map(|index| self.heights[index]);
        let (z10, z01) = (z([column + 1, row])?, z([column, row + 1])?);
        Some(if s + t <= 1.0 {
            let z00 = z([column, row])?;
            z00 + s * (z10 - z00) + t * (z01 - z00)
        } else {
            let z11 = z([column + 1, row + 1])?;
            z11 + (1.0 - s) * (z01 - z11) + (1.0 - t) * (z10 - z11)
        })
    }

    /// Distance from a point to the surface \[m\], negative below it. Exact; the cost grows with the square of the
    /// height above the ground. The upright sides of the solid under the border are ignored.
    pub fn signed_distance(&self, p: &Vec3) -> f64 {
        let [x, y] = [0, 1].map(|k| p[k].clamp(-self.reach(k), self.reach(k)));
        let z = self.height(x, y).unwrap_or(self.range.1);
        // A point of the surface is this near, so no triangle farther away than this can be nearer.
        let bound = (p - Vec3::new(x, y, z)).norm();
        let reach = Vec3::new(bound, bound, bound);
        let Some(cells) = self.cells_under(&Aabb { min: p - reach, max: p + reach }) else { return bound };
        let distance = self
            .triangles(cells)
            .map(|triangle| (p - closest_on_triangle(p, &triangle).0).norm())
            .fold(bound, f64::min);
        if [x, y] == [p.x, p.y] && p.z < z { -distance } else { distance }
    }

    /// Column coordinate of a position x: whole numbers are columns of nodes.
    pub(crate) fn column_at(&self, x: f64) -> f64 {
        (x + self.reach(0)) / self.spacing[0]
    }

    /// Row coordinate of a position y.
    pub(crate) fn row_at(&self, y: f64) -> f64 {
        (y + self.reach(1)) / self.spacing[1]
    }

    /// Half the field's length along x (0) or y (1) \[m\].
    fn reach(&self, k: usize) -> f64 {
        0.5 * self.spacing[k] * ([self.columns, self.rows][k] - 1) as f64
    }

    fn p_node(&self, node: Node, z: f64) -> Vec3 {
        let [x, y] = [0, 1].map(|k| self.spacing[k] * node[k] as f64 - self.reach(k));
        Vec3::new(x, y, z)
    }

    /// True if a node and its six neighbours lie in one plane.
    fn lies_in_a_plane(&self, node: Node) -> bool {
        let Some(middle) = self.index(node) else { return false };
        let mut spokes = [Vec3::zeros(); 6];
        for (spoke, step) in spokes.iter_mut().zip(NEIGHBOURS) {
            let Some(other) = self.index([node[0] + step[0], node[1] + step[1]]) else { return false };
            let along = [0, 1].map(|k| self.spacing[k] * step[k] as f64);
            *spoke = Vec3::new(along[0], along[1], self.heights[other] - self.heights[middle]);
        }
        // The first two vectors span the plane.
        let [east, north, others @ ..] = spokes;
        let normal = east.cross(&north);
        let most = COPLANAR * COPLANAR * normal.norm_squared();
        others.iter().all(|spoke| {
            let out = normal.dot(spoke);
            out * out <= most * spoke.norm_squared()
        })
    }
}

/// Part of a triangle, by the indices of its corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrianglePart {
    /// A corner.
    Corner(usize),
    /// The side from a corner to the next.
    Side(usize),
    /// The inside.
    Face,
}

/// Closest point of a triangle to `p`, and the part of the triangle on which it lies (Ericson, Real-Time Collision
/// Detection, 2005, section 5.1.5).
pub fn closest_on_triangle(p: &Vec3, [a, b, c]: &[Vec3; 3]) -> (Vec3, TrianglePart) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, TrianglePart::Corner(0));
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, TrianglePart::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), TrianglePart::Side(0));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, TrianglePart::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), TrianglePart::Side(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), TrianglePart::Side(1));
    }
    let sum = va + vb + vc;
    (a + ab * (vb / sum) + ac * (vc / sum), TrianglePart::Face)
}
