//! Articulated-body algorithm: factor once, solve for many right-hand sides.

use orchard_geometry::Vec3;

use crate::data::Data;
use crate::model::{BodyId, Model};
use crate::spatial::{Twist, Wrench};

/// A right-hand side: impulses.
#[derive(Debug, Clone)]
pub struct Impulse {
    /// On each degree of freedom [N m s, N s].
    pub dof: Vec<f64>,
    /// On each link, at its origin, world axes.
    pub body: Vec<Wrench>,
    /// On each point body [N s], world.
    pub point: Vec<Vec3>,
}

/// A solution: velocity changes.
#[derive(Debug, Clone)]
pub struct Change {
    /// Of each degree of freedom [rad/s, m/s].
    pub dof: Vec<f64>,
    /// Of each link, at its origin, world axes.
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

#[derive(Debug, Clone)]
pub(crate) struct Factor {
    pub singular: Option<BodyId>,
}

impl Factor {
    pub fn new(_model: &Model) -> Factor {
        Factor { singular: None }
    }
}

/// Factors.
pub fn factor(_model: &Model, _data: &mut Data, _h: f64) {
    todo!()
}
