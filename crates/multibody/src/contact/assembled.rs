//! The assembled path: the unknown is the generalised velocity change, each direction from a sparse Cholesky factor
//! of `A + J^T G J`. A cross-check that shares no sweep with the other paths.

use std::collections::BTreeMap;

use orchard_geometry::Vec3;

use super::block::{Block, Load, Turns};
use super::law::Response;
use super::newton::{Direction, Unknown};
use crate::data::Data;
use crate::model::Model;
use crate::solver::cholesky::{Entry, SparseFactor, entries, for_ancestors};
use crate::spatial::Wrench;
use crate::vectors::{add_scaled, dot};

/// The velocity change of joints, point bodies and spins; the matrix and the rows.
pub(super) struct Assembled {
    /// A.
    matrix: Vec<Entry>,
    factor: Option<SparseFactor>,
    /// Columns of J^T: of each block, the values of its three rows by unknown.
    rows: Vec<Vec<(usize, Vec3)>>,
    u: Vec<f64>,
    residual: Vec<f64>,
    du: Vec<f64>,
}

impl Assembled {
    pub fn new(model: &Model, data: &Data, blocks: &[Block]) -> Assembled {
        let points = model.points.len();
        let spins = model.nv() + 3 * points;
        let size = spins + 3 * points;
        let mut matrix = entries(model, &data.kinematics, &data.linear.system);
        for (index, point) in model.points.iter().enumerate() {
            let inertia = if data.spins(model, index) { point.spin_inertia } else { 1.0 };
            matrix.extend((0..3).map(|k| (spins + 3 * index + k, spins + 3 * index + k, inertia)));
        }
        let rows = blocks.iter().map(|block| row_values(model, data, spins, block)).collect();
        let factor = SparseFactor::new(size, &matrix);
        let zero = vec![0.0; size];
        Assembled { matrix, factor, rows, u: zero.clone(), residual: zero.clone(), du: zero }
    }

    /// `A x`.
    fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for &(i, j, value) in &self.matrix {
            y[i] += value * x[j];
            if i != j {
                y[j] += value * x[i];
            }
        }
        y
    }

    /// `J x`.
    fn velocities(&self, x: &[f64], out: &mut [Vec3]) {
        for (out, row) in out.iter_mut().zip(&self.rows) {
            *out = row.iter().fold(Vec3::zeros(), |sum, (index, value)| sum + value * x[*index]);
        }
    }

    /// `J^T p`.
    fn impulse<'a>(&self, p: impl Iterator<Item = &'a Vec3>) -> Vec<f64> {
        let mut sum = vec![0.0; self.u.len()];
        for (row, p) in self.rows.iter().zip(p) {
            for (index, value) in row {
                sum[*index] += value.dot(p);
            }
        }
        sum
    }

    /// `b^T A^-1 b`.
    fn inverse_product(&self, b: &[f64]) -> f64 {
        let mut x = b.to_vec();
        if let Some(factor) = &self.factor {
            factor.solve(&mut x);
        }
        dot(&x, b)
    }
}

/// J of a block, by unknown.
fn row_values(model: &Model, data: &Data, spins: usize, block: &Block) -> Vec<(usize, Vec3)> {
    let mut values = BTreeMap::<usize, Vec3>::new();
    for load in &block.loads {
        match load {
            Load::None => {}
            Load::Dof { dof, factor, .. } => values.entry(*dof).or_default().x += factor,
            Load::Body { body, wrenches } => {
                for (row, wrench) in wrenches.iter().enumerate() {
                    for_ancestors(model, &data.kinematics, *body, *wrench, |dof, value| {
                        values.entry(dof).or_default()[row] += value;
                    });
                }
            }
            Load::Point { point, .. } if data.point_carried[*point] => {}
            Load::Point { point, impulses, r, turns } => {
                let turning = r.cross_matrix() * impulses;
                for k in 0..3 {
                    values.insert(model.nv() + 3 * point + k, impulses.row(k).transpose());
                }
                match turns {
                    Turns::Nothing => {}
                    Turns::Ball => (0..3).for_each(|k| {
                        values.insert(spins + 3 * point + k, turning.row(k).transpose());
                    }),
                    Turns::Link(link) => {
                        for (row, torque) in turning.column_iter().enumerate() {
                            let wrench = Wrench { torque: torque.into_owned(), force: Vec3::zeros() };
                            for_ancestors(model, &data.kinematics, *link, wrench, |dof, value| {
                                values.entry(dof).or_default()[row] += value;
                            });
                        }
                    }
                }
            }
        }
    }
    values.into_iter().collect()
}

impl Unknown for Assembled {
    fn start(&mut self, blocks: &[Block], change: &mut [Vec3]) {
        self.u = self.impulse(blocks.iter().map(|block| &block.guess));
        if let Some(factor) = &self.factor {
            factor.solve(&mut self.u);
        }
        self.velocities(&self.u, change);
    }

    fn residual(&mut self, _blocks: &[Block], responses: &[Response]) -> f64 {
        let inertial = self.multiply(&self.u);
        let impulse = self.impulse(responses.iter().map(|response| &response.impulse));
        self.residual = impulse.iter().zip(&inertial).map(|(impulse, inertial)| impulse - inertial).collect();
        let scale = f64::max(dot(&self.u, &inertial), self.inverse_product(&impulse));
        if scale > 0.0 { (self.inverse_product(&self.residual) / scale).sqrt() } else { 0.0 }
    }

    fn direction(&mut self, responses: &[Response], _residual: f64, change: &mut [Vec3]) -> Direction {
        let mut hessian = self.matrix.clone();
        for (row, response) in self.rows.iter().zip(responses).filter(|(_, response)| response.rank > 0) {
            let stiffness = response.root * response.root.transpose();
            for (at, (i, value)) in row.iter().enumerate() {
                let scaled = stiffness * value;
                hessian.extend(row[at..].iter().map(|(j, other)| (*i, *j, scaled.dot(other))));
            }
        }
        self.du.copy_from_slice(&self.residual);
        match SparseFactor::new(self.u.len(), &hessian) {
            Some(factor) => factor.solve(&mut self.du),
            None => self.du.fill(0.0),
        }
        self.velocities(&self.du, change);
        let inertial = self.multiply(&self.du);
        Direction { slope: dot(&self.u, &inertial), curvature: dot(&self.du, &inertial), iterations: 0 }
    }

    fn advance(&mut self, length: f64) {
        add_scaled(&mut self.u, &self.du, length);
    }
}
