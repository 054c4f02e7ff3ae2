//! Stems of paths: six coordinates in place of those of many joints.

use orchard_geometry::Vec3;

use super::super::root::lower_root;
use super::super::rows::Load;
use super::super::stems::WIDTH;
use super::Paths;
use crate::data::Data;
use crate::model::Model;
use crate::spatial::Wrench;

/// A stretch of links that is followed once for all blocks.
#[derive(Debug, Clone)]
pub(super) struct Stem {
    /// Its upper end.
    pub link: usize,
    /// C of the inverse inertia there, torques before forces.
    root: [f64; WIDTH * WIDTH],
}

impl Paths {
    /// Sums up the way from a link to the root: unit wrenches there pass it as a block would.
    pub(super) fn add_stem(&mut self, model: &Model, data: &Data, link: usize) {
        let units = [Vec3::x(), Vec3::y(), Vec3::z()];
        let torques = units.map(|torque| Wrench { torque, ..Wrench::ZERO });
        let forces = units.map(|force| Wrench { force, ..Wrench::ZERO });
        for wrenches in [torques, forces] {
            self.push(model, data, &[Load::Body { body: link, wrenches }, Load::None]);
        }
        let mut inverse_inertia = [0.0; WIDTH * WIDTH];
        let (of_torques, of_forces) = self.y.split_at(self.y.len() / 2);
        for (t, f) in of_torques.iter().zip(of_forces) {
            let y = [t.x, t.y, t.z, f.x, f.y, f.z];
            for (row, a) in inverse_inertia.chunks_exact_mut(WIDTH).zip(y) {
                row.iter_mut().zip(y).for_each(|(entry, b)| *entry += a * b);
            }
        }
        let mut root = [0.0; WIDTH * WIDTH];
        lower_root::<WIDTH>(&inverse_inertia, &mut root);
        for node in self.nodes.drain(..) {
            self.widths[node.key] = 0;
        }
        self.y.clear();
        self.blocks.clear();
        self.stems.push(Stem { link, root });
    }

    /// Ends a path at a stem: `C^T P`.
    pub(super) fn pass_stem(&mut self, stem: usize, wrenches: &[Wrench; 3]) {
        self.touch(self.stems[stem].link, WIDTH);
        let [a, b, c] = wrenches;
        let part = |k: usize| Vec3::new(a.torque[k], b.torque[k], c.torque[k]);
        let pull = |k: usize| Vec3::new(a.force[k], b.force[k], c.force[k]);
        let p = [part(0), part(1), part(2), pull(0), pull(1), pull(2)];
        let root = &self.stems[stem].root;
        for column in 0..WIDTH {
            let below = p.iter().enumerate().skip(column);
            self.y.push(below.fold(Vec3::zeros(), |sum, (row, p)| sum + p * root[row * WIDTH + column]));
        }
    }
}
