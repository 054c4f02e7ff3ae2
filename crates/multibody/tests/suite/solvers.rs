//! All solvers and both contact paths give the same step.

use super::canopy;
use super::common;

use common::*;
use orchard_geometry::{Mat3, Pose, Shape, Vec3, math};
use orchard_multibody::*;
use orchard_spec::Stream;

const H: f64 = 1.0 / 180.0;
const WORLDS: u64 = 50;
/// Contacts of a world.
const MOST_CONTACTS: usize = 20;
const HEAVY: f64 = 130.0;

type Way = (Solver, ContactPath);

/// Every solver, and both contact paths with more than one of them.
const WAYS: [Way; 6] = [
    (Solver::Aba, ContactPath::Delassus),
    (Solver::Aba, ContactPath::MatrixFree),
    (Solver::Cg { preconditioner: Preconditioner::ArticulatedBody }, ContactPath::MatrixFree),
    (Solver::Cg { preconditioner: Preconditioner::Jacobi }, ContactPath::Delassus),
    (Solver::Cg { preconditioner: Preconditioner::None }, ContactPath::MatrixFree),
    (Solver::Cholesky, ContactPath::ByRows),
];

/// Log-uniform.
fn decades(rng: &mut Stream, low: f64, high: f64) -> f64 {
    math::exp(rng.uniform(math::ln(low), math::ln(high)))
}

/// A tree of links that lighten to a ten-thousandth of the heavy base beside it, with points of every kind.
fn random_world(seed: u64) -> (Model, Data) {
    let mut rng = stream(1000 + seed);
    let links = 8 + (rng.unit() * 25.0) as u32;
    let all = Groups { member: 1, filter: 1 };
    let mut builder = ModelBuilder::new();
    let mut colliders = Vec::new();
    for index in 0..links {
        let parent = (index > 0).then(|| BodyId((rng.unit() * f64::from(index)) as u32));
        let kind = if index % 2 == 0 { 0 } else { index as usize };
        let mut inertia = random_inertia(&mut rng);
        let scale = decades(&mut rng, 0.01, 1.0) / inertia.mass;
        inertia.mass *= scale;
        inertia.i_com *= scale;
        builder.add_body(Body {
            parent,
            joint: random_joint(&mut rng, kind),
            x_parent_joint: Pose::from_parts(random_vec(&mut rng, 0.3).into(), random_rotation(&mut rng)),
            inertia,
        });
        // Several balls on one link: more rows than the link can tell apart.
        for _ in 0..if index % 5 == 0 { 3 } else { 1 } {
            let p_body = random_vec(&mut rng, 0.1);
            colliders.push((Owner::Body(BodyId(index)), Shape::Sphere { radius: 0.06 }, p_body));
        }
        if index % 3 == 0 {
            let cap = if rng.unit() < 0.3 { 0.5 } else { f64::INFINITY };
            let point = builder.add_point(PointBody {
                mass: rng.uniform(0.05, 0.3),
                spin_inertia: if rng.unit() < 0.5 { 1e-4 } else { f64::INFINITY },
                tether: (rng.unit() < 0.8).then(|| Tether {
                    body: BodyId(index),
                    p_body: random_vec(&mut rng, 0.2),
                    offset_world: Vec3::new(0.0, 0.0, -0.05),
                    stiffness: decades(&mut rng, 10.0, 1e4),
                    damping: rng.uniform(0.0, 3.0),
                    anchor_bias_world: random_vec(&mut rng, 1.0),
                    reaction_cap: cap,
                    turns: cap.is_infinite() && index % 2 == 0,
                }),
            });
            colliders.push((Owner::Point(point), Shape::Sphere { radius: 0.05 }, Vec3::zeros()));
        }
    }
    let base = builder.add_body(Body {
        parent: None,
        joint: JointKind::Planar,
        x_parent_joint: Pose::identity(),
        inertia: SpatialInertia { mass: HEAVY, p_com: Vec3::zeros(), i_com: Mat3::identity() * 8.0 },
    });
    colliders.push((Owner::Body(base), Shape::Box { half: Vec3::new(0.3, 0.3, 0.1) }, Vec3::zeros()));
    colliders.push((Owner::World, Shape::HalfSpace, Vec3::new(0.0, 0.0, -0.1)));
    for (owner, shape, p) in colliders {
        let x_owner_shape = Pose::translation(p.x, p.y, p.z);
        let friction = rng.uniform(0.0, 1.2);
        builder.add_collider(Collider { owner, shape, x_owner_shape, groups: all, friction, stiffness: 1e5 });
    }
    builder.add_coupling(Coupling { dof_a: 0, dof_b: 1, ratio: 0.7, stiffness: 2e3, damping: 5.0 });
    let model = builder.build().expect("a valid world");

    let mut data = Data::new(&model);
    let speed = decades(&mut rng, 0.01, 3.0);
    for id in model.body_ids() {
        let turns = model.body(id).joint.has_quaternion();
        for (dof, q) in model.dofs(id).zip(model.qs(id)) {
            data.q[q] = if turns { data.q[q] } else { rng.uniform(-1.0, 1.0) };
            data.v[dof] = rng.uniform(-speed, speed);
            let is_broken = rng.unit() < 0.2;
            data.stiffness[dof] = if is_broken { 0.0 } else { decades(&mut rng, 1e-2, 1e5) };
            data.damping[dof] = if is_broken { 0.0 } else { decades(&mut rng, 1e-4, 1e2) };
            data.rest[dof] = data.q[q] + rng.uniform(-0.05, 0.05);
        }
        data.linear_drag[id.index()] = rng.uniform(0.0, 1.0);
        data.angular_drag[id.index()] = rng.uniform(0.0, 1.0);
    }
    data.stiffness[model.dofs(base)].fill(0.0);
    data.q[model.qs(base)].fill(0.0);
    forward_kinematics(&model, &mut data);
    for (index, point) in model.points().iter().enumerate() {
        let hang = data.hang_p_world(&model, PointId(index as u32));
        data.point_p_world[index] = hang.unwrap_or_else(Vec3::zeros) + random_vec(&mut rng, 0.02);
        data.point_v_world[index] = random_vec(&mut rng, speed);
        data.point_quadratic_drag[index] = rng.uniform(0.0, 0.01);
        data.point_spin_damping[index] = 1.0;
        data.tethered[index] = point.tether.is_some() && rng.unit() < 0.7;
        data.point_carried[index] = !data.tethered[index] && rng.unit() < 0.2;
    }
    thin_out(&model, &mut data);
    (model, data)
}

/// Takes colliders away until no more contacts are left than wanted.
fn thin_out(model: &Model, data: &mut Data) {
    let mut report = StepReport::default();
    for last in 0..model.colliders().len() {
        step(model, &mut data.clone(), &of((Solver::Aba, ContactPath::Delassus)), &mut report);
        if report.contacts.len() <= MOST_CONTACTS {
            return;
        }
        data.groups[last] = Groups::NONE;
    }
}

fn of((solver, contact_path): Way) -> StepSettings {
    StepSettings { solver, contact_path, ..settings(H, GRAVITY) }
}

/// All velocities.
fn velocities(data: &Data) -> Vec<f64> {
    let points = data.point_v_world.iter().chain(&data.point_w_world).flat_map(|v| v.iter().copied());
    data.v.iter().copied().chain(points).collect()
}

fn norm(x: impl Iterator<Item = f64>) -> f64 {
    x.map(|x| x * x).sum::<f64>().sqrt()
}

/// Norm of the difference.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    norm(a.iter().zip(b).map(|(a, b)| a - b))
}

/// Steps a world by every way and holds the velocities against those of the first.
fn compare(model: &Model, data: &Data, integrator: Integrator, mut check: impl FnMut(Way, &StepReport)) {
    let start = velocities(data);
    let mut expected = None;
    for way in WAYS {
        let (mut stepped, mut report) = (data.clone(), StepReport::default());
        step(model, &mut stepped, &StepSettings { integrator, ..of(way) }, &mut report);
        assert!(report.converged && report.residual <= 1e-10, "{way:?}: {:e}", report.residual);
        for solve in [report.free, report.response] {
            assert!(solve.converged && solve.residual <= 1e-12, "{way:?}: {solve:?}");
        }
        let end = velocities(&stepped);
        let expected = expected.get_or_insert(end.clone());
        let relative = apart(&end, expected) / apart(expected, &start);
        // The residual, at most 1e-12, times the condition number of what is left to the solver.
        let plain = way.0 == Solver::Cg { preconditioner: Preconditioner::None };
        assert!(relative < if plain { 1e-7 } else { 1e-8 }, "{way:?}: {relative:e}");
        check(way, &report);
    }
}

/// One step: contacts strike, stick and slide, more on one link than it has degrees of freedom.
#[test]
fn fifty_worlds_step_alike() {
    let (mut contacts, mut sticking, mut sliding) = (0, 0, 0);
    for seed in 0..WORLDS {
        let (model, data) = random_world(seed);
        let unknowns = model.nv() + 3 * model.points().len();
        compare(&model, &data, Integrator::LinearlyImplicitEuler, |(solver, path), report| {
            let most = match solver {
                Solver::Aba | Solver::Cholesky => 0,
                Solver::Cg { preconditioner: Preconditioner::ArticulatedBody } => 1,
                // In exact arithmetic one for each unknown; round-off repeats some.
                Solver::Cg { preconditioner: Preconditioner::Jacobi } => 2 * unknowns,
                Solver::Cg { preconditioner: Preconditioner::None } => 8 * unknowns,
            };
            for solve in [report.free, report.response] {
                assert!(solve.iterations <= most, "{seed} {solver:?}: {solve:?} of {unknowns} unknowns");
            }
            assert!((1..60).contains(&report.newton_iterations), "{seed}: {}", report.newton_iterations);
            assert_eq!(report.cg_iterations > 0, path == ContactPath::MatrixFree);
            if solver == Solver::Cholesky {
                contacts += report.contacts.len();
                for contact in &report.contacts {
                    let [mu_a, mu_b] = [contact.a, contact.b].map(|id| model.collider(id).friction);
                    let along = contact.force_world.dot(&contact.n_world);
                    let across = (contact.force_world - contact.n_world * along).norm();
                    let is_at_edge = across > (1.0 - 1e-9) * (mu_a * mu_b).sqrt() * along;
                    sliding += usize::from(along > 0.0 && is_at_edge);
                    sticking += usize::from(along > 0.0 && !is_at_edge);
                }
            }
        });
    }
    assert!(contacts > 900 && sliding > 100 && sticking > 100, "{contacts} {sliding} {sticking}");
}

#[test]
fn the_midpoint_rule_takes_any_solver() {
    for seed in 0..10 {
        let (model, data) = random_world(seed);
        compare(&model, &data, Integrator::ImplicitMidpoint, |_, _| {});
    }
}

/// A base is driven into a canopy, each way from its own first guesses: differences stay small while contacts come
/// and go.
#[test]
fn a_canopy_gives_way_alike() {
    let (model, data) = canopy::canopy(61, 0.8);
    let start = velocities(&data);
    let mut most = 0;
    let ends = WAYS.map(|way| {
        let (mut stepped, mut report) = (data.clone(), StepReport::default());
        for _ in 0..60 {
            step(&model, &mut stepped, &of(way), &mut report);
            assert!(report.converged, "{way:?}: {:e}", report.residual);
            most = most.max(report.contacts.len());
        }
        velocities(&stepped)
    });
    assert!(most > 5, "{most}");
    for (end, way) in ends.iter().zip(WAYS) {
        let relative = apart(end, &ends[0]) / apart(&ends[0], &start);
        eprintln!("REL {way:?} {relative:e}");
        assert!(relative < 1e-6, "{way:?}: {relative:e}");
    }
}
