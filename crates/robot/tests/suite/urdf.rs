//! URDF files, good and bad.

use nalgebra::Unit;
use orchard_geometry::{Shape, Vec3};
use orchard_multibody::JointKind;
use orchard_robot::{Articulation, PAPER_URDF, RobotConfig, RobotError, RobotModel};

fn link(name: &str) -> String {
    format!(
        "<link name='{name}'><inertial><mass value='2'/>\
         <inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial></link>"
    )
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, inside: &str) -> String {
    format!(
        "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>{inside}</joint>"
    )
}

const LIMIT: &str = "<limit lower='-1' upper='1' effort='5' velocity='2'/>";

fn read(parts: &[String]) -> Result<Articulation, RobotError> {
    Articulation::from_urdf(&format!("<robot name='r'>{}</robot>", parts.concat()))
}

#[test]
fn the_paper_robot_has_its_published_mass_and_bucket() {
    let robot = RobotModel::paper();
    // Ridgeback 135, arm 17.89, hand 0.6544, fingers 2 x 0.0291, bucket 1.
    let arm =
        2.3966 + 2.92746535 + 2.93553703 + 2.24490137 + 2.61559558 + 2.32712076 + 1.81703765 + 0.62714329;
    assert!((robot.mass() - (135.0 + arm + 0.6544 + 2.0 * 0.0291 + 1.0)).abs() < 1e-9);
    let bucket = robot.bucket();
    assert!((bucket.p_base - Vec3::new(-0.26, 0.0, 0.3575)).norm() < 1e-12);
    assert!((bucket.half - Vec3::new(0.15, 0.15, 0.0725)).norm() < 1e-12);
    assert!(bucket.contains(&Vec3::new(-0.3, 0.1, 0.3)) && !bucket.contains(&Vec3::new(-0.3, 0.1, 0.5)));
}

#[test]
fn every_joint_type_is_read_and_fixed_links_merge() {
    let parts = [
        link("ground"),
        link("a"),
        link("b"),
        link("c"),
        link("d"),
        link("e"),
        link("tool"),
        joint("j1", "planar", "ground", "a", "<axis xyz='0 0 1'/>"),
        joint("j2", "revolute", "a", "b", &format!("<axis xyz='0 2 0'/>{LIMIT}")),
        joint("j3", "continuous", "b", "c", "<origin xyz='1 0 0' rpy='0 0 1.5707963267948966'/>"),
        joint("j4", "prismatic", "c", "d", LIMIT),
        joint("j5", "floating", "d", "e", ""),
        joint("j6", "fixed", "e", "tool", "<origin xyz='0 0 2'/>"),
    ];
    let robot = read(&parts).unwrap();
    let kinds: Vec<_> = robot.links.iter().map(|l| l.joint).collect();
    let x = Vec3::x_axis();
    assert_eq!(
        kinds,
        [
            JointKind::Planar,
            JointKind::Hinge(Unit::new_normalize(Vec3::y())),
            JointKind::Hinge(x),
            JointKind::Slide(x),
            JointKind::Free
        ]
    );
    let last = &robot.links[4].inertia;
    assert_eq!(last.mass, 4.0);
    assert!((last.p_com - Vec3::new(0.0, 0.0, 1.0)).norm() < 1e-15);
    // Two bodies of 0.1 kg m2, 1 m from their common centre of mass.
    assert!((last.i_com.m11 - (0.2 + 2.0 * 2.0)).abs() < 1e-12 && (last.i_com.m33 - 0.2).abs() < 1e-12);
    let tool = robot.frame("tool").unwrap();
    assert_eq!((tool.link, tool.x_link_frame.translation.vector), (Some(4), Vec3::new(0.0, 0.0, 2.0)));
}

#[test]
fn cylinders_become_capsules_of_the_same_length() {
    let shape = "<link name='l'><collision><origin xyz='0 0 1'/>\
                 <geometry><cylinder radius='0.1' length='0.5'/></geometry></collision></link>";
    let robot = read(&[shape.to_owned()]).unwrap();
    let made = &robot.links[0].shapes[0];
    assert_eq!(made.shape, Shape::Capsule { radius: 0.1, length: 0.3 });
    let box_about = made.shape.aabb(&made.x_link_shape);
    assert!((box_about.min.z - 0.75).abs() < 1e-12 && (box_about.max.z - 1.25).abs() < 1e-12);
}

#[test]
fn bad_files_are_refused_with_a_reason() {
    let two = |joints: &[String]| read(&[&[link("a"), link("b")], joints].concat());
    let refused = |result: Result<Articulation, RobotError>, words: &[&str]| {
        let text = result.unwrap_err().to_string();
        assert!(!text.contains('\n') && words.iter().all(|w| text.contains(w)), "{text}");
    };
    refused(Articulation::from_urdf("no xml"), &["URDF cannot be read"]);
    refused(read(&[]), &["no link"]);
    refused(read(&[link("a"), link("a")]), &["two links", "`a`"]);
    refused(read(&[link("a"), link("b")]), &["`a`", "`b`", "not connected"]);
    refused(two(&[joint("j", "revolute", "a", "c", LIMIT)]), &["joint `j`", "no link `c`"]);
    let loop_of_two = [joint("j", "revolute", "a", "b", LIMIT), joint("k", "revolute", "b", "a", LIMIT)];
    refused(two(&loop_of_two), &["cycle"]);
    let island = [
        link("root"),
        link("a"),
        link("b"),
        joint("j", "revolute", "a", "b", LIMIT),
        joint("k", "revolute", "b", "a", LIMIT),
    ];
    refused(read(&island), &["cycle"]);
    let twice = [joint("j", "revolute", "a", "b", LIMIT), joint("k", "fixed", "a", "b", "")];
    refused(two(&twice), &["two parent"]);
    refused(two(&[joint("j", "spherical", "a", "b", "")]), &["joint `j`", "spherical"]);
    refused(two(&[joint("j", "winch", "a", "b", "")]), &["joint `j`", "winch"]);
    let crossed = "<limit lower='1' upper='-1' effort='5' velocity='1'/>";
    refused(two(&[joint("j", "revolute", "a", "b", crossed)]), &["joint `j`", "lowest position"]);
    let no_axis = format!("<axis xyz='0 0 0'/>{LIMIT}");
    refused(two(&[joint("j", "revolute", "a", "b", &no_axis)]), &["joint `j`", "axis"]);
    let mimic = format!("{LIMIT}<mimic joint='nobody'/>");
    refused(two(&[joint("j", "revolute", "a", "b", &mimic)]), &["mimic", "nobody"]);
    refused(two(&[joint("j", "revolute", "a", "b", "<origin xyz='nan 0 0'/>")]), &["joint `j`", "finite"]);
    let negative = link("b").replace("value='2'", "value='-2'");
    refused(read(&[link("a"), negative, joint("j", "revolute", "a", "b", LIMIT)]), &["link `b`", "mass"]);
    let mesh = "<link name='l'><collision><geometry><mesh filename='x.stl'/></geometry></collision></link>";
    refused(read(&[mesh.to_owned()]), &["link `l`", "mesh `x.stl`"]);
    for (text, words) in [
        ("<mujoco model='a'/>", ["MJCF", "not read"]),
        ("<sdf version='1.6'/>", ["SDF", "not read"]),
        ("<robot><xacro:macro name='a'/></robot>", ["xacro:macro", "xacro robot.xacro > robot.urdf"]),
        ("<robot><link name='${prefix}base'/></robot>", ["${prefix}base", "xacro robot.xacro > robot.urdf"]),
        (
            "<robot><link name='a'><visual><geometry><mesh filename='$(find x)/a.stl'/></geometry></visual></link></robot>",
            ["$(find x)", "`a`"],
        ),
        ("<urdf/>", ["first element", "`urdf`"]),
        ("<robot><link name='a'>", ["URDF cannot be read", "no end"]),
    ] {
        refused(Articulation::from_urdf(text), &words);
    }
}

#[test]
fn parts_that_the_file_does_not_have_are_named() {
    for (from, to) in [
        ("base_planar", "nothing"),
        ("base_height", "nothing"),
        ("fr3_joint4", "nothing"),
        ("finger_joint2", "nothing"),
        ("bucket_link", "nothing"),
        ("hand_tcp", "nothing"),
        ("fr3_joint4", "fr3_joint5"),
    ] {
        let text = orchard_robot::PAPER_TOML.replacen(&format!("\"{from}\""), &format!("\"{to}\""), 1);
        let config = RobotConfig::from_toml("robot.toml", &text).unwrap();
        let error = RobotModel::from_urdf(PAPER_URDF, &config).unwrap_err().to_string();
        assert!(error.contains(to) || error.contains(from), "{error}");
    }
}

mod arbitrary_text {
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn never_panics(cut in 0usize..20_000, insert in "[ -~]{0,12}") {
            let text = orchard_robot::PAPER_URDF;
            let cut = (0..=cut.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0);
            let _ = orchard_robot::Articulation::from_urdf(&format!("{}{insert}{}", &text[..cut], &text[cut..]));
        }
    }
}
