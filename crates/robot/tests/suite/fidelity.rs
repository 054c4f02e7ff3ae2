//! Dials of fidelity against closed forms: friction, armature, gravity error and payload of an arm.

use crate::bench::{Bench, GRAVITY, SUBSTEP, substeps};
use orchard_geometry::Vec3;
use orchard_robot::{
    Articulation, Command, Friction, JointVector, PAPER_TOML, PAPER_URDF, RobotConfig, RobotModel,
};

fn constant(value: f64, unit: &str) -> String {
    format!("{{ value = {value:?}, range = [-100.0, 100.0], unit = \"{unit}\", source = \"x\" }}")
}

/// Config of the paper's robot with more entries in the table `[arm]`.
fn config(entries: &str) -> Result<RobotConfig, orchard_quantity::ConfigError> {
    RobotConfig::from_toml("robot.toml", &PAPER_TOML.replace("\n[arm]\n", &format!("\n[arm]\n{entries}\n")))
}

fn robot(entries: &str) -> RobotModel {
    RobotModel::from_urdf(PAPER_URDF, &config(entries).unwrap()).unwrap()
}

/// Runs under a command, with a force on the tool that no servo knows \[N\].
fn run(bench: &mut Bench, command: &Command, force: Vec3, seconds: f64) {
    for _ in 0..substeps(seconds) {
        let (wrist, p) = (bench.handle.wrist(), bench.handle.x_world_tcp(&bench.data).translation.vector);
        bench.data.body_force_world[wrist.index()] = force;
        bench.data.body_torque_world[wrist.index()] = (p - bench.data.com_p_world(wrist)).cross(&force);
        bench.substep(command, &GRAVITY);
    }
}

/// Positions of the arm's joints \[rad\].
fn q(bench: &Bench) -> JointVector {
    bench.observe().arm_q.vector()
}

/// At rest the servo's spring bears the error: q - target = e tau_g(q) / k.
#[test]
fn a_gravity_error_lets_the_arm_sag_by_torque_over_stiffness() {
    for error in [0.1, -0.1] {
        let robot = robot(&format!("gravity_error = {}", constant(error, "1")));
        let arm = robot.kinematics();
        let mut bench = Bench::new(&robot);
        run(&mut bench, &robot.start_command(), Vec3::zeros(), 4.0);
        let (reached, stiffness) = (q(&bench), robot.config().arm.stiffness.si());
        let sag = arm.gravity_torque(&reached, &GRAVITY) * (error / stiffness);
        assert!(sag.amax() > 1e-4, "{sag}");
        let off = reached - arm.home() - sag;
        assert!(off.amax() < 1e-7, "{error}: {off}");
    }
}

/// A payload at the tool adds J^T m g to the torques that hold the arm, and the compensation knows it.
#[test]
fn a_payload_loads_the_joints_by_its_weight_and_is_compensated() {
    let (bare, loaded) = (RobotModel::paper(), robot(&format!("payload = {}", constant(2.0, "kg"))));
    assert!((loaded.mass() - bare.mass() - 2.0).abs() < 1e-9);
    let (without, with) = (bare.kinematics(), loaded.kinematics());
    let posture = with.posture_at(|| 0.4);
    let more = with.gravity_torque(&posture, &GRAVITY) - without.gravity_torque(&posture, &GRAVITY);
    let weight = with.jacobian(&posture).fixed_rows::<3>(3).transpose() * (-2.0 * GRAVITY);
    assert!((more - weight).amax() < 1e-9, "{more} {weight}");
    let mut bench = Bench::new(&loaded);
    run(&mut bench, &loaded.start_command(), Vec3::zeros(), 2.0);
    assert!((q(&bench) - with.home()).amax() < 1e-6);
}

/// A push on the tool below the joints' friction moves nothing, though the servos are soft; without friction they give way by J^T F / k.
#[test]
fn friction_bears_a_push_that_bends_an_arm_without_it() {
    let force = Vec3::new(0.0, 2.0, 0.0);
    let moved = |entries: &str| {
        let robot = robot(entries);
        let mut bench = Bench::new(&robot);
        run(&mut bench, &robot.start_command(), force, 2.0);
        (q(&bench) - robot.kinematics().home()).amax()
    };
    let list = |value: f64| vec![constant(value, "N m"); 7].join(", ");
    let free = moved("");
    let arm = RobotModel::paper();
    let arm = arm.kinematics();
    let torque = arm.jacobian(&arm.home()).fixed_rows::<3>(3).transpose() * force;
    assert!((free - torque.amax() / 1500.0).abs() < 0.02 * free, "{free} {}", torque.amax() / 1500.0);
    assert!(torque.amax() < 4.0, "{torque}");
    // It creeps at no more than 1e-4 rad/s.
    let held = moved(&format!("friction = [{}]", list(4.0)));
    assert!(held < 0.2 * free && held <= 2.0e-4, "{held} {free}");
}

/// The torque that is observed acts on the links: beyond friction and rotors it is what the links' inertia takes.
#[test]
fn an_arm_with_rotors_and_friction_follows_and_its_torques_are_those_of_the_links() {
    let list = |value: f64, unit: &str| vec![constant(value, unit); 7].join(", ");
    let entries = format!(
        "armature = [{}]\nfriction = [{}]\nviscous_friction = [{}]",
        list(0.5, "kg m2"),
        list(0.4, "N m"),
        list(1.0, "N m s/rad")
    );
    let robot = robot(&entries);
    let arm = robot.kinematics();
    let mut bench = Bench::new(&robot);
    let mut command = robot.start_command();
    command.arm_q[0] += 0.4;
    command.arm_q[3] -= 0.3;
    run(&mut bench, &command, Vec3::zeros(), 0.15);
    let before = bench.observe();
    run(&mut bench, &command, Vec3::zeros(), SUBSTEP);
    let after = bench.observe();
    let a = (after.arm_v.vector() - before.arm_v.vector()) / SUBSTEP;
    let reached = after.arm_q.vector();
    let links = arm.gravity_torque(&reached, &GRAVITY) + arm.inertial_torque(&reached, &a);
    let off = after.arm_torque.vector() - links;
    // The base gives way under the arm and velocity products are left out: below the 0.5 kg m2 of the rotors by a factor of 5.
    assert!(off.amax() < 0.1 * a.amax().max(1.0), "{off} {a}");
    run(&mut bench, &command, Vec3::zeros(), 3.0);
    // Friction keeps it from the last of the way, F / k.
    let left = (q(&bench) - command.arm_q.vector()).amax();
    assert!(left < 0.4 / 1500.0 + 1e-4, "{left}");
}

#[test]
fn entries_out_of_range_are_refused_by_name() {
    let refused = |entries: &str| config(entries).unwrap_err().to_string();
    let list = |value: f64, n: usize| vec![constant(value, "N m"); n].join(", ");
    let e = refused(&format!("friction = [{}]", list(1.0, 6)));
    assert!(e.contains("arm.friction") && e.contains("6 values for 7 arm joints"), "{e}");
    let e = refused(&format!("armature = [{}]", list(-1.0, 7)));
    assert!(e.contains("arm.armature[0]") && e.contains("within 0"), "{e}");
    let e = refused(&format!("gravity_error = {}", constant(1.5, "1")));
    assert!(e.contains("arm.gravity_error") && e.contains("within -1 and 1"), "{e}");
    let e = refused(&format!("payload = {}", constant(-0.1, "kg")));
    assert!(e.contains("arm.payload"), "{e}");
}

/// Friction of a URDF is that of the joint; numbers that no joint has are refused.
#[test]
fn dynamics_of_a_description_are_read() {
    let text = |dynamics: &str| {
        format!(
            "<robot name='r'><link name='a'/><link name='b'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' \
             izz='1'/></inertial></link><joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/>\
             <limit lower='-1' upper='1' effort='5' velocity='2'/>{dynamics}</joint></robot>"
        )
    };
    let friction = |dynamics: &str| Articulation::from_urdf(&text(dynamics)).map(|a| a.links[0].friction);
    assert_eq!(friction("").unwrap(), Friction::default());
    let given = friction("<dynamics damping='0.5' friction='2'/>").unwrap();
    assert_eq!(given, Friction { coulomb: 2.0, viscous: 0.5 });
    assert_eq!(friction("<dynamics friction='2'/>").unwrap(), Friction { coulomb: 2.0, viscous: 0.0 });
    for bad in ["damping='-1'", "friction='nan'", "friction='1e300'"] {
        let e = friction(&format!("<dynamics {bad}/>")).unwrap_err().to_string();
        assert!(e.contains("joint `j`"), "{e}");
    }
}
