//! Torques of an arm on a moving base, against the inverse dynamics of `multibody`.

use crate::bench::{Bench, GRAVITY};
use orchard_geometry::{Rotation, Vec3};
use orchard_multibody::{BodyId, forward_kinematics, inverse_dynamics};
use orchard_robot::{BaseMotion, JointVector, RobotModel};

/// A motion of arm and base, and the torques of the arm that it takes by the world model.
struct Moved {
    q: JointVector,
    v: JointVector,
    a: JointVector,
    base: BaseMotion,
    torque: JointVector,
}

impl Bench {
    fn named(name: &str) -> Self {
        Self::new(&RobotModel::named(name).unwrap())
    }

    /// Sets the base in motion; returns that motion in the base's axes. `speed` and `change` are along odom's axes and about the vertical.
    fn move_base(
        &mut self,
        acceleration: &mut [f64],
        base: BodyId,
        speed: [f64; 3],
        change: [f64; 3],
    ) -> BaseMotion {
        let (qs, dofs) = (self.model.qs(base), self.model.dofs(base));
        if dofs.len() == 1 {
            // The rail runs along y.
            self.data.v[dofs.start] = speed[1];
            acceleration[dofs.start] = change[1];
            return BaseMotion { acceleration: Vec3::y() * change[1], ..BaseMotion::default() };
        }
        let yaw = 0.7;
        self.data.q[qs].copy_from_slice(&[0.3, -0.4, yaw]);
        self.data.v[dofs.clone()].copy_from_slice(&speed);
        acceleration[dofs].copy_from_slice(&change);
        let turn = Rotation::from_axis_angle(&Vec3::z_axis(), -yaw);
        BaseMotion {
            acceleration: turn * Vec3::new(change[0], change[1], 0.0),
            angular_velocity: Vec3::z() * speed[2],
            angular_acceleration: Vec3::z() * change[2],
        }
    }

    /// Motion number `n`.
    fn moved(&mut self, n: u32) -> Moved {
        let arm = self.robot.kinematics().clone();
        let draw =
            |i: usize, scale: f64| scale * (2.0 * (f64::from(n) * 0.618 + 0.37 * i as f64).fract() - 1.0);
        let joints =
            |of: &dyn Fn(usize) -> f64| JointVector::from_fn(|i, _| if i < arm.dof() { of(i) } else { 0.0 });
        let q = joints(&|i| arm.home()[i] + draw(i, 0.8));
        let v = joints(&|i| draw(i + 10, 2.0));
        let a = joints(&|i| draw(i + 20, 9.0));
        let mut acceleration = vec![0.0; self.model.nv()];
        for (i, &body) in self.handle.arm.iter().enumerate() {
            let dof = self.model.dofs(body).start;
            self.data.q[self.model.qs(body).start] = q[i];
            self.data.v[dof] = v[i];
            acceleration[dof] = a[i];
        }
        let base = *self.handle.base_joint.moving().unwrap();
        let (speed, change) = ([0, 1, 2].map(|i| draw(i + 30, 1.0)), [0, 1, 2].map(|i| draw(i + 40, 3.0)));
        let base = self.move_base(&mut acceleration, base, speed, change);
        forward_kinematics(&self.model, &mut self.data);
        let all = inverse_dynamics(&self.model, &self.data, &acceleration, &GRAVITY);
        let torque = joints(&|i| all[self.model.dofs(self.handle.arm[i]).start]);
        Moved { q, v, a, base, torque }
    }
}

/// The torques that the world model asks for leave nothing for the hand to exert, and a pull at the hand is found. Without the base's motion
/// and velocity products the estimate is newtons off.
#[test]
fn the_force_at_the_hand_is_found_while_the_base_moves() {
    for name in ["ridgeback-fr3", "rail-xarm6-suction"] {
        let mut alone = Bench::named(name);
        let arm = alone.robot.kinematics().clone();
        let mut off = 0.0_f64;
        for n in 0..20 {
            let Moved { q, v, a, base, torque } = alone.moved(n);
            let force =
                |torque: &JointVector| arm.tcp_load_on_moving_base(&q, &v, &a, torque, &base, &GRAVITY).force;
            assert!(force(&torque).norm() < 1e-6, "{name}, {n}: {} N", force(&torque));
            let pull = Vec3::new(3.0, -2.0, 5.0);
            let pulled = torque + arm.jacobian(&q).fixed_rows::<3>(3).transpose() * pull;
            assert!((force(&pulled) - pull).norm() < 1e-6, "{name}, {n}: {}", force(&pulled));
            let turn = Vec3::new(0.3, 0.1, -0.2);
            let turned = pulled + arm.jacobian(&q).fixed_rows::<3>(0).transpose() * turn;
            let load = arm.tcp_load_on_moving_base(&q, &v, &a, &turned, &base, &GRAVITY);
            assert!((load.torque - turn).norm() < 1e-6 && (load.force - pull).norm() < 1e-6, "{name}, {n}");
            off = off.max(arm.tcp_load(&q, &a, &torque, &GRAVITY).force.norm());
        }
        assert!(off > 5.0, "{name}: {off} N");
    }
}
