//! Impulses and changes as vectors of the unknowns: joints first, then three entries of each point body.

use orchard_geometry::Vec3;

use crate::aba::{Change, Impulse};
use crate::model::Model;
use crate::spatial::{Twist, Wrench};

impl Impulse {
    /// Makes room.
    pub(super) fn reserve(&mut self, model: &Model) {
        self.dof.resize(model.nv(), 0.0);
        self.body.resize(model.bodies.len(), Wrench::ZERO);
        self.point.resize(model.points.len(), Vec3::zeros());
    }

    /// Takes the entries of a vector, without wrenches on the links.
    pub(super) fn set_entries(&mut self, entries: &[f64]) {
        let (of_dof, of_point) = entries.split_at(self.dof.len());
        self.dof.copy_from_slice(of_dof);
        self.body.fill(Wrench::ZERO);
        for (own, entries) in self.point.iter_mut().zip(of_point.chunks(3)) {
            *own = Vec3::from_column_slice(entries);
        }
    }
}

impl Change {
    /// Makes room.
    pub(super) fn reserve(&mut self, model: &Model) {
        self.dof.resize(model.nv(), 0.0);
        self.body.resize(model.bodies.len(), Twist::ZERO);
        self.point.resize(model.points.len(), Vec3::zeros());
    }

    /// Writes the entries as a vector.
    pub(super) fn write_entries(&self, entries: &mut [f64]) {
        let (of_dof, of_point) = entries.split_at_mut(self.dof.len());
        of_dof.copy_from_slice(&self.dof);
        for (own, entries) in self.point.iter().zip(of_point.chunks_mut(3)) {
            entries.copy_from_slice(own.as_slice());
        }
    }
}
