//! Releases a horizontal rod of five links with bending springs under gravity, and prints the height of its tip.

use orchard_geometry::{Mat3, Pose, Vec3, transform};
use orchard_multibody::{
    Body, ContactPath, Data, Integrator, JointKind, ModelBuilder, ModelError, Solver, SpatialInertia,
    StepReport, StepSettings, step,
};

const LINKS: usize = 5;
const LENGTH: f64 = 0.1; // of a link [m]
const MASS: f64 = 0.02; // of a link [kg]

fn main() -> Result<(), ModelError> {
    // A link is a thin rod along the x axis of its frame, with its joint at the origin.
    let across = MASS * LENGTH * LENGTH / 12.0; // about the centre of mass [kg m^2]
    let inertia = SpatialInertia {
        mass: MASS,
        p_com: Vec3::new(0.5 * LENGTH, 0.0, 0.0),
        i_com: Mat3::from_diagonal(&Vec3::new(0.0, across, across)),
    };
    // Each link hinges about the y axis at the tip of the one before; the first one at the world's origin.
    let mut builder = ModelBuilder::new();
    let mut bodies = Vec::new();
    for _ in 0..LINKS {
        let parent = bodies.last().copied();
        let x_joint = if parent.is_some() { LENGTH } else { 0.0 };
        bodies.push(builder.add_body(Body {
            parent,
            joint: JointKind::Hinge(Vec3::y_axis()),
            x_parent_joint: Pose::translation(x_joint, 0.0, 0.0),
            inertia,
        }));
    }
    let model = builder.build()?; // constant

    // State, and the inputs of the next step. Springs and dampers are implicit: no stiffness is too high for the step.
    let mut data = Data::new(&model);
    data.stiffness.fill(2.0); // [N m/rad]
    data.damping.fill(0.02); // [N m s/rad]

    let settings = StepSettings {
        h: 1.0 / 180.0,                       // [s]
        gravity: Vec3::new(0.0, 0.0, -9.81),  // world, z up [m/s^2]
        contact_dissipation_time: 0.01,       // [s]; nothing touches here
        contact_margin: 0.01,                 // [m]
        integrator: Integrator::default(),    // linearly implicit Euler
        solver: Solver::default(),            // articulated-body algorithm, O(n)
        contact_path: ContactPath::default(), // by the number of contacts
    };
    let mut report = StepReport::default();
    for tenth in 1..=10 {
        for _ in 0..18 {
            step(&model, &mut data, &settings, &mut report);
        }
        let tip = transform(data.x_world_body(bodies[LINKS - 1]), &Vec3::new(LENGTH, 0.0, 0.0));
        println!("{:.1} s: tip at z = {:.4} m", 0.1 * f64::from(tenth), tip.z);
    }
    Ok(())
}
