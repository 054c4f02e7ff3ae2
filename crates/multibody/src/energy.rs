//! Mechanical energy of a state.

use orchard_geometry::Vec3;

use crate::data::Data;
use crate::model::{JointKind, Model, PointId};
use crate::rod::Deflection;

/// Energy by kind \[J\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// Of links and point bodies.
    pub kinetic: f64,
    /// In gravity, zero at the world origin.
    pub gravitational: f64,
    /// In joint springs.
    pub joint_springs: f64,
    /// In tethers.
    pub tethers: f64,
    /// Of the constant forces on the anchors of tethered points, zero at the world origin.
    pub anchor_bias: f64,
}

impl Energy {
    /// The sum \[J\].
    pub fn total(&self) -> f64 {
        self.kinetic + self.gravitational + self.joint_springs + self.tethers + self.anchor_bias
    }
}

/// Energy of the state of the last kinematics.
pub fn energy(model: &Model, data: &Data, gravity: &Vec3) -> Energy {
    let mut energy = Energy::default();
    for id in model.body_ids() {
        let body = model.body(id);
        let link = &data.kinematics.links[id.index()];
        let v_com = link.velocity.linear_at(&link.r_com);
        let omega = link.velocity.angular;
        energy.kinetic += 0.5 * (body.inertia.mass * v_com.norm_squared() + omega.dot(&(link.i_com * omega)));
        energy.gravitational -= body.inertia.mass * gravity.dot(&data.com_p_world(id));
        if body.joint == JointKind::Ball {
            let stiffness = &data.stiffness[model.dofs(id)];
            let rod = Deflection::of(&data.q[model.qs(id)]);
            energy.joint_springs += rod.energy(stiffness[0], stiffness[2]);
        } else if body.joint != JointKind::Free {
            for (q, dof) in model.qs(id).zip(model.dofs(id)) {
                let stretch = data.q[q] - data.rest[dof];
                energy.joint_springs += 0.5 * data.stiffness[dof] * stretch * stretch;
            }
        }
    }
    for (index, point) in model.points().iter().enumerate() {
        let id = PointId(index as u32);
        let p_world = data.point_p_world[index];
        energy.kinetic += 0.5 * point.mass * data.point_v_world[index].norm_squared();
        if data.spins(model, index) {
            energy.kinetic += 0.5 * point.spin_inertia * data.point_w_world[index].norm_squared();
        }
        energy.gravitational -= point.mass * gravity.dot(&p_world);
        if let (Some(tether), Some(anchor)) = (&point.tether, data.anchor_p_world(model, id))
            && data.tethered[index]
        {
            let stretch = p_world - (anchor + tether.offset_world);
            energy.tethers += 0.5 * tether.stiffness * stretch.norm_squared();
            energy.anchor_bias -= data.anchor_bias_world[index].dot(&anchor);
        }
    }
    energy
}
