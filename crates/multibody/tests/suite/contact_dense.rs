//! Contact and coupling impulses against the dense system: what the solver predicts is what the world does.

use super::common;

use common::*;
use nalgebra::{DMatrix, DVector};
use orchard_geometry::{Pose, Shape, Vec3};
use orchard_multibody::*;

const H: f64 = 1.0 / 180.0;
const COUPLING: Coupling = Coupling { dof_a: 2, dof_b: 3, ratio: 0.7, stiffness: 2e3, damping: 5.0 };

/// A random tree whose links and points are balls that touch each other and the ground.
fn tangle(seed: u64) -> (Model, Data) {
    let links = 10;
    let mut builder = random_builder(seed, links);
    let all = Groups { member: 1, filter: 1 };
    let mut add = |owner, radius, friction| {
        let shape = Shape::Sphere { radius };
        let x_owner_shape = Pose::identity();
        let collider = Collider { owner, shape, x_owner_shape, groups: all, friction, stiffness: 1e5 };
        builder.add_collider(collider);
    };
    for link in 0..links as u32 {
        add(Owner::Body(BodyId(link)), 0.2, 0.6);
    }
    for point in 0..links.div_ceil(3) as u32 {
        add(Owner::Point(PointId(point)), 0.1, 0.3);
    }
    builder.add_collider(Collider {
        owner: Owner::World,
        shape: Shape::HalfSpace,
        x_owner_shape: Pose::identity(),
        groups: all,
        friction: 0.8,
        stiffness: 1e5,
    });
    builder.add_coupling(COUPLING);
    let model = builder.build().unwrap();
    let data = random_data(&model, seed + 50);
    (model, data)
}

/// Maps the system's velocities to the velocity of an owner at a point.
fn velocity_rows(model: &Model, data: &Data, owner: Owner, p_world: &Vec3) -> DMatrix<f64> {
    let mut rows = DMatrix::zeros(3, model.nv() + 3 * model.points().len());
    match owner {
        Owner::World => {}
        Owner::Point(id) => {
            for k in 0..3 {
                rows[(k, model.nv() + 3 * id.index() + k)] = 1.0;
            }
        }
        Owner::Body(id) => {
            let jacobian = geometric_jacobian(model, data, id, p_world);
            rows.view_mut((0, 0), (3, model.nv())).copy_from(&jacobian.rows(3, 3));
        }
    }
    rows
}

fn velocities(model: &Model, data: &Data) -> DVector<f64> {
    let points = data.point_v_world.iter().flat_map(|v| v.iter().copied());
    DVector::from_iterator(model.nv() + 3 * model.points().len(), data.v.iter().copied().chain(points))
}

#[test]
fn contact_forces_explain_the_motion_and_obey_the_law() {
    let mut total = 0;
    for seed in 0..8 {
        let (model, mut data) = tangle(seed);
        let start = data.clone();
        let settings = settings(H, GRAVITY);
        let mut report = StepReport::default();
        step(&model, &mut data, &settings, &mut report);
        assert!(report.converged, "seed {seed}: {} {:e}", report.newton_iterations, report.residual);
        total += report.contacts.len();

        // Newton's second law: A dv = rhs + J^T p.
        let (matrix, mut rhs) = dense_system(&model, &start, H, &GRAVITY);
        let rows: Vec<DMatrix<f64>> = report
            .contacts
            .iter()
            .map(|c| {
                let of = |id| velocity_rows(&model, &start, model.collider(id).owner, &c.p_world);
                of(c.a) - of(c.b)
            })
            .collect();
        for (contact, rows) in report.contacts.iter().zip(&rows) {
            rhs += rows.transpose() * contact.force_world * H;
        }
        // The coupling, straight from its law over the step.
        let offset = start.q[coupling_q(&model, COUPLING.dof_a)]
            - COUPLING.ratio * start.q[coupling_q(&model, COUPLING.dof_b)];
        let rate = data.v[COUPLING.dof_a] - COUPLING.ratio * data.v[COUPLING.dof_b];
        let force = -COUPLING.stiffness * (offset + H * rate) - COUPLING.damping * rate;
        rhs[COUPLING.dof_a] += H * force;
        rhs[COUPLING.dof_b] -= H * force * COUPLING.ratio;
        let expected = matrix.cholesky().expect("positive definite").solve(&rhs);
        let got = velocities(&model, &data) - velocities(&model, &start);
        let error = (&got - &expected).norm() / expected.norm();
        assert!(error < 1e-7, "seed {seed}: {error:e}");

        // The law at the velocity after the step.
        for (contact, rows) in report.contacts.iter().zip(&rows) {
            let v = rows * velocities(&model, &data);
            let v = Vec3::new(v[0], v[1], v[2]);
            let (v_n, f_n) = (v.dot(&contact.n_world), contact.force_world.dot(&contact.n_world));
            let f_t = contact.force_world - contact.n_world * f_n;
            let v_t = v - contact.n_world * v_n;
            let friction = (model.collider(contact.a).friction * model.collider(contact.b).friction).sqrt();
            assert!(f_n >= 0.0);
            assert!(f_t.norm() <= friction * f_n * (1.0 + 1e-9) + 1e-9);
            let is_sliding = f_t.norm() > 0.999 * friction * f_n;
            // Friction opposes slip; a cone that widens the gap at the slip speed is the convex model's own.
            assert!(f_t.dot(&v_t) <= 1e-9);
            let time = if contact.gap > 0.0 { H } else { H + settings.contact_dissipation_time };
            let glide = if is_sliding { friction * v_t.norm() } else { 0.0 };
            let overlap = -(contact.gap + time * (v_n - glide));
            let [k_a, k_b] = [contact.a, contact.b].map(|id| model.collider(id).stiffness);
            let law = k_a * k_b / (k_a + k_b) * overlap.max(0.0);
            // The tangential regularisation softens a sliding contact by friction^2 times its share.
            assert!(f_n <= law * (1.0 + 1e-6) + 1e-6, "seed {seed}: {f_n} over {law}");
            if f_n > 1.0 && !is_sliding {
                assert!(f_n > 0.9 * law, "seed {seed}: {f_n} for {law}");
            }
        }
    }
    assert!(total > 40, "{total} contacts");
}

/// Index into q of a degree of freedom of the tangle's first joints, none of them free.
fn coupling_q(model: &Model, dof: usize) -> usize {
    let body = model.body_of_dof(dof);
    model.qs(body).start + dof - model.dofs(body).start
}
