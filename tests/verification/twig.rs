//! The mass ratio of 10^4 to 1: a base of 130 kg against a twig of grams.

use super::fixture::branch;
use orchard_geometry::{Pose, Shape, Vec3, math};
use orchard_multibody::{
    Body, BodyId, Collider, Data, Groups, JointKind, ModelBuilder, Owner, SpatialInertia, StepReport, step,
};
use orchard_robot::RobotConfig;
use orchard_spec::Spec;
use orchard_treephys::{Rupture, TreeBody, TreeGroups, step_settings};

/// Mass of the base \[kg\].
const MASS: f64 = 130.0;
/// Half-extents of its chassis \[m\].
const HALF: Vec3 = Vec3::new(0.48, 0.40, 0.14);
/// Radius of the twig \[m\], and length and number of its segments.
const RADIUS: f64 = 0.0015;
const SEGMENT: f64 = 0.05;
const SEGMENTS: usize = 6;
/// Length and radius of the stump that bears it \[m\], and how far its root is beside the chassis' way \[m\].
const STUMP: (f64, f64) = (0.03, 0.02);
const BESIDE: f64 = 0.06;
/// Start of the chassis from the twig's root, and distance that it drives \[m\].
const START: f64 = 0.40;
const DRIVE: f64 = 0.80;

const WOOD: Groups = Groups { member: 1, filter: 2 };
const BASE: Groups = Groups { member: 2, filter: 1 };
const DEBRIS: Groups = Groups { member: 4, filter: 0 };

/// Drives the base past the root of a twig that stands at `angle` to the way of the base \[rad\]; gives the least
/// distance of live wood's axis from the chassis and the number of breaks. The root is a stump beside the chassis' way.
fn run_over(angle: f64) -> (f64, usize) {
    let spec = Spec::paper();
    let config = RobotConfig::paper();
    let base = config.drive.as_ref().unwrap();
    let (speed, damping) = (base.speed_max.si(), base.damping.si());
    let settings = step_settings(&spec.sim);
    let (sin, cos) = math::sin_cos(angle);
    let mut builder = ModelBuilder::new();
    let mut segments = vec![STUMP];
    segments.extend([(SEGMENT, RADIUS); SEGMENTS]);
    let mut skeleton = branch(Vec3::new(-cos, sin, 0.0), &segments);
    for segment in &mut skeleton.segments {
        segment.p_base_world += Vec3::new(0.0, -HALF.y - BESIDE, 0.0);
    }
    let tree =
        TreeBody::add_to(&mut builder, &skeleton, &spec.wood, TreeGroups { wood: WOOD, debris: DEBRIS });
    let cube = HALF.map(|x| 4.0 * x * x) * (MASS / 12.0);
    let base = builder.add_body(Body {
        parent: None,
        joint: JointKind::Slide(Vec3::x_axis()),
        x_parent_joint: Pose::translation(-START - HALF.x, 0.0, 0.0),
        inertia: SpatialInertia {
            mass: MASS,
            p_com: Vec3::zeros(),
            i_com: nalgebra::Matrix3::from_diagonal(&Vec3::new(
                cube.y + cube.z,
                cube.x + cube.z,
                cube.x + cube.y,
            )),
        },
    });
    let chassis = builder.add_collider(Collider {
        owner: Owner::Body(base),
        shape: Shape::Box { half: HALF },
        x_owner_shape: Pose::identity(),
        groups: BASE,
        friction: config.surface.body_friction.si(),
        stiffness: config.surface.stiffness.si(),
    });
    let model = builder.build().unwrap();
    let mut data = Data::new(&model);
    tree.reset(&model, &mut data, &spec.wood);
    let mut rupture = Rupture::new(&tree);
    let drive = model.dofs(base).start;
    data.v[drive] = speed;
    data.damping[drive] = damping;
    data.torque[drive] = damping * speed;
    let mut report = StepReport::default();
    let (mut closest, mut breaks, mut touched) = (f64::INFINITY, 0, 0);
    let substeps = (DRIVE / speed / settings.h).ceil() as u32;
    for substep in 1..=substeps {
        rupture.begin_substep(&tree, &model, &mut data, &spec.wood, settings.h);
        step(&model, &mut data, &settings, &mut report);
        assert!(data.is_finite() && report.converged, "{angle} rad, substep {substep}");
        let wood = |id: BodyId| tree.bodies.iter().position(|&body| body == id);
        for contact in &report.contacts {
            assert_eq!(contact.b, chassis);
            let Owner::Body(body) = model.collider(contact.a).owner else { panic!("a body") };
            if wood(body).is_some_and(|segment| !rupture.is_debris(segment)) {
                closest = closest.min(contact.gap + RADIUS);
                touched += usize::from(contact.force_world != Vec3::zeros());
            }
        }
        if substep % spec.sim.substeps.get() == 0 {
            let broken = rupture.end_frame(&tree, &model, &mut data, &spec.wood, spec.sim.gravity.si());
            breaks += broken.len();
        }
    }
    assert!(touched > 0, "{angle} rad: never touched");
    let way = data.q[model.qs(base).start];
    assert!(way > 0.9 * DRIVE, "{angle} rad: a twig of grams stopped the base after {way} m");
    (closest, breaks)
}

/// At 1.1 m/s, whatever way the twig points, its axis stays out of the chassis to 1 mm in every substep, the base goes
/// on, and the twig bends or breaks. No armature and no contact left out. `-- --nocapture` prints the distances.
#[test]
fn a_heavy_base_runs_over_a_twig() {
    for degrees in [20.0_f64, 30.0, 45.0, 70.0, 90.0, 120.0, 150.0] {
        let (closest, breaks) = run_over(degrees.to_radians());
        println!("twig at {degrees} deg: axis outside by {:.2} mm or more, {breaks} breaks", 1e3 * closest);
        assert!(closest >= -0.001, "{degrees} deg: {closest} m, {breaks} breaks");
    }
}
