//! Robots from strangers' descriptions: mounted, completed, and reduced to the joints that play a part.

use nalgebra::Unit;
use orchard_geometry::{Pose, Vec3, transform};
use orchard_multibody::{Data, JointKind, ModelBuilder, forward_kinematics};
use orchard_robot::{BaseJoint, JointValues, PAPER_TOML, PartGroups, RobotConfig, RobotModel, Steering};

fn link(name: &str, mass: f64, inside: &str) -> String {
    format!(
        "<link name='{name}'><inertial><mass value='{mass}'/>\
         <inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.01'/></inertial>{inside}</link>"
    )
}

fn joint(name: &str, kind: &str, [parent, child]: [&str; 2], z: f64, axis: &str) -> String {
    format!(
        "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/><origin xyz='0 0 {z}'/>\
         <axis xyz='{axis}'/><limit lower='-1.5' upper='1.5' effort='50' velocity='2'/></joint>"
    )
}

/// An arm of five joints with odd names on a cart with one wheel, joints first and in reverse; a lamp on the elbow turns, too.
fn stranger() -> String {
    let names = ["cart", "Schulter", "l2", "l1", "Elle", "hand 5"];
    let axes = ["0 0 1", "0 -1 0", "0 1 0", "1 0 0", "0 -1 0"];
    let mut joints: Vec<String> = (0..5)
        .map(|i| joint(&format!("q/{}", 9 - i), "revolute", [names[i], names[i + 1]], 0.2, axes[i]))
        .collect();
    joints.push(joint("wheel joint", "continuous", ["cart", "wheel"], -0.1, "0 1 0"));
    joints.push(joint("lamp", "revolute", ["l1", "bulb"], 0.05, "0 0 1"));
    for (finger, axis) in [("f+", "0 1 0"), ("f-", "0 -1 0")] {
        joints.push(
            joint(&format!("slide {finger}"), "prismatic", ["hand 5", finger], 0.1, axis)
                .replace("-1.5", "0")
                .replace("upper='1.5'", "upper='0.05'"),
        );
    }
    joints.reverse();
    let boxed = "<collision><geometry><box size='0.4 0.3 0.2'/></geometry></collision>";
    let pad =
        "<collision><origin xyz='0 0.01 0'/><geometry><box size='0.02 0.01 0.04'/></geometry></collision>";
    let mut links: Vec<String> = names[1..].iter().map(|name| link(name, 1.0, "")).collect();
    links.push(link("cart", 20.0, boxed));
    links.extend([
        link("wheel", 3.0, boxed),
        link("bulb", 0.5, ""),
        link("f+", 0.1, pad),
        link("f-", 0.1, pad),
    ]);
    format!("<robot name='stranger'>{}{}</robot>", joints.concat(), links.concat())
}

/// The mapping: servos and hand of the paper's robot under the stranger's names.
fn mapping(mount: &str, base_joint: &str) -> RobotConfig {
    let mut text = String::from("base = 'common'\n");
    for table in ["[arm]", "[finger]", "[camera]"] {
        let start = PAPER_TOML.find(&format!("\n{table}\n")).unwrap() + 1;
        let rest = &PAPER_TOML[start..];
        text += &rest[..rest[1..].find("\n\n").map_or(rest.len(), |end| end + 2)];
        text += "\n";
    }
    let m = |value: f64| format!("{{ value = {value:?}, range = [-9.0, 9.0], unit = 'm', source = 'test' }}");
    let rad = |value: f64| m(value).replace("'m'", "'rad'");
    text += &format!(
        "[parts]\nbase_link = 'cart'\n{base_joint}arm_joints = ['q/9', 'q/8', 'q/7', 'q/6', 'q/5']\n\
         finger_joints = ['slide f+', 'slide f-']\nhand_link = 'hand 5'\ntcp_link = 'hand 5'\nbucket_link = 'basket'\n\
         [start]\nfinger_opening = {}\narm_home = [{}]\n\
         [mount]\njoint = {mount}\nheight = {}\n\
         [bucket]\nx = {}\ny = {}\nfloor = {}\nwidth = {}\ndepth = {}\nwall = {}\n",
        m(0.05),
        [0.0, 0.5, -0.5, 0.2, 0.3].map(rad).join(", "),
        m(0.4),
        m(-0.3),
        m(0.1),
        m(0.15),
        m(0.2),
        m(0.12),
        m(0.004),
    );
    if !base_joint.is_empty() {
        let start = PAPER_TOML.find("\n[drive]\n").unwrap() + 1;
        let rest = &PAPER_TOML[start..];
        text += &rest[..rest.find("\n\n").unwrap() + 1];
    }
    RobotConfig::from_toml("stranger.toml", &text).unwrap()
}

#[test]
fn joints_without_a_role_are_locked_and_keep_their_mass_and_shapes() {
    let robot = RobotModel::from_urdf(&stranger(), &mapping("{ kind = 'stands' }", "")).unwrap();
    let links = &robot.articulation().links;
    assert!(matches!(robot.base_joint(), BaseJoint::Fixed));
    assert_eq!((robot.kinematics().dof(), links.len()), (5, 8));
    assert!(links.iter().all(|link| link.joint_name != "wheel joint" && link.joint_name != "lamp"));
    let total: f64 = links.iter().map(|link| link.inertia.mass).sum();
    assert!((total - (20.0 + 5.0 + 3.0 + 0.5 + 0.2)).abs() < 1e-12, "{total}");
    // Cart, wheel and the five boxes of the bucket.
    assert_eq!(links[0].shapes.len(), 7);
    let bucket = robot.bucket();
    let (centre, half) = (Vec3::new(-0.3, 0.1, 0.15 + 0.06), Vec3::new(0.1, 0.1, 0.06));
    assert!((bucket.p_base - centre).norm() < 1e-12 && (bucket.half - half).norm() < 1e-12, "{bucket:?}");
}

/// Whatever carries the root, the tool stands where the description puts it, lifted by the mount.
#[test]
fn every_mount_carries_the_same_robot() {
    let slides = "{ kind = 'slides', range = { low = -1.0, high = 1.0, range = [-5.0, 5.0], unit = 'm', source = 'test' }, \
                  speed_max = { value = 0.5, range = [0.0, 5.0], unit = 'm/s', source = 'test' }, \
                  force_max = { value = 500.0, range = [0.0, 5000.0], unit = 'N', source = 'test' } }";
    for (mount, joint) in [
        ("{ kind = 'stands' }", ""),
        ("{ kind = 'drives' }", "base_joint = 'cart drive'\n"),
        (slides, "base_joint = 'rail'\n"),
    ] {
        let robot = RobotModel::from_urdf(&stranger(), &mapping(mount, joint)).unwrap();
        let mut builder = ModelBuilder::new();
        let all = orchard_multibody::Groups { member: 1, filter: 0 };
        let groups = PartGroups { base: all, arm: all, finger: all, bucket: all, self_contact: Some(16) };
        let handle = robot.add_to(&mut builder, &Pose::identity(), &groups);
        let model = builder.build().unwrap();
        let mut data = Data::new(&model);
        robot.set_start(&model, &mut data, &handle);
        forward_kinematics(&model, &mut data);
        // The frame of the base is the cart's, 0.4 m above the ground.
        assert!((handle.x_world_base(&data).translation.vector - Vec3::z() * 0.4).norm() < 1e-12, "{mount}");
        let home = JointValues::from([0.0, 0.5, -0.5, 0.2, 0.3]).vector();
        let p_base = robot.kinematics().tcp(&home).translation.vector;
        let p_world = transform(&handle.x_world_base(&data), &p_base);
        assert!((handle.x_world_tcp(&data).translation.vector - p_world).norm() < 1e-12, "{mount}");
        let moves = match robot.base_joint() {
            BaseJoint::Fixed => JointKind::Weld,
            BaseJoint::Planar(_) => JointKind::Planar,
            BaseJoint::Rail { axis_base, .. } => {
                assert_eq!(axis_base, Vec3::y());
                JointKind::Slide(Unit::new_unchecked(Vec3::y()))
            }
        };
        assert_eq!(robot.articulation().links[0].joint, moves, "{mount}");
    }
}

#[test]
fn steering_allows_what_wheels_can_do() {
    let radius = RobotModel::paper().config().arm.acceleration_max.with_value(2.0).unwrap();
    let wanted = [0.5, 0.3, -1.0];
    assert_eq!(Steering::Holonomic.allowed(wanted), wanted);
    assert_eq!(Steering::Differential.allowed(wanted), [0.5, 0.0, -1.0]);
    let car = Steering::Ackermann { turning_radius: radius };
    assert_eq!(car.allowed(wanted), [0.5, 0.0, -0.25]);
    assert_eq!(car.allowed([0.0, 1.0, 1.0]), [0.0; 3]);
}

/// The arm of the Husky moves as the published DH parameters of the UR5e say, and the robot weighs what its parts weigh.
#[test]
fn the_husky_has_the_published_arm() {
    let robot = RobotModel::named("husky-ur5e-2f85").unwrap();
    assert!(matches!(robot.base_joint(), BaseJoint::Planar(_)));
    assert_eq!(robot.config().drive.as_ref().unwrap().steering, Steering::Differential);
    // Husky 50, riser 15, bucket 1, arm 4.0 with its foot and 17.7, gripper 0.925 kg.
    let arm_mass = 3.761 + 8.058 + 2.846 + 1.37 + 1.3 + 0.365;
    assert!((robot.mass() - (50.0 + 15.0 + 1.0 + 4.0 + arm_mass + 0.925)).abs() < 1e-3, "{}", robot.mass());
    let arm = robot.kinematics();
    let quarter = std::f64::consts::FRAC_PI_2;
    // d, a, alpha of each joint.
    let table = [
        [0.1625, 0.0, quarter],
        [0.0, -0.425, 0.0],
        [0.0, -0.3922, 0.0],
        [0.1333, 0.0, quarter],
        [0.0997, 0.0, -quarter],
        [0.0996, 0.0, 0.0],
    ];
    let step = |q: f64, [d, a, alpha]: [f64; 3]| {
        let turn = Pose::rotation(Vec3::z() * q);
        turn * Pose::translation(a, 0.0, d) * Pose::rotation(Vec3::x() * alpha)
    };
    for n in 0..100 {
        let share = |i: usize| (0.37 + f64::from(n) * 0.618_034 + i as f64 * 0.271).fract();
        let q = JointValues::from_fn(6, |i| {
            let limit = arm.limits()[i];
            limit.lower + share(i) * (limit.upper - limit.lower)
        });
        let mount = Pose::translation(0.3058, 0.0, 0.58) * Pose::rotation(Vec3::z() * (2.0 * quarter));
        let flange = q.iter().zip(table).fold(mount, |x, (q, row)| x * step(*q, row));
        let expected = flange * Pose::translation(0.0, 0.0, 0.014 + 0.1362);
        let found = arm.tcp(&q.vector());
        assert!((found.translation.vector - expected.translation.vector).norm() < 1e-9, "{q:?}");
        assert!(found.rotation.angle_to(&expected.rotation) < 1e-7, "{q:?}");
    }
}
