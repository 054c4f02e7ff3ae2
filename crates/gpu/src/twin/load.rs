//! What a link bears at its tip: articulated inertia and impulses of what hangs there.

use super::Lane;
use super::math::Vec3;

/// Symmetric matrices are kept as their columns from the diagonal down, (xx, xy, xz) and (yy, yz, zz).
#[derive(Clone, Copy)]
pub(super) struct Load {
    pub angular: [Vec3; 2],
    /// Columns: torque by linear motion along x, y, z.
    pub coupling: [Vec3; 3],
    pub linear: [Vec3; 2],
    pub torque: Vec3,
    pub force: Vec3,
}

impl Load {
    pub fn nothing() -> Self {
        let zero = Vec3::zeros();
        Self { angular: [zero; 2], coupling: [zero; 3], linear: [zero; 2], torque: zero, force: zero }
    }

    pub fn plus(&self, other: &Self) -> Self {
        let add = |a: &[Vec3], b: &[Vec3], k: usize| a[k] + b[k];
        Self {
            angular: [0, 1].map(|k| add(&self.angular, &other.angular, k)),
            coupling: [0, 1, 2].map(|k| add(&self.coupling, &other.coupling, k)),
            linear: [0, 1].map(|k| add(&self.linear, &other.linear, k)),
            torque: self.torque + other.torque,
            force: self.force + other.force,
        }
    }

    /// With a point mass at an arm, which bears nothing itself.
    pub fn plus_point_mass(mut self, mass: f32, arm: Vec3) -> Self {
        let m = arm * mass;
        self.angular[0] += Vec3::new(m.y * arm.y + m.z * arm.z, -m.x * arm.y, -m.x * arm.z);
        self.angular[1] += Vec3::new(m.x * arm.x + m.z * arm.z, -m.y * arm.z, m.x * arm.x + m.y * arm.y);
        self.coupling[0] += Vec3::new(0.0, m.z, -m.y);
        self.coupling[1] += Vec3::new(-m.z, 0.0, m.x);
        self.coupling[2] += Vec3::new(m.y, -m.x, 0.0);
        self.linear[0].x += mass;
        self.linear[1].x += mass;
        self.linear[1].z += mass;
        self
    }
}

impl Lane<'_> {
    pub(super) fn load(&self, at: usize) -> Load {
        let [a_0, a_1, h_0, h_1, h_2, m_0, m_1, torque, force] = self.vectors(at, 0);
        Load { angular: [a_0, a_1], coupling: [h_0, h_1, h_2], linear: [m_0, m_1], torque, force }
    }

    pub(super) fn set_load(&mut self, at: usize, load: &Load) {
        let Load { angular: [a_0, a_1], coupling: [h_0, h_1, h_2], linear: [m_0, m_1], torque, force } =
            *load;
        self.set_vectors(at, 0, &[a_0, a_1, h_0, h_1, h_2, m_0, m_1, torque, force]);
    }
}
