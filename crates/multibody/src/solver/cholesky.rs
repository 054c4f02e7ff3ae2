//! The assembled system matrix and its sparse Cholesky factor.
//!
//! A joint couples only with its ancestors, a tethered point body only with its anchor's. Eliminated from the leaves
//! to the root, the factor has the pattern of the matrix, without fill-in.

use clarabel::algebra::CscMatrix;
use clarabel::qdldl::{QDLDLFactorisation, QDLDLSettings};
use orchard_geometry::Vec3;

use super::system::System;
use crate::kinematics::Kinematics;
use crate::model::Model;
use crate::spatial::Wrench;

/// An entry (i, j) of a symmetric matrix with i <= j, in the order of the unknowns: parents first.
pub(crate) type Entry = (usize, usize, f64);

/// Cholesky factor L D L^T of a symmetric positive definite matrix, the last unknown eliminated first: D is diagonal, and
/// the diagonal of L is one.
#[derive(Debug, Clone)]
pub(crate) struct SparseFactor {
    /// L below its diagonal, by columns.
    lower: CscMatrix<f64>,
    /// 1 / D.
    inverse_diagonal: Vec<f64>,
}

impl SparseFactor {
    /// Factors a matrix given by its entries, of which equal places add up; `None` if it is not positive definite.
    pub fn new(size: usize, entries: &[Entry]) -> Option<SparseFactor> {
        if size == 0 {
            return Some(SparseFactor { lower: CscMatrix::zeros((0, 0)), inverse_diagonal: Vec::new() });
        }
        // The last unknowns are the leaves. Turned around and transposed, the entries are the upper triangle of the
        // elimination order, which is what QDLDL reads.
        let (rows, columns) = entries.iter().map(|&(i, j, _)| (size - 1 - j, size - 1 - i)).unzip();
        let values = entries.iter().map(|&(_, _, value)| value).collect();
        let matrix = CscMatrix::new_from_triplets(size, size, rows, columns, values);
        let as_given = QDLDLSettings {
            perm: Some((0..size).collect()),
            regularize_enable: false,
            ..QDLDLSettings::default()
        };
        let factor = QDLDLFactorisation::new(&matrix, Some(as_given)).ok()?;
        let is_positive = factor.positive_inertia() == size;
        is_positive.then_some(SparseFactor { lower: factor.L, inverse_diagonal: factor.Dinv })
    }

    /// Factors the system matrix.
    pub fn of_system(model: &Model, kinematics: &Kinematics, system: &System) -> Option<SparseFactor> {
        SparseFactor::new(system.size(), &entries(model, kinematics, system))
    }

    /// Solves in place.
    pub fn solve(&self, x: &mut [f64]) {
        x.reverse();
        for column in 0..x.len() {
            let known = x[column];
            self.column(column).for_each(|(row, value)| x[row] -= value * known);
        }
        for column in (0..x.len()).rev() {
            let below: f64 = self.column(column).map(|(row, value)| value * x[row]).sum();
            x[column] = x[column] * self.inverse_diagonal[column] - below;
        }
        x.reverse();
    }

    /// Rows and values of a column of L below its diagonal.
    fn column(&self, column: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.lower.colptr[column]..self.lower.colptr[column + 1];
        self.lower.rowval[range.clone()].iter().copied().zip(self.lower.nzval[range].iter().copied())
    }
}

/// Entries of the system matrix: the wrench of a unit change of each unknown, projected on the axes of every joint from there to
/// the root (composite rigid bodies, Featherstone 2008, section 6.2).
pub(crate) fn entries(model: &Model, kinematics: &Kinematics, system: &System) -> Vec<Entry> {
    let mut composites = Vec::new();
    system.composite_inertias(model, kinematics, &mut composites);
    let mut entries = Vec::new();
    for (index, body) in model.bodies.iter().enumerate() {
        let inertia = &composites[index];
        for (k, column) in (model.v_start[index]..model.v_start[index + 1]).enumerate() {
            let axis = kinematics.axes[column];
            let wrench = if k < body.joint.translations() {
                inertia.of_translation(&axis)
            } else {
                inertia.of_rotation(&axis)
            };
            for_ancestors(model, kinematics, index, wrench, |dof, value| {
                if dof <= column {
                    entries.push((dof, column, value));
                }
            });
            entries.push((column, column, system.armature[column]));
        }
    }
    for (index, point) in system.points.iter().enumerate() {
        for (k, axis) in [Vec3::x(), Vec3::y(), Vec3::z()].into_iter().enumerate() {
            let column = model.nv() + 3 * index + k;
            let own = if point.is_carried { 1.0 } else { point.mass + point.kappa };
            entries.push((column, column, own));
            if let Some((body, r)) = &point.anchor {
                let wrench = Wrench::of_force_at(axis * -point.kappa, r);
                for_ancestors(model, kinematics, *body, wrench, |dof, value| {
                    entries.push((dof, column, value))
                });
            }
        }
    }
    entries
}

/// Visits the component of a wrench at a link's origin along each degree of freedom from there to the root.
pub(crate) fn for_ancestors(
    model: &Model,
    kinematics: &Kinematics,
    body: usize,
    wrench: Wrench,
    mut with: impl FnMut(usize, f64),
) {
    let (mut next, mut wrench) = (Some(body), wrench);
    while let Some(index) = next {
        let translations = model.bodies[index].joint.translations();
        for (k, dof) in (model.v_start[index]..model.v_start[index + 1]).enumerate() {
            let along = if k < translations { wrench.force } else { wrench.torque };
            with(dof, kinematics.axes[dof].dot(&along));
        }
        wrench = wrench.shifted(&kinematics.links[index].r_parent);
        next = model.bodies[index].parent.map(|parent| parent.index());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Body, BodyId, Data, JointKind, ModelBuilder, PointBody, SpatialInertia, Tether};
    use orchard_geometry::{Mat3, Pose};

    #[test]
    fn nothing_fills_in_on_a_forked_tree() {
        let mut builder = ModelBuilder::new();
        for parent in [None, Some(0), Some(1), Some(1), Some(0), Some(4)] {
            let rod = SpatialInertia { mass: 1.0, p_com: Vec3::z() * 0.1, i_com: Mat3::identity() * 0.01 };
            let link = builder.add_body(Body {
                parent: parent.map(BodyId),
                joint: JointKind::Universal,
                x_parent_joint: Pose::translation(0.0, 0.1, 0.2),
                inertia: rod,
            });
            let tether = Tether {
                body: link,
                p_body: Vec3::x(),
                offset_world: Vec3::zeros(),
                stiffness: 100.0,
                damping: 1.0,
                anchor_bias_world: Vec3::zeros(),
                reaction_cap: f64::INFINITY,
                turns: false,
            };
            builder.add_point(PointBody { mass: 0.1, spin_inertia: f64::INFINITY, tether: Some(tether) });
        }
        let model = builder.build().unwrap();
        let mut data = Data::new(&model);
        crate::aba::factor(&model, &mut data, 0.01);
        let mut system = System::default();
        system.update(&model, &data, 0.01);
        let entries = entries(&model, &data.kinematics, &system);
        let mut places: Vec<_> = entries.iter().map(|&(i, j, _)| (i, j)).collect();
        places.sort_unstable();
        places.dedup();
        let factor = SparseFactor::new(system.size(), &entries).unwrap();
        assert_eq!(factor.lower.nnz() + system.size(), places.len());
    }
}
