//! The shared part of several contact paths, reduced to the six spatial coordinates of its last link.

use orchard_geometry::Vec3;

use super::super::block::Load;
use super::super::root::lower_root;
use super::super::shared::WIDTH;
use super::Paths;
use crate::aba::factors::Factor;
use crate::kinematics::Kinematics;
use crate::model::Model;
use crate::spatial::Wrench;

/// Part of a path that all blocks of a tree share; it is followed once.
#[derive(Debug, Clone)]
pub(super) struct SharedPath {
    /// Last link: the upper end of the path.
    pub link: usize,
    /// C of the inverse inertia there, torques before forces.
    root: [f64; WIDTH * WIDTH],
}

impl Paths {
    /// Reduces the path from a link to the root: six unit wrenches at the link are propagated as a block would be.
    pub(super) fn add_shared(
        &mut self,
        model: &Model,
        kinematics: &Kinematics,
        factor: &Factor,
        link: usize,
    ) {
        let units = [Vec3::x(), Vec3::y(), Vec3::z()];
        let torques = units.map(|torque| Wrench { torque, ..Wrench::ZERO });
        let forces = units.map(|force| Wrench { force, ..Wrench::ZERO });
        for wrenches in [torques, forces] {
            self.push(model, kinematics, factor, &[Load::Body { body: link, wrenches }, Load::None]);
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
        self.shared.push(SharedPath { link, root });
    }

    /// Ends a path at the upper end of a shared path: `C^T P`.
    pub(super) fn pass_shared(&mut self, shared: usize, wrenches: &[Wrench; 3]) {
        self.touch(self.shared[shared].link, WIDTH);
        let [a, b, c] = wrenches;
        let part = |k: usize| Vec3::new(a.torque[k], b.torque[k], c.torque[k]);
        let pull = |k: usize| Vec3::new(a.force[k], b.force[k], c.force[k]);
        let p = [part(0), part(1), part(2), pull(0), pull(1), pull(2)];
        let root = &self.shared[shared].root;
        for column in 0..WIDTH {
            let below = p.iter().enumerate().skip(column);
            self.y.push(below.fold(Vec3::zeros(), |sum, (row, p)| sum + p * root[row * WIDTH + column]));
        }
    }
}
