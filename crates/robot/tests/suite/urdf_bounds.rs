//! URDF files with implausible numbers and trees.

use crate::bench::{Bench, GRAVITY, TOUCHING, fixed};
use orchard_geometry::{Shape, Vec3};
use orchard_robot::{Articulation, PAPER_URDF, RobotConfig, RobotError, RobotModel};
use std::fmt::Write as _;
use std::ops::Range;

/// Positions of the numbers in the attribute values of XML text.
fn numbers(text: &str) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    for (start, value) in text.split('"').scan(0, |at, piece| {
        let start = *at;
        *at += piece.len() + 1;
        Some((start, piece))
    }) {
        for word in value.split_ascii_whitespace() {
            if word.parse::<f64>().is_ok() {
                let at = start + (word.as_ptr() as usize - value.as_ptr() as usize);
                found.push(at..at + word.len());
            }
        }
    }
    found
}

/// Puts the robot on a block and steps it once: every shape meets another.
fn step_once(robot: &RobotModel) {
    let block = Shape::Box { half: Vec3::new(2.0, 2.0, 0.5) };
    let (mut bench, _) =
        Bench::with(robot, &TOUCHING, |builder| builder.add_collider(fixed(block, Vec3::zeros())));
    bench.substep(&robot.start_command(), &GRAVITY);
}

#[test]
fn a_huge_number_anywhere_is_refused_by_name_or_harmless() {
    let config = RobotConfig::paper();
    let places = numbers(PAPER_URDF);
    assert!(places.len() > 300, "{}", places.len());
    let mut refused = 0;
    for place in &places {
        for huge in ["1e4", "-1e12", "1e12", "1e200"] {
            let text = format!("{}{huge}{}", &PAPER_URDF[..place.start], &PAPER_URDF[place.end..]);
            match RobotModel::from_urdf(&text, &config) {
                Err(error) => {
                    let line = error.to_string();
                    assert!(line.contains('`') && !line.contains('\n'), "{line}");
                    refused += 1;
                }
                Ok(robot) => step_once(&robot),
            }
        }
    }
    // Only masses, inertias and effort and speed limits may be 1e4.
    assert!(refused >= 3 * places.len(), "{refused} of {}", 4 * places.len());
}

fn link(name: &str, inside: &str) -> String {
    format!(
        "<link name='{name}'><inertial><mass value='1'/>\
         <inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>{inside}</link>"
    )
}

fn chain(length: usize, kind: &str, offset: f64) -> Result<Articulation, RobotError> {
    let mut text = String::from("<robot name='r'>");
    for i in 0..=length {
        text += &link(&format!("l{i}"), "");
    }
    for i in 0..length {
        let next = i + 1;
        write!(
            text,
            "<joint name='j{i}' type='{kind}'><parent link='l{i}'/><child link='l{next}'/>\
             <origin xyz='{offset} 0 0'/><axis xyz='0 0 1'/></joint>"
        )
        .unwrap();
    }
    Articulation::from_urdf(&(text + "</robot>"))
}

#[test]
fn a_chain_may_be_longer_than_the_call_stack_is_deep() {
    let moving = chain(128, "continuous", 0.01).unwrap();
    assert_eq!(moving.links.len(), 128);
    assert!(moving.links.iter().enumerate().all(|(i, l)| l.parent == i.checked_sub(1)));
    for length in [129, 6000] {
        let error = chain(length, "continuous", 0.01).unwrap_err().to_string();
        assert!(error.contains("more than 128 joints that move"), "{error}");
    }
    let rigid = chain(6000, "fixed", 0.01).unwrap();
    assert_eq!((rigid.links.len(), rigid.frames.len()), (0, 6001));
    let end = rigid.frame("l6000").unwrap().x_link_frame.translation.vector;
    // 6,000 roundings of numbers up to 60.
    assert!((end - Vec3::new(60.0, 0.0, 0.0)).norm() < 6000.0 * 60.0 * f64::EPSILON);
}

#[test]
fn offsets_that_add_up_too_far_are_refused() {
    let error = chain(30, "fixed", 100.0).unwrap_err().to_string();
    assert!(error.contains("joint `j10`") && error.contains("root"), "{error}");
}

#[test]
fn each_kind_of_number_is_refused_with_its_place() {
    let joint = |inside: &str| {
        let joint = format!(
            "<joint name='j' type='revolute'><parent link='a'/><child link='b'/>{inside}</joint></robot>"
        );
        format!("<robot name='r'>{}{}{joint}", link("a", ""), link("b", ""))
    };
    let limit = |l: &str| format!("<limit {l}/>");
    let good = limit("lower='-1' upper='1' effort='5' velocity='2'");
    assert!(Articulation::from_urdf(&joint(&good)).is_ok());
    for (text, words) in [
        (joint(&format!("<origin xyz='0 2000 0'/>{good}")), ["joint `j`", "2e3"]),
        (joint(&format!("<axis xyz='0 0 1e200'/>{good}")), ["axis of joint `j`", "1e200"]),
        (joint(&limit("lower='-1' upper='nan' effort='5' velocity='2'")), ["limits of joint `j`", "finite"]),
        (joint(&good).replacen("mass value='1'", "mass value='1e7'", 2), ["inertia of link `a`", "1e7"]),
        (joint(&good).replace("izz='1'", "izz='1e10'"), ["inertia of link `a`", "1e10"]),
        (
            "<robot name='r'><link name='a'><collision><geometry><sphere radius='1e12'/></geometry>\
             </collision></link></robot>"
                .to_owned(),
            ["collision of link `a`", "1e12"],
        ),
    ] {
        let error = Articulation::from_urdf(&text).unwrap_err().to_string();
        assert!(words.iter().all(|w| error.contains(w)), "{error}");
    }
}

#[test]
fn a_mass_that_is_no_number_is_refused_on_a_fixed_base_too() {
    let text =
        format!("<robot name='r'>{}</robot>", link("a", "")).replace("mass value='1'", "mass value='NaN'");
    let error = Articulation::from_urdf(&text).unwrap_err().to_string();
    assert_eq!(error, "inertia of link `a`: a number is not finite");
}

#[test]
fn descriptions_that_are_too_deep_or_too_long_are_refused_before_they_are_read() {
    let error = |text: &str| Articulation::from_urdf(text).unwrap_err().to_string();
    let deep = format!("<robot name='r'>{}{}</robot>", "<x>".repeat(20_000), "</x>".repeat(20_000));
    assert!(error(&deep).contains("more than 64 elements inside one another"), "{}", error(&deep));
    // Elements that no end closes.
    assert!(error(&"<x>".repeat(20_000)).contains("more than 64 elements inside one another"));
    let many = format!("<robot name='r'>{}</robot>", "<joint/>".repeat(100_000));
    assert!(error(&many).contains("more than 20000 links, joints and shapes"));
    let long = format!("<robot name='r'><!--{}--></robot>", " ".repeat(5_000_000));
    assert!(error(&long).contains("bytes of text"));
    let entities = "<!DOCTYPE r [<!ENTITY a '<x><x>'>]><robot name='r'>&a;</robot>";
    assert!(error(entities).contains("document type"), "{}", error(entities));
}
