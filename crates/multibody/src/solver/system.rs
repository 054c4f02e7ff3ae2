//! The system matrix A as a product: rigid links, springs and tethers, without a factor.

use orchard_geometry::Vec3;

use crate::aba::vectors::{Change, Impulse};
use crate::kinematics::Kinematics;
use crate::model::Model;
use crate::spatial::{ArticulatedInertia, Twist, Wrench};
use crate::symmetric::Symmetric3;

/// A link with its drag: `m (1 + h c_v)`, `I (1 + h c_w)`.
#[derive(Debug, Clone)]
pub(crate) struct LinkRow {
    pub mass: f64,
    pub i_com: Symmetric3,
}

/// A point body: mass with its linearised air drag, and its tether.
#[derive(Debug, Clone)]
pub(crate) struct PointRow {
    pub mass: f64,
    /// Inertia that the tether adds \[kg\], 0 untethered.
    pub kappa: f64,
    /// The link that feels the tether, and the anchor from its origin.
    pub anchor: Option<(usize, Vec3)>,
    /// True if nothing moves it; its row is then left out.
    pub is_carried: bool,
}

/// A at one state, for products with vectors of the joints' entries, then three of each point body.
#[derive(Debug, Clone, Default)]
pub(crate) struct System {
    pub links: Vec<LinkRow>,
    pub points: Vec<PointRow>,
    /// `h d + h^2 k` of each degree of freedom.
    pub armature: Vec<f64>,
    /// 1 / A_ii; 0 where a row is left out.
    pub inverse_diagonal: Vec<f64>,
    pub(super) twists: Vec<Twist>,
    pub(super) wrenches: Vec<Wrench>,
    composites: Vec<ArticulatedInertia>,
}

impl System {
    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.armature.len() + 3 * self.points.len()
    }

    /// Inertia of each link with all that hangs on it, joints locked and anchors of tethers loaded with their
    /// kappa; about its origin.
    pub fn composite_inertias(
        &self,
        model: &Model,
        kinematics: &Kinematics,
        out: &mut Vec<ArticulatedInertia>,
    ) {
        out.clear();
        out.extend(
            self.links
                .iter()
                .zip(&kinematics.links)
                .map(|(row, link)| ArticulatedInertia::of_rigid(row.mass, &link.r_com, row.i_com)),
        );
        for point in &self.points {
            if let Some((body, r)) = &point.anchor {
                out[*body] += ArticulatedInertia::of_rigid(point.kappa, r, Symmetric3::ZERO);
            }
        }
        for (index, body) in model.bodies.iter().enumerate().rev() {
            if let Some(parent) = body.parent {
                let child = out[index];
                out[parent.index()] += child.shifted(&kinematics.links[index].r_parent);
            }
        }
    }

    /// A_ii is the composite inertia along the axis, plus the armature.
    pub(super) fn invert_diagonal(&mut self, model: &Model, kinematics: &Kinematics) {
        let mut composites = std::mem::take(&mut self.composites);
        self.composite_inertias(model, kinematics, &mut composites);
        self.inverse_diagonal.clear();
        for (index, body) in model.bodies.iter().enumerate() {
            let inertia = &composites[index];
            for (k, dof) in (model.v_start[index]..model.v_start[index + 1]).enumerate() {
                let axis = kinematics.axes[dof];
                let block = if k < body.joint.translations() { inertia.linear } else { inertia.angular };
                self.inverse_diagonal.push(1.0 / (axis.dot(&(block * axis)) + self.armature[dof]));
            }
        }
        for point in &self.points {
            let inverse = if point.is_carried { 0.0 } else { 1.0 / (point.mass + point.kappa) };
            self.inverse_diagonal.extend([inverse; 3]);
        }
        self.composites = composites;
    }

    /// `y = A x`.
    pub fn multiply(&mut self, model: &Model, kinematics: &Kinematics, x: &[f64], y: &mut [f64]) {
        let (x_dof, x_point) = x.split_at(self.armature.len());
        let (y_dof, y_point) = y.split_at_mut(self.armature.len());
        outward(model, kinematics, x_dof, &mut self.twists);
        for (index, row) in self.links.iter().enumerate() {
            let (twist, r_com) = (&self.twists[index], &kinematics.links[index].r_com);
            let torque = row.i_com * twist.angular;
            self.wrenches[index] = Wrench { torque, force: Vec3::zeros() }
                + Wrench::of_force_at(twist.linear_at(r_com) * row.mass, r_com);
        }
        for ((point, x), y) in self.points.iter().zip(x_point.chunks(3)).zip(y_point.chunks_mut(3)) {
            let x = Vec3::from_column_slice(x);
            let own = match &point.anchor {
                _ if point.is_carried => Vec3::zeros(),
                Some((body, r)) => {
                    let pull = (x - self.twists[*body].linear_at(r)) * point.kappa;
                    self.wrenches[*body] = self.wrenches[*body] - Wrench::of_force_at(pull, r);
                    x * point.mass + pull
                }
                None => x * (point.mass + point.kappa),
            };
            y.copy_from_slice(own.as_slice());
        }
        inward(model, kinematics, &mut self.wrenches, y_dof);
        for ((y, x), armature) in y_dof.iter_mut().zip(x_dof).zip(&self.armature) {
            *y += armature * x;
        }
    }

    /// An impulse as a vector of the unknowns. The body impulses are overwritten.
    pub fn gather(&self, model: &Model, kinematics: &Kinematics, impulse: &mut Impulse, out: &mut [f64]) {
        let (of_dof, of_point) = out.split_at_mut(self.armature.len());
        inward(model, kinematics, &mut impulse.body, of_dof);
        for (sum, own) in of_dof.iter_mut().zip(&impulse.dof) {
            *sum += own;
        }
        for ((entries, own), point) in of_point.chunks_mut(3).zip(&impulse.point).zip(&self.points) {
            if point.is_carried {
                entries.fill(0.0);
            } else {
                entries.copy_from_slice(own.as_slice());
            }
        }
    }

    /// A vector of the unknowns as velocity changes, links included.
    pub fn scatter(&self, model: &Model, kinematics: &Kinematics, x: &[f64], change: &mut Change) {
        let (of_dof, of_point) = x.split_at(self.armature.len());
        change.dof.copy_from_slice(of_dof);
        outward(model, kinematics, of_dof, &mut change.body);
        for (own, entries) in change.point.iter_mut().zip(of_point.chunks(3)) {
            *own = Vec3::from_column_slice(entries);
        }
    }
}

/// Twists of the links at their origins by joint entries `x`: `J x`.
fn outward(model: &Model, kinematics: &Kinematics, x: &[f64], twists: &mut [Twist]) {
    for (index, body) in model.bodies.iter().enumerate() {
        let parent = body.parent.map_or(Twist::ZERO, |parent| twists[parent.index()]);
        let mut twist = parent.shifted(&kinematics.links[index].r_parent);
        for (k, dof) in (model.v_start[index]..model.v_start[index + 1]).enumerate() {
            let part = kinematics.axes[dof] * x[dof];
            if k < body.joint.translations() {
                twist.linear += part;
            } else {
                twist.angular += part;
            }
        }
        twists[index] = twist;
    }
}

/// Impulses along the degrees of freedom by wrenches on the links: `J^T P`. The wrenches become those of sub-trees.
fn inward(model: &Model, kinematics: &Kinematics, wrenches: &mut [Wrench], out: &mut [f64]) {
    for (index, body) in model.bodies.iter().enumerate().rev() {
        let wrench = wrenches[index];
        for (k, dof) in (model.v_start[index]..model.v_start[index + 1]).enumerate() {
            let along = if k < body.joint.translations() { wrench.force } else { wrench.torque };
            out[dof] = kinematics.axes[dof].dot(&along);
        }
        if let Some(parent) = body.parent {
            wrenches[parent.index()] += wrench.shifted(&kinematics.links[index].r_parent);
        }
    }
}
