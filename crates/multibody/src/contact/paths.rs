//! How unit impulses at contacts pass through the articulated-body factor, path by path.
//!
//! With `A^-1 = L^-T D^-1 L^-1` and `D^-1 = C C^T`, an impulse at a contact only passes through the joints
//! between its links and the world: its column of `Y = C^T L^-1 J^T` is as sparse as that path. Then
//! `J A^-1 J^T = Y^T Y`: in the coordinates `e = C^-1 L^T du` of a velocity change, A is the identity.

use std::ops::Range;

use orchard_geometry::{Mat3, Vec3};

use crate::data::Data;
use crate::model::Model;
use crate::spatial::Wrench;

/// Most degrees of freedom of a node.
const WIDEST: usize = 6;
/// Marks a joint or point body that no path has passed yet.
const UNTOUCHED: u32 = u32::MAX;

/// Three unit impulses (one for each row of a block) on one side of a block.
#[derive(Debug, Clone, Copy)]
pub(super) enum Load {
    /// On the world.
    None,
    /// On a link, at its origin.
    Body { body: usize, wrenches: [Wrench; 3] },
    /// On a point body: the columns.
    Point { point: usize, impulses: Mat3, r: Vec3 },
    /// On a degree of freedom, in the first row only.
    Dof { body: usize, dof: usize, factor: f64 },
}

/// Y of all blocks.
#[derive(Debug, Clone, Default)]
pub(super) struct Paths {
    /// Entries of each block in `y`.
    ranges: Vec<Range<usize>>,
    /// For each coordinate on a path, the values of the block's three rows.
    y: Vec<Vec3>,
    /// Coordinate of each entry of `y`; paths that share a joint share its coordinates.
    coordinates: Vec<u32>,
    /// First coordinate of each link, then point body, then spin.
    first_coordinate: Vec<u32>,
    /// Those with coordinates.
    touched: Vec<usize>,
    dimension: usize,
    /// C of the touched joints, lower triangles row after row, placed as the factor's `d_inverse`.
    roots: Vec<f64>,
}

/// Impulses on their way to the root.
#[derive(Clone, Copy)]
struct Carrier {
    body: Option<usize>,
    wrenches: [Wrench; 3],
}

impl Paths {
    /// Forgets all blocks.
    pub fn clear(&mut self, model: &Model, data: &Data) {
        self.ranges.clear();
        self.y.clear();
        self.coordinates.clear();
        for key in self.touched.drain(..) {
            self.first_coordinate[key] = UNTOUCHED;
        }
        self.first_coordinate.resize(model.bodies.len() + 2 * model.points.len(), UNTOUCHED);
        self.roots.resize(data.factor.d_inverse.len(), 0.0);
        self.dimension = 0;
    }

    /// Number of coordinates that the paths pass.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Entries of Y of a block, each with its coordinate.
    pub fn entries(&self, block: usize) -> impl Iterator<Item = (usize, &Vec3)> {
        let range = self.ranges[block].clone();
        self.coordinates[range.clone()].iter().map(|&index| index as usize).zip(&self.y[range])
    }

    /// Velocity changes of a block's rows by a change of the coordinates: `Y^T e`.
    pub fn velocity(&self, block: usize, e: &[f64]) -> Vec3 {
        self.entries(block).fold(Vec3::zeros(), |sum, (index, y)| sum + y * e[index])
    }

    /// Adds the change of the coordinates by impulses on a block's rows: `Y p`.
    pub fn add_impulse(&self, block: usize, p: &Vec3, e: &mut [f64]) {
        for (index, y) in self.entries(block) {
            e[index] += y.dot(p);
        }
    }

    /// Block of `Y^T Y` on the diagonal: the inverse inertia that a block's own impulses meet.
    pub fn own_inverse_inertia(&self, block: usize) -> Mat3 {
        let range = self.ranges[block].clone();
        self.y[range].iter().fold(Mat3::zeros(), |sum, y| sum + y * y.transpose())
    }

    /// Adds a block of three rows, with its load on each side.
    pub fn push(&mut self, model: &Model, data: &Data, loads: &[Load; 2]) {
        let first = self.y.len();
        let mut carriers = [Carrier { body: None, wrenches: [Wrench::ZERO; 3] }; 2];
        for (carrier, load) in carriers.iter_mut().zip(loads) {
            match load {
                Load::None => {}
                Load::Body { body, wrenches } => {
                    *carrier = Carrier { body: Some(*body), wrenches: *wrenches }
                }
                Load::Dof { body, .. } => carrier.body = Some(*body),
                Load::Point { point, impulses, r } => {
                    *carrier = self.pass_point(model, data, *point, impulses);
                    if data.spins(model, *point) {
                        self.pass_spin(model, *point, impulses, r);
                    }
                }
            }
        }
        // Parents have smaller indices, so the larger of two links is never above the other.
        while let Some(body) = carriers[0].body.max(carriers[1].body) {
            let mut wrenches = [Wrench::ZERO; 3];
            for carrier in carriers.iter_mut().filter(|carrier| carrier.body == Some(body)) {
                for (sum, wrench) in wrenches.iter_mut().zip(&carrier.wrenches) {
                    *sum += *wrench;
                }
                carrier.body = None;
            }
            self.pass_joint(model, data, body, &mut wrenches, loads);
            if let Some(parent) = model.bodies[body].parent {
                let r = &data.kinematics.links[body].r_parent;
                let free = usize::from(carriers[0].body.is_some());
                let wrenches = wrenches.map(|wrench| wrench.shifted(r));
                carriers[free] = Carrier { body: Some(parent.index()), wrenches };
            }
        }
        self.ranges.push(first..self.y.len());
    }

    /// Coordinates of a joint or point body; true if they are new.
    fn touch(&mut self, key: usize, width: usize) -> bool {
        let is_new = self.first_coordinate[key] == UNTOUCHED;
        if is_new {
            self.first_coordinate[key] = self.dimension as u32;
            self.touched.push(key);
            self.dimension += width;
        }
        let first = self.first_coordinate[key];
        self.coordinates.extend(first..first + width as u32);
        is_new
    }

    /// Eliminates a point body; what it passes to its anchor comes back.
    fn pass_point(&mut self, model: &Model, data: &Data, point: usize, impulses: &Mat3) -> Carrier {
        let factor = &data.factor.points[point];
        self.touch(model.bodies.len() + point, 3);
        let root = factor.inverse_mass.sqrt();
        self.y.extend(impulses.row_iter().map(|row| row.transpose() * root));
        match &model.points[point].tether {
            Some(tether) if factor.share != 0.0 => {
                let wrenches = [0, 1, 2]
                    .map(|k| Wrench::of_force_at(impulses.column(k) * factor.share, &factor.r_anchor));
                Carrier { body: Some(tether.body.index()), wrenches }
            }
            _ => Carrier { body: None, wrenches: [Wrench::ZERO; 3] },
        }
    }

    /// The spin of a point body is one more block of `D`: impulses at `r` from its centre turn it.
    fn pass_spin(&mut self, model: &Model, point: usize, impulses: &Mat3, r: &Vec3) {
        self.touch(model.bodies.len() + model.points.len() + point, 3);
        let root = (1.0 / model.points[point].spin_inertia).sqrt();
        let turning = r.cross_matrix() * impulses;
        self.y.extend(turning.row_iter().map(|row| row.transpose() * root));
    }

    /// Eliminates a joint: `y = S^T P`, `P - G y`; keeps `C^T y`.
    fn pass_joint(
        &mut self,
        model: &Model,
        data: &Data,
        body: usize,
        wrenches: &mut [Wrench; 3],
        loads: &[Load; 2],
    ) {
        let dofs = model.v_start[body]..model.v_start[body + 1];
        let width = dofs.len();
        if width == 0 {
            return;
        }
        let translations = model.bodies[body].joint.translations();
        let mut own = [Vec3::zeros(); WIDEST];
        for (k, (y, dof)) in own.iter_mut().zip(dofs.clone()).enumerate() {
            let axis = &data.kinematics.axes[dof];
            *y = Vec3::from(wrenches.map(|wrench| {
                if k < translations { axis.dot(&wrench.force) } else { axis.dot(&wrench.torque) }
            }));
            for load in loads {
                if let Load::Dof { dof: loaded, factor, .. } = load
                    && *loaded == dof
                {
                    y.x += factor;
                }
            }
        }
        let own = &own[..width];
        for (y, g) in own.iter().zip(&data.factor.g[dofs]) {
            for (wrench, y) in wrenches.iter_mut().zip(y.iter()) {
                *wrench = *wrench - g.scaled(*y);
            }
        }
        let entries = data.factor.d_start[body]..data.factor.d_start[body + 1];
        if self.touch(body, width) {
            lower_root(&data.factor.d_inverse[entries.clone()], width, &mut self.roots[entries.clone()]);
        }
        let root = &self.roots[entries];
        self.y.extend((0..width).map(|column| {
            own[column..]
                .iter()
                .enumerate()
                .fold(Vec3::zeros(), |sum, (below, y)| sum + y * root[(column + below) * width + column])
        }));
    }
}

/// Lower triangular C of a symmetric positive semidefinite matrix `C C^T`, both row after row. A frozen degree
/// of freedom is a zero row, and stays one.
fn lower_root(matrix: &[f64], size: usize, root: &mut [f64]) {
    for i in 0..size {
        for j in 0..=i {
            let done: f64 = (0..j).map(|k| root[i * size + k] * root[j * size + k]).sum();
            let rest = matrix[i * size + j] - done;
            root[i * size + j] = match (i == j, root[j * size + j]) {
                (true, _) => rest.max(0.0).sqrt(),
                (false, pivot) if pivot > 0.0 => rest / pivot,
                _ => 0.0,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn root_of_a_matrix_with_a_dead_row_skips_it() {
        let matrix = [4.0, 0.0, -2.0, 0.0, 0.0, 0.0, -2.0, 0.0, 5.0];
        let mut root = [0.0; 9];
        lower_root(&matrix, 3, &mut root);
        assert_eq!(root, [2.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 2.0]);
    }
}
