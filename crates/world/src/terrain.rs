//! Bumpy ground: octaves of value noise on periodic lattices, flat about the trunk.
//!
//! Octave k has a lattice of n 2^k x n 2^k random values a period, uniform in [-1, 1), bilinear in between, and weighs
//! p^k. The sum is taken at the nodes of the ground's grid, multiplied by a smooth step of the distance to the nearest
//! trunk of the periodic plane (0 on its disc, 3 s^2 - 2 s^3 over the ring), and scaled so that the largest deviation is
//! the amplitude. It is one period, which the field repeats bit for bit. A slope adds a plane through the foot of the trunk.

use orchard_geometry::{HeightField, HeightFieldError, math};
use orchard_spec::terrain::TerrainSpec;
use orchard_spec::{Purpose, Stream};

/// Most nodes of a world's ground: some 40 MB.
const NODES_MAX: f64 = 4e6;

/// Ground that cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TerrainError {
    /// The finest lattice does not fit the grid.
    #[error(
        "terrain: the last of {octaves} octaves has {lattice} cells a period, more than the {grid} of terrain.grid_cells"
    )]
    Octaves {
        /// Octaves.
        octaves: u32,
        /// Cells of the last octave's lattice.
        lattice: u64,
        /// Cells of the grid.
        grid: u32,
    },
    /// No lattice, no grid or no period.
    #[error("terrain: terrain.period, terrain.grid_cells and terrain.lattice_cells must be above 0")]
    Empty,
    /// Too many nodes.
    #[error(
        "terrain: {nodes} nodes for sim.plausible_extent = {extent} m at a spacing of {spacing} m; {NODES_MAX} are allowed"
    )]
    Size {
        /// Nodes.
        nodes: f64,
        /// Radius of the box that a world may fill \[m\].
        extent: f64,
        /// Distance of nodes \[m\].
        spacing: f64,
    },
    /// No height field.
    #[error("terrain: {0}")]
    Field(#[from] HeightFieldError),
}

/// The ground of one world of one seed, at least `extent` \[m\] to all sides of the trunk.
///
/// # Errors
/// [`TerrainError`], for specs whose parts do not fit together.
pub fn height_field(
    spec: &TerrainSpec,
    extent: f64,
    seed: u64,
    world: u32,
) -> Result<HeightField, TerrainError> {
    let (cells, spacing) = (spec.grid_cells.get() as usize, spec.spacing());
    let octaves = spec.octaves.get();
    let first = u64::from(spec.lattice_cells.get());
    let lattice = first.saturating_mul(1_u64.checked_shl(octaves.saturating_sub(1)).unwrap_or(u64::MAX));
    if first == 0 || cells == 0 || spec.period.si() <= 0.0 {
        return Err(TerrainError::Empty);
    }
    if lattice > cells as u64 {
        return Err(TerrainError::Octaves { octaves, lattice, grid: spec.grid_cells.get() });
    }
    let to_the_side = (extent / spacing).ceil();
    let count = 2.0 * to_the_side + 1.0;
    let nodes = count * count;
    if !(nodes <= NODES_MAX && (cells * cells) as f64 <= NODES_MAX) {
        return Err(TerrainError::Size { nodes: nodes.max((cells * cells) as f64), extent, spacing });
    }
    let tile = tile(spec, &mut Stream::new(seed, world, Purpose::Terrain));
    let (middle, count) = (to_the_side as i64, count as usize);
    // The trunk stands on the node in the middle, the first of the tile.
    let place: Vec<usize> =
        (0..count as i64).map(|node| (node - middle).rem_euclid(cells as i64) as usize).collect();
    let rows = place.iter().flat_map(|row| place.iter().map(move |column| row * cells + column));
    let mut heights: Vec<f64> = rows.map(|index| tile[index]).collect();
    if let Some(slope) = &spec.slope {
        let (sin, cos) = math::sin_cos(slope.bearing.si());
        let (up, along) = math::sin_cos(slope.angle.si());
        let rise = up / along * spacing;
        let from_middle = |node: usize| node as f64 - to_the_side;
        for (node, z) in heights.iter_mut().enumerate() {
            *z += rise * (cos * from_middle(node % count) + sin * from_middle(node / count));
        }
    }
    Ok(HeightField::new(count, count, [spacing; 2], heights)?)
}

/// Heights of one period \[m\], row by row, the trunk on the first node.
fn tile(spec: &TerrainSpec, draws: &mut Stream) -> Vec<f64> {
    let cells = spec.grid_cells.get() as usize;
    let mut heights = vec![0.0; cells * cells];
    let mut weight = 1.0;
    for octave in 0..spec.octaves.get() {
        let lattice = Lattice::draw((spec.lattice_cells.get() << octave) as usize, draws);
        for (index, height) in heights.iter_mut().enumerate() {
            let at = |k: usize| k as f64 / cells as f64;
            *height += weight * lattice.at(at(index % cells), at(index / cells));
        }
        weight *= spec.persistence.si();
    }
    for (index, height) in heights.iter_mut().enumerate() {
        // To the nearest of the trunks.
        let away = |k: usize| k.min(cells - k) as f64 * spec.spacing();
        *height *= rise(spec, math::hypot(away(index % cells), away(index / cells)));
    }
    let peak = heights.iter().fold(0.0_f64, |peak, z| peak.max(z.abs()));
    if peak > 0.0 {
        // The quotient is exactly 1 at the peak.
        heights.iter_mut().for_each(|z| *z = *z / peak * spec.amplitude.si());
    }
    heights
}

/// Share of its height that a node at a distance from a trunk \[m\] has. The disc is a cell's diagonal wider for nodes, so
/// that every triangle that reaches into it lies flat.
fn rise(spec: &TerrainSpec, distance: f64) -> f64 {
    let beyond = distance - spec.flat_radius.si() - std::f64::consts::SQRT_2 * spec.spacing();
    let width = spec.blend_width.si();
    if beyond <= 0.0 {
        0.0
    } else if beyond >= width {
        1.0
    } else {
        let s = beyond / width;
        s * s * (3.0 - 2.0 * s)
    }
}

/// Random values on the corners of n x n cells of the periodic plane.
struct Lattice {
    cells: usize,
    values: Vec<f64>,
}

impl Lattice {
    fn draw(cells: usize, draws: &mut Stream) -> Self {
        Self { cells, values: (0..cells * cells).map(|_| draws.uniform(-1.0, 1.0)).collect() }
    }

    /// Bilinear value at a place, in periods from 0 to 1.
    fn at(&self, s: f64, t: f64) -> f64 {
        let n = self.cells;
        let split = |share: f64| {
            let cell = (share * n as f64).floor();
            (cell as usize % n, share * n as f64 - cell)
        };
        let ((column, x), (row, y)) = (split(s), split(t));
        let value = |column: usize, row: usize| self.values[(row % n) * n + column % n];
        let along = |row: usize| {
            let (from, to) = (value(column, row), value(column + 1, row));
            from + x * (to - from)
        };
        let (near, far) = (along(row), along(row + 1));
        near + y * (far - near)
    }
}

#[cfg(test)]
#[path = "terrain_tests.rs"]
mod tests;
