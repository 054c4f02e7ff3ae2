//! Right-hand side and solution of the linear system.

use orchard_geometry::Vec3;

use crate::model::Model;
use crate::spatial::{Twist, Wrench};

/// A right-hand side: impulses.
#[derive(Debug, Clone, Default)]
pub struct Impulse {
    /// On each degree of freedom [N m s, N s].
    pub dof: Vec<f64>,
    /// On each link, at its origin, world axes [N m s, N s].
    pub body: Vec<Wrench>,
    /// On each point body [N s], world.
    pub point: Vec<Vec3>,
}

/// A solution: velocity changes.
#[derive(Debug, Clone, Default)]
pub struct Change {
    /// Of each degree of freedom [rad/s, m/s].
    pub dof: Vec<f64>,
    /// Of each link, at its origin, world axes [rad/s, m/s].
    pub body: Vec<Twist>,
    /// Of each point body [m/s], world.
    pub point: Vec<Vec3>,
}

impl Impulse {
    /// No impulse.
    pub fn new(model: &Model) -> Impulse {
        Impulse {
            dof: vec![0.0; model.nv()],
            body: vec![Wrench::ZERO; model.bodies.len()],
            point: vec![Vec3::zeros(); model.points.len()],
        }
    }

    /// True if nothing acts on a link and the degrees of freedom of its joint.
    #[inline]
    pub(super) fn is_zero(&self, link: usize, dofs: std::ops::Range<usize>) -> bool {
        self.body[link] == Wrench::ZERO && self.dof[dofs].iter().all(|impulse| *impulse == 0.0)
    }

    /// Sets all to zero.
    pub fn clear(&mut self) {
        self.dof.fill(0.0);
        self.body.fill(Wrench::ZERO);
        self.point.fill(Vec3::zeros());
    }
}

impl Change {
    /// No change.
    pub fn new(model: &Model) -> Change {
        Change {
            dof: vec![0.0; model.nv()],
            body: vec![Twist::ZERO; model.bodies.len()],
            point: vec![Vec3::zeros(); model.points.len()],
        }
    }
}
