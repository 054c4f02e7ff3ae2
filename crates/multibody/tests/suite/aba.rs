//! The O(n) solve against a dense Cholesky solve, and the algorithms against each other.

use super::common;

use common::*;
use nalgebra::DVector;
use orchard_geometry::Vec3;
use orchard_multibody::*;

#[test]
fn a_step_equals_the_dense_solve() {
    for seed in 0..12 {
        let model = random_tree(seed, 5 + 2 * seed as usize);
        let mut data = random_data(&model, 100 + seed);
        // No link turns by the tenth of a radian from which velocity products are replaced (`spin.rs`).
        let h = [0.001, 1.0 / 180.0, 0.02][seed as usize % 3];
        let (matrix, rhs) = dense_system(&model, &data, h, &GRAVITY);
        let expected = matrix.cholesky().expect("positive definite").solve(&rhs);
        let before = data.clone();
        step(&model, &mut data, &settings(h, GRAVITY), &mut StepReport::default());
        let mut got = DVector::zeros(expected.len());
        for dof in 0..model.nv() {
            got[dof] = data.v[dof] - before.v[dof];
        }
        for index in 0..model.points().len() {
            let dv = data.point_v_world[index] - before.point_v_world[index];
            got.rows_mut(model.nv() + 3 * index, 3).copy_from(&dv);
        }
        // The judge takes its bias accelerations from differences: round-off 1e-16 over 2e-5 gives 1e-11.
        let error = (&got - &expected).norm() / expected.norm();
        assert!(error < 1e-9, "seed {seed}: relative error {error:e}");
    }
}

#[test]
fn inverse_dynamics_agrees_with_the_mass_matrix_and_its_own_gravity_part() {
    for seed in 0..6 {
        let model = random_tree(seed, 14);
        let mut data = random_data(&model, 200 + seed);
        let mut rng = stream(300 + seed);
        let acceleration: Vec<f64> = (0..model.nv()).map(|_| rng.uniform(-1.0, 1.0)).collect();
        data.v.fill(0.0);
        forward_kinematics(&model, &mut data);
        let gravity_part = DVector::from_vec(gravity_torque(&model, &data, &GRAVITY));
        let at_rest = DVector::from_vec(inverse_dynamics(&model, &data, &acceleration, &GRAVITY));
        let mass = mass_matrix(&model, &data, |_| (1.0, 1.0));
        let expected = mass * DVector::from_column_slice(&acceleration) + gravity_part;
        assert!((at_rest - &expected).norm() < 1e-11 * expected.norm());
    }
}

#[test]
fn a_step_under_inverse_dynamics_torque_gives_the_asked_acceleration() {
    for seed in 0..6 {
        let model = random_tree(seed, 14);
        let mut data = random_data(&model, 400 + seed);
        let mut rng = stream(500 + seed);
        let acceleration: Vec<f64> = (0..model.nv()).map(|_| rng.uniform(-1.0, 1.0)).collect();
        data.torque = inverse_dynamics(&model, &data, &acceleration, &GRAVITY);
        data.stiffness.fill(0.0);
        data.damping.fill(0.0);
        data.linear_drag.fill(0.0);
        data.angular_drag.fill(0.0);
        data.body_force_world.fill(Vec3::zeros());
        data.body_torque_world.fill(Vec3::zeros());
        data.tethered.fill(false);
        let before = data.v.clone();
        let h = 1e-3;
        step(&model, &mut data, &settings(h, GRAVITY), &mut StepReport::default());
        for dof in 0..model.nv() {
            let got = (data.v[dof] - before[dof]) / h;
            assert!((got - acceleration[dof]).abs() < 1e-9, "{got} {}", acceleration[dof]);
        }
    }
}

#[test]
fn jacobian_times_v_is_the_point_velocity() {
    let model = random_tree(3, 20);
    let data = random_data(&model, 4);
    for id in model.body_ids() {
        let p_world = data.com_p_world(id) + Vec3::new(0.1, -0.2, 0.3);
        let twist = geometric_jacobian(&model, &data, id, &p_world) * DVector::from_column_slice(&data.v);
        assert!((twist.fixed_rows::<3>(0) - data.velocity(id).angular).norm() < 1e-12);
        assert!((twist.fixed_rows::<3>(3) - data.point_velocity_world(id, &p_world)).norm() < 1e-12);
    }
}

#[test]
fn the_factor_serves_many_right_hand_sides() {
    let model = random_tree(7, 16);
    let mut data = random_data(&model, 8);
    let h = 0.004;
    aba::factor(&model, &mut data, h);
    let (matrix, _) = dense_system(&model, &data, h, &GRAVITY);
    let cholesky = matrix.cholesky().expect("positive definite");
    let mut rng = stream(9);
    let (mut impulse, mut change) = (aba::Impulse::new(&model), aba::Change::new(&model));
    for _ in 0..4 {
        impulse.clear();
        let rhs = DVector::from_fn(model.nv() + 3 * model.points().len(), |_, _| rng.uniform(-1.0, 1.0));
        impulse.dof.copy_from_slice(&rhs.as_slice()[..model.nv()]);
        for (index, point) in impulse.point.iter_mut().enumerate() {
            *point = rhs.fixed_rows::<3>(model.nv() + 3 * index).into_owned();
        }
        aba::solve(&model, &data, &mut impulse, &mut change);
        let expected = cholesky.solve(&rhs);
        let joints = DVector::from_column_slice(&change.dof) - expected.rows(0, model.nv());
        assert!(joints.norm() < 1e-10 * expected.norm());
        for (index, point) in change.point.iter().enumerate() {
            assert!(
                (point - expected.fixed_rows::<3>(model.nv() + 3 * index)).norm() < 1e-10 * expected.norm()
            );
        }
    }
}
