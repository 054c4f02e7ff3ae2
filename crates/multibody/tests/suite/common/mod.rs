//! Random worlds and the dense judge: an assembly of the same system from geometric Jacobians.
#![allow(dead_code)] // each test file uses a part of it

use nalgebra::{DMatrix, DVector, Matrix6xX, Unit};
use orchard_geometry::{Mat3, Pose, Rotation, Vec3};
use orchard_multibody::*;
use orchard_spec::{Purpose, Stream};

pub mod touching;

pub const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.81);

pub fn stream(seed: u64) -> Stream {
    Stream::new(seed, 0, Purpose::Test)
}

pub fn random_vec(rng: &mut Stream, size: f64) -> Vec3 {
    Vec3::from_fn(|_, _| rng.uniform(-size, size))
}

pub fn random_rotation(rng: &mut Stream) -> Rotation {
    Rotation::from_scaled_axis(random_vec(rng, 2.0))
}

pub fn random_inertia(rng: &mut Stream) -> SpatialInertia {
    let turn = random_rotation(rng).to_rotation_matrix();
    // Any three positive second moments make a physical inertia: I = tr(S) 1 - S.
    let moments = Vec3::from_fn(|_, _| rng.uniform(0.001, 0.01));
    let principal = Mat3::from_diagonal(&(Vec3::repeat(moments.sum()) - moments));
    let i_com = turn.matrix() * principal * turn.matrix().transpose();
    SpatialInertia {
        mass: rng.uniform(0.2, 2.0),
        p_com: random_vec(rng, 0.2),
        i_com: (i_com + i_com.transpose()) * 0.5,
    }
}

pub fn random_joint(rng: &mut Stream, kind: usize) -> JointKind {
    let axis = Unit::new_normalize(random_vec(rng, 1.0) + Vec3::new(0.1, 0.0, 0.0));
    match kind % 7 {
        0 => JointKind::Universal,
        1 => JointKind::Hinge(axis),
        2 => JointKind::Slide(axis),
        3 => JointKind::Planar,
        4 => JointKind::Free,
        5 => JointKind::Ball,
        _ => JointKind::Weld,
    }
}

/// A random tree with every joint kind in turn, and a tethered point on every third link.
pub fn random_tree(seed: u64, links: usize) -> Model {
    random_builder(seed, links).build().expect("a valid tree")
}

/// The parts of [`random_tree`].
pub fn random_builder(seed: u64, links: usize) -> ModelBuilder {
    let mut rng = stream(seed);
    let mut builder = ModelBuilder::new();
    for index in 0..links {
        let parent = (index > 0).then(|| BodyId((rng.unit() * index as f64) as u32));
        builder.add_body(Body {
            parent,
            joint: random_joint(&mut rng, index),
            x_parent_joint: Pose::from_parts(random_vec(&mut rng, 0.3).into(), random_rotation(&mut rng)),
            inertia: random_inertia(&mut rng),
        });
        if index % 3 == 0 {
            builder.add_point(PointBody {
                mass: rng.uniform(0.05, 0.3),
                spin_inertia: f64::INFINITY,
                tether: Some(Tether {
                    body: BodyId(index as u32),
                    p_body: random_vec(&mut rng, 0.2),
                    offset_world: Vec3::new(0.0, 0.0, -0.05),
                    stiffness: rng.uniform(100.0, 500.0),
                    damping: rng.uniform(0.0, 3.0),
                    anchor_bias_world: random_vec(&mut rng, 1.0),
                    reaction_cap: f64::INFINITY,
                    turns: false,
                }),
            });
        }
    }
    builder
}

/// A random state with random inputs.
pub fn random_data(model: &Model, seed: u64) -> Data {
    let mut rng = stream(seed);
    let mut data = Data::new(model);
    for id in model.body_ids() {
        if model.body(id).joint.has_quaternion() {
            let (translations, end) = (model.body(id).joint.translations(), model.qs(id).end);
            let p = random_vec(&mut rng, 0.5);
            data.q[end - 4 - translations..end - 4].copy_from_slice(&p.as_slice()[..translations]);
            data.q[end - 4..end].copy_from_slice(random_rotation(&mut rng).coords.as_slice());
        } else {
            data.q[model.qs(id)].iter_mut().for_each(|q| *q = rng.uniform(-1.0, 1.0));
        }
        for dof in model.dofs(id) {
            data.v[dof] = rng.uniform(-1.0, 1.0);
            data.stiffness[dof] = rng.uniform(0.0, 50.0);
            data.damping[dof] = rng.uniform(0.0, 2.0);
            data.rest[dof] = rng.uniform(-0.5, 0.5);
            data.torque[dof] = rng.uniform(-5.0, 5.0);
        }
        data.linear_drag[id.index()] = rng.uniform(0.0, 1.0);
        data.angular_drag[id.index()] = rng.uniform(0.0, 1.0);
        data.body_force_world[id.index()] = random_vec(&mut rng, 3.0);
        data.body_torque_world[id.index()] = random_vec(&mut rng, 1.0);
    }
    forward_kinematics(model, &mut data);
    for index in 0..model.points().len() {
        let hang = data.hang_p_world(model, PointId(index as u32)).expect("tethered");
        data.point_p_world[index] = hang + random_vec(&mut rng, 0.02);
        data.point_v_world[index] = random_vec(&mut rng, 1.0);
        data.point_force_world[index] = random_vec(&mut rng, 2.0);
        data.point_quadratic_drag[index] = rng.uniform(0.0, 0.01);
        data.tethered[index] = index % 4 != 3;
    }
    data
}

/// Links' mass matrix from geometric Jacobians; `mass_scale(linear, angular)` by link index.
pub fn mass_matrix(model: &Model, data: &Data, mass_scale: impl Fn(usize) -> (f64, f64)) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(model.nv(), model.nv());
    for id in model.body_ids() {
        let inertia = &model.body(id).inertia;
        let jacobian = geometric_jacobian(model, data, id, &data.com_p_world(id));
        let turn = data.x_world_body(id).rotation.to_rotation_matrix();
        let i_com = turn.matrix() * inertia.i_com * turn.matrix().transpose();
        let (linear, angular) = mass_scale(id.index());
        let (jw, jv) = (jacobian.rows(0, 3), jacobian.rows(3, 3));
        matrix += jv.transpose() * jv * (inertia.mass * linear) + jw.transpose() * (i_com * angular) * jw;
    }
    matrix
}

/// Rate of change of a Jacobian times v, by central differences along the motion.
pub fn jacobian_rate_times_v(model: &Model, data: &Data, id: BodyId, p_body: &Vec3) -> (Vec3, Vec3) {
    let eps = 1e-5;
    let at = |time: f64| {
        let mut moved = data.clone();
        flow(model, &mut moved, time);
        forward_kinematics(model, &mut moved);
        let p_world = orchard_geometry::transform(moved.x_world_body(id), p_body);
        (moved.velocity(id).angular, moved.point_velocity_world(id, &p_world))
    };
    let ((w1, v1), (w0, v0)) = (at(eps), at(-eps));
    ((w1 - w0) / (2.0 * eps), (v1 - v0) / (2.0 * eps))
}

/// Torque of a ball joint's spring on one of its degrees of freedom: minus the slope of the energy.
fn spring_torque(model: &Model, data: &Data, id: BodyId, dof: usize) -> f64 {
    let energy_at = |angle: f64| {
        let mut turned = data.clone();
        turned.v.fill(0.0);
        turned.v[dof] = 1.0;
        flow(model, &mut turned, angle);
        let rod = turned.deflection(model, id).expect("a ball joint");
        let stiffness = &data.stiffness[model.dofs(id)];
        0.5 * (stiffness[0] * rod.bend.norm_squared() + stiffness[2] * rod.twist * rod.twist)
    };
    let step = 1e-5;
    (energy_at(-step) - energy_at(step)) / (2.0 * step)
}

/// Moves the coordinates along constant joint velocities.
pub fn flow(model: &Model, data: &mut Data, time: f64) {
    for id in model.body_ids() {
        let (q, v) = (model.qs(id).start, model.dofs(id).start);
        let joint = model.body(id).joint;
        let turns = joint.has_quaternion();
        for k in 0..if turns { joint.translations() } else { joint.nv() } {
            data.q[q + k] += time * data.v[v + k];
        }
        if turns {
            let (q, v) = (q + joint.translations(), v + joint.translations());
            let old = Rotation::from_quaternion(nalgebra::Quaternion::new(
                data.q[q + 3],
                data.q[q],
                data.q[q + 1],
                data.q[q + 2],
            ));
            let turn = Rotation::from_scaled_axis(Vec3::from_column_slice(&data.v[v..v + 3]) * time);
            // A ball's velocity is in the link's axes.
            let new = if joint == JointKind::Ball { old * turn } else { turn * old };
            data.q[q..q + 4].copy_from_slice(new.coords.as_slice());
        }
    }
}

/// Matrix and right-hand side of the step, assembled densely: joints first, then three entries a point.
pub fn dense_system(model: &Model, data: &Data, h: f64, gravity: &Vec3) -> (DMatrix<f64>, DVector<f64>) {
    let nv = model.nv();
    let size = nv + 3 * model.points().len();
    let mut matrix = DMatrix::zeros(size, size);
    let mut rhs = DVector::zeros(size);
    let scaled =
        mass_matrix(model, data, |i| (1.0 + h * data.linear_drag[i], 1.0 + h * data.angular_drag[i]));
    matrix.view_mut((0, 0), (nv, nv)).copy_from(&scaled);
    for id in model.body_ids() {
        let i = id.index();
        let body = model.body(id);
        let jacobian = geometric_jacobian(model, data, id, &data.com_p_world(id));
        let turn = data.x_world_body(id).rotation.to_rotation_matrix();
        let i_com = turn.matrix() * body.inertia.i_com * turn.matrix().transpose();
        let (alpha, acceleration) = jacobian_rate_times_v(model, data, id, &body.inertia.p_com);
        let omega = data.velocity(id).angular;
        let v_com = data.point_velocity_world(id, &data.com_p_world(id));
        let force = (gravity - acceleration - v_com * data.linear_drag[i]) * body.inertia.mass
            + data.body_force_world[i];
        let torque = data.body_torque_world[i]
            - i_com * alpha
            - omega.cross(&(i_com * omega))
            - i_com * omega * data.angular_drag[i];
        let wrench = jacobian.rows(0, 3).transpose() * torque + jacobian.rows(3, 3).transpose() * force;
        rhs.rows_mut(0, nv).axpy(h, &wrench, 1.0);
        for (k, dof) in model.dofs(id).enumerate() {
            let mut tau = data.torque[dof] - data.damping[dof] * data.v[dof];
            matrix[(dof, dof)] += h * data.damping[dof];
            if body.joint == JointKind::Ball {
                tau += spring_torque(model, data, id, dof) - h * data.stiffness[dof] * data.v[dof];
                matrix[(dof, dof)] += h * h * data.stiffness[dof];
            } else if body.joint != JointKind::Free {
                let stretch = data.q[model.qs(id).start + k] + h * data.v[dof] - data.rest[dof];
                tau -= data.stiffness[dof] * stretch;
                matrix[(dof, dof)] += h * h * data.stiffness[dof];
            }
            rhs[dof] += h * tau;
        }
    }
    for (index, point) in model.points().iter().enumerate() {
        let at = nv + 3 * index;
        let v = data.point_v_world[index];
        let drag = data.point_quadratic_drag[index] * v.norm();
        let force = gravity * point.mass + data.point_force_world[index] - v * drag;
        for k in 0..3 {
            matrix[(at + k, at + k)] += point.mass + h * drag;
            rhs[at + k] += h * force[k];
        }
        let Some(tether) = point.tether.as_ref().filter(|_| data.tethered[index]) else { continue };
        let id = PointId(index as u32);
        let anchor = data.anchor_p_world(model, id).expect("tethered");
        // Stretch rate = relative * (v, point velocities).
        let mut relative = DMatrix::zeros(3, size);
        relative
            .view_mut((0, 0), (3, nv))
            .copy_from(&(-linear_rows(&geometric_jacobian(model, data, tether.body, &anchor))));
        let bias = -relative.transpose() * tether.anchor_bias_world;
        relative.view_mut((0, at), (3, 3)).copy_from(&Mat3::identity());
        let stretch = data.point_p_world[index] - data.hang_p_world(model, id).expect("tethered");
        let rate = v - data.anchor_v_world(model, id).expect("tethered");
        let pull = -(stretch + rate * h) * tether.stiffness - rate * tether.damping;
        matrix += relative.transpose() * &relative * (h * (tether.damping + h * tether.stiffness));
        rhs += relative.transpose() * pull * h;
        rhs.rows_mut(0, nv).axpy(h, &bias.rows(0, nv), 1.0);
    }
    (matrix, rhs)
}

fn linear_rows(jacobian: &Matrix6xX<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(3, jacobian.ncols(), |row, column| jacobian[(3 + row, column)])
}

/// Settings for worlds with hardly any contact.
pub fn settings(h: f64, gravity: Vec3) -> StepSettings {
    StepSettings {
        h,
        gravity,
        contact_dissipation_time: 0.01,
        contact_margin: 0.01,
        integrator: Integrator::default(),
        solver: Solver::default(),
        contact_path: ContactPath::default(),
    }
}
