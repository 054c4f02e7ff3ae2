//! Grippers whose fingers turn: opening and force by kinematics, coupling by mimic joints, grip by contact and friction alone.

use crate::bench::{Bench, FINGERS_TOUCH, NO_GRAVITY, OTHER, SUBSTEP, substeps};
use orchard_geometry::{Pose, Vec3, math};
use orchard_multibody::{Body, BodyId, Collider, JointKind, Owner, SpatialInertia};
use orchard_robot::{
    Articulation, Command, Draft, Limits, NoMeshes, Observation, PAPER_TOML, RobotConfig, RobotModel,
};

fn husky() -> RobotModel {
    RobotModel::named("husky-ur5e-2f85").unwrap()
}

/// A robot whose fingers alone touch, with a ball of a fruit's mass at its tool point.
pub struct Grip {
    bench: Bench,
    ball: BodyId,
}

impl Grip {
    /// `aside` is the ball's offset along the fingers' direction \[m\].
    pub fn new(robot: &RobotModel, radius: f64, aside: f64) -> Self {
        let arm = robot.kinematics();
        let inertia = SpatialInertia {
            mass: 0.16,
            p_com: Vec3::zeros(),
            i_com: orchard_geometry::Mat3::identity() * 1e-4,
        };
        let x_parent_joint = arm.tcp(&arm.home()) * Pose::translation(0.0, aside, 0.0);
        let (bench, ball) = Bench::with(robot, &FINGERS_TOUCH, |builder| {
            let ball =
                builder.add_body(Body { parent: None, joint: JointKind::Free, x_parent_joint, inertia });
            builder.add_collider(Collider {
                owner: Owner::Body(ball),
                shape: orchard_geometry::Shape::Sphere { radius },
                x_owner_shape: Pose::identity(),
                groups: OTHER,
                friction: 1.0,
                stiffness: 1e5,
            });
            ball
        });
        Self { bench, ball }
    }

    pub fn run(&mut self, command: &Command, gravity: &Vec3, seconds: f64) -> Observation {
        for _ in 0..substeps(seconds) {
            self.bench.substep(command, gravity);
        }
        self.bench.observe()
    }

    /// Sum of the normal forces of each finger on the ball \[N\].
    fn squeeze(&self) -> [f64; 2] {
        let owner = |c| match self.bench.model.collider(c).owner {
            Owner::Body(body) => Some(body),
            _ => None,
        };
        std::array::from_fn(|side| {
            let finger = &self.bench.handle.fingers[side];
            let contacts = self.bench.report.contacts.iter();
            let on = contacts.filter(|c| {
                let ends = [owner(c.a), owner(c.b)];
                ends.contains(&Some(self.ball)) && ends.iter().flatten().any(|&body| finger.has(body))
            });
            on.map(|c| c.force_world.dot(&c.n_world).abs()).sum()
        })
    }

    /// Largest angle between the tips and the palm about the joints' axis \[rad\].
    fn tilt(&self) -> f64 {
        let palm = self.bench.data.x_world_body(self.bench.handle.wrist()).rotation;
        let tilt = |finger: &orchard_robot::Finger<BodyId>| {
            let tip = self.bench.data.x_world_body(finger.links.last().unwrap().on).rotation;
            let z: Vec3 = palm.inverse() * (tip * Vec3::z());
            math::atan2(math::hypot(z.x, z.y), z.z)
        };
        self.bench.handle.fingers.iter().map(tilt).fold(0.0, f64::max)
    }
}

/// Opening and lever of the four-bar finger against their closed form: the crank's end moves on a circle and the pad with it.
#[test]
fn the_opening_follows_the_crank() {
    let robot = husky();
    let grip = Grip::new(&robot, 0.03, 0.0);
    let (crank_y, crank_z) = (0.0376, 0.043);
    // Joint of the crank, its arm, and the face of the pad before the tip's joint.
    let gap = |q: f64| 0.030_601_1 + crank_y * math::cos(q) - crank_z * math::sin(q) - 0.022_02 - 0.003_175;
    let rate = |q: f64| -crank_y * math::sin(q) - crank_z * math::cos(q);
    for finger in &grip.bench.handle.fingers {
        assert_eq!(finger.links.len(), 2);
        for k in 0..=81 {
            let q = f64::from(k) * 0.01;
            assert!((finger.opening.at(q) - gap(q)).abs() < 1e-8, "{q}: {}", finger.opening.at(q));
            assert!((finger.opening.rate(q) - rate(q)).abs() < 1e-6, "{q}: {}", finger.opening.rate(q));
            assert!((finger.opening.joint(gap(q)) - q).abs() < 1e-6, "{q}");
        }
    }
    let arm = robot.kinematics();
    assert!((arm.finger_stroke() - gap(0.0)).abs() < 1e-8);
    // 235 N as published, on the longest lever; 75 mm/s on the shortest.
    assert!((arm.finger_force() - 235.0).abs() < 1.0, "{}", arm.finger_force());
    assert!((arm.finger_speed() - 0.075).abs() < 1e-12);
    // Wide open the pads stand apart by the published stroke, to a millimetre.
    assert!((2.0 * arm.finger_stroke() - 0.085).abs() < 1.1e-3);
}

/// The fingers hold a ball of any size with the force that is commanded at the pads, both with the same, and the pads stay parallel.
#[test]
fn hinged_fingers_press_with_the_commanded_force() {
    let robot = husky();
    for radius in [0.025, 0.035, 0.04] {
        // Off centre: the coupled fingers push it to the middle before they hold it.
        let mut grip = Grip::new(&robot, radius, 0.002);
        for force in [20.0, 70.0, 110.0] {
            let command = Command { finger_q: 0.0, finger_force: force, ..robot.start_command() };
            let seen = grip.run(&command, &NO_GRAVITY, 1.5);
            for (side, pressed) in grip.squeeze().into_iter().enumerate() {
                assert!((pressed - force).abs() < 0.03 * force, "{radius} m, {force} N: {pressed} N");
                assert!((seen.finger_force[side] + force).abs() < 0.02 * force, "{:?}", seen.finger_force);
                assert!((seen.finger_q[side] - radius).abs() < 4e-3, "{radius} m: {:?}", seen.finger_q);
            }
            assert!(grip.tilt() < 0.01, "{} rad at {force} N", grip.tilt());
        }
        let open = Command { finger_q: 0.0425, finger_force: 70.0, ..robot.start_command() };
        let seen = grip.run(&open, &NO_GRAVITY, 1.0);
        assert!(seen.finger_q.iter().all(|q| (q - 0.0425).abs() < 1e-3), "{:?}", seen.finger_q);
    }
}

/// The opening moves no faster than the gripper, and closes to nothing.
#[test]
fn hinged_fingers_close_at_the_published_speed() {
    let robot = husky();
    let mut grip = Grip::new(&robot, 0.001, 0.0);
    let command = Command { finger_q: 0.0, finger_force: 70.0, ..robot.start_command() };
    let mut last = grip.run(&command, &NO_GRAVITY, SUBSTEP).finger_q;
    for _ in 0..140 {
        let now = grip.run(&command, &NO_GRAVITY, SUBSTEP).finger_q;
        for (a, b) in last.iter().zip(now) {
            assert!((a - b).abs() <= 0.085 * SUBSTEP, "{} m/s", (a - b) / SUBSTEP);
        }
        last = now;
    }
    assert!(last.iter().all(|q| (-1e-3..3e-3).contains(q)), "{last:?}");
}

/// Friction holds the ball against gravity across the pads, and without friction nothing does.
#[test]
fn only_friction_holds_the_ball() {
    for (friction, stays) in [(1.0, true), (0.0, false)] {
        let robot = husky();
        let mut config = robot.config().clone();
        config.surface.finger_friction = config.surface.finger_friction.with_value(friction).unwrap();
        let robot = RobotModel::from_urdf(robot.urdf(), &config).unwrap();
        let mut grip = Grip::new(&robot, 0.033, 0.0);
        let command = Command { finger_q: 0.0, finger_force: 45.0, ..robot.start_command() };
        grip.run(&command, &NO_GRAVITY, 1.0);
        let before = grip.bench.data.x_world_body(grip.ball).translation.vector;
        // Down in the world is across the pads of a level hand.
        grip.run(&command, &Vec3::new(0.0, 0.0, -9.81), 1.0);
        let fallen = before.z - grip.bench.data.x_world_body(grip.ball).translation.vector.z;
        assert_eq!(fallen < 0.01, stays, "friction {friction}: {fallen} m");
    }
}

/// A public gripper as its authors describe it, on an arm of a stranger: six coupled hinges, of which one leads; names and order are odd, and the limits
/// of some followers are, too.
fn strangers_gripper() -> String {
    let link = |name: &str, mass: f64, inside: &str| {
        format!(
            "<link name='{name}'><inertial><mass value='{mass}'/><inertia ixx='1e-4' ixy='0' ixz='0' iyy='1e-4' iyz='0' izz='1e-4'/>\
             </inertial>{inside}</link>"
        )
    };
    let joint = |name: &str, ends: [&str; 2], xyz: &str, rpy: &str, axis: &str, rest: &str| {
        format!(
            "<joint name='{name}' type='revolute'><parent link='{}'/><child link='{}'/><origin xyz='{xyz}' rpy='{rpy}'/>\
             <axis xyz='{axis}'/>{rest}</joint>",
            ends[0], ends[1]
        )
    };
    let fixed = |name: &str, ends: [&str; 2], xyz: &str| {
        format!(
            "<joint name='{name}' type='fixed'><parent link='{}'/><child link='{}'/><origin xyz='{xyz}'/></joint>",
            ends[0], ends[1]
        )
    };
    let limit = "<limit lower='-2.5' upper='2.5' effort='60' velocity='3'/>";
    let boxed = |size: &str| format!("<collision><geometry><box size='{size}'/></geometry></collision>");
    let mut parts = Vec::new();
    let names = ["Sockel", "A", "B", "C", "D", "palm/7"];
    for (i, axis) in ["0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0"].into_iter().enumerate() {
        parts.push(joint(&format!("j{i}"), [names[i], names[i + 1]], "0 0 0.2", "0 0 0", axis, limit));
        parts.push(link(names[i], 2.0, &boxed("0.08 0.08 0.15")));
    }
    parts.push(link("palm/7", 0.6, &boxed("0.06 0.09 0.08")));
    parts.push(fixed("tool joint", ["palm/7", "tool0"], "0 0 0.13"));
    parts.push("<link name='tool0'/>".to_owned());
    let mimic = |ratio: i32| {
        format!(
            "<limit lower='0' upper='0.8757' effort='1000' velocity='2'/><mimic joint='leading one' multiplier='{ratio}' offset='0'/>"
        )
    };
    let led = "<limit lower='0' upper='0.8' effort='1000' velocity='2'/>";
    for (side, sign, turn) in [("r", 1.0, "0 0 0"), ("l", -1.0, "0 0 3.141592653589793")] {
        let name = |part: &str| format!("{part}-{side}");
        let at = |y: f64, z: f64| format!("0 {} {z}", sign * y);
        let (knuckle, outer, inner, tip, pad) =
            (name("knuckle"), name("outer"), name("inner"), name("tip"), name("pad"));
        let (drive, rest) = match side {
            "l" => ("leading one".to_owned(), led.to_owned()),
            _ => (name("z drive"), mimic(1).replace("0.8757", "0.8")),
        };
        parts.push(joint(&drive, ["palm/7", &knuckle], &at(0.030_601_1, 0.054_904), turn, "1 0 0", &rest));
        parts.push(fixed(&name("f"), [&knuckle, &outer], "0 0.0315 -0.0041"));
        parts.push(joint(&name("a bar"), ["palm/7", &inner], &at(0.0127, 0.06142), turn, "1 0 0", &mimic(1)));
        parts.push(joint(
            &name("tip joint"),
            [&outer, &tip],
            "0 0.0061 0.0471",
            "0 0 0",
            "1 0 0",
            &mimic(-1),
        ));
        parts.push(fixed(&name("p"), [&tip, &pad], "0 -0.0220203446692936 0.03242"));
        parts.push(link(&knuckle, 0.0085, &boxed("0.02 0.03 0.01")));
        parts.push(link(&outer, 0.0226, &boxed("0.02 0.01 0.05")));
        parts.push(link(&inner, 0.0271, &boxed("0.02 0.01 0.05")));
        parts.push(link(&tip, 0.0104, ""));
        parts.push(link(&pad, 0.01, &boxed("0.022 0.00635 0.0375")));
    }
    parts.reverse();
    format!("<robot name='stranger'>{}</robot>", parts.concat())
}

/// A mapping with the names that the draft guesses.
fn drafted(draft: &Draft, opening: f64) -> RobotConfig {
    let mut text = String::from("base = 'common'\n");
    for table in ["[arm]", "[finger]", "[camera]"] {
        let start = PAPER_TOML.find(&format!("\n{table}\n")).unwrap() + 1;
        let rest = &PAPER_TOML[start..];
        text += &rest[..rest[1..].find("\n\n").map_or(rest.len(), |end| end + 2)];
        text += "\n";
    }
    let m = |value: f64| format!("{{ value = {value:?}, range = [-9.0, 9.0], unit = 'm', source = 'test' }}");
    let list = |role: &str| format!("{:?}", draft.names(role));
    let one = |role: &str| format!("{:?}", draft.names(role)[0]);
    text += &format!(
        "[parts]\nbase_link = 'mount'\narm_joints = {}\nfinger_joints = {}\nhand_link = {}\ntcp_link = {}\n\
         bucket_link = 'bucket'\n[start]\nfinger_opening = {}\narm_home = [{}]\n[mount]\njoint = {{ kind = 'stands' }}\nheight = {}\n\
         [bucket]\nx = {}\ny = {}\nfloor = {}\nwidth = {}\ndepth = {}\nwall = {}\n",
        list("arm_joints"),
        list("finger_joints"),
        one("hand_link"),
        one("tcp_link"),
        m(opening),
        [0.0, 0.6, 0.8, 0.2, 0.3].map(|q| m(q).replace("'m'", "'rad'")).join(", "),
        m(0.4),
        m(-0.4),
        m(0.0),
        m(0.3),
        m(0.3),
        m(0.15),
        m(0.005),
    );
    RobotConfig::from_toml("drafted.toml", &text).unwrap()
}

#[test]
fn a_strangers_coupled_gripper_holds_with_the_draft() {
    let urdf = strangers_gripper();
    let loaded = Articulation::load(&urdf, &mut NoMeshes, &Limits::default()).unwrap();
    let draft = Draft::of(&loaded);
    assert_eq!(draft.names("arm_joints"), ["j0", "j1", "j2", "j3", "j4"]);
    let mut fingers = draft.names("finger_joints").to_vec();
    fingers.sort();
    assert_eq!(fingers, ["leading one", "z drive-r"]);
    assert_eq!(
        (draft.names("hand_link"), draft.names("tcp_link")),
        (&["palm/7".to_owned()][..], &["tool0".to_owned()][..])
    );
    let opening = draft.opening(&loaded.articulation).unwrap();
    assert!((opening - 0.043).abs() < 1e-4, "{opening}");
    let robot = RobotModel::from_urdf(&urdf, &drafted(&draft, 0.0425)).unwrap();
    // Five joints of the arm, three of each finger, and the mount; all couplings are kept.
    assert_eq!(robot.articulation().links.len(), 12);
    let followers = robot.articulation().links.iter().filter(|link| link.mimic.is_some()).count();
    assert_eq!(followers, 5);
    let mut grip = Grip::new(&robot, 0.033, 0.002);
    assert!(grip.bench.handle.fingers.iter().all(|finger| finger.links.len() == 3));
    let command = Command { finger_q: 0.0, finger_force: 60.0, ..robot.start_command() };
    let seen = grip.run(&command, &NO_GRAVITY, 1.5);
    for pressed in grip.squeeze() {
        assert!((pressed - 60.0).abs() < 3.0, "{pressed} N; {:?}", seen.finger_q);
    }
    let wide = grip.run(&robot.start_command(), &NO_GRAVITY, 1.0);
    assert!(wide.finger_q.iter().all(|q| (q - 0.0425).abs() < 1e-3), "{:?}", wide.finger_q);
}

/// A joint that cannot be a finger is refused with its name and the reason.
#[test]
fn fingers_that_do_not_open_evenly_are_refused() {
    let urdf = strangers_gripper();
    let loaded = Articulation::load(&urdf, &mut NoMeshes, &Limits::default()).unwrap();
    let config = drafted(&Draft::of(&loaded), 0.0425);
    let refused = |urdf: &str| RobotModel::from_urdf(urdf, &config).unwrap_err().to_string();
    // The pads pass the middle and come back.
    let wide = urdf.replace("upper='0.8'", "upper='3.1'");
    let e = refused(&wide);
    assert!(e.contains("open evenly"), "{e}");
    let loose = urdf.replace("<limit lower='0' upper='0.8' effort='1000' velocity='2'/>", "");
    let e = refused(&loose);
    assert!(e.contains("needs limits"), "{e}");
}
