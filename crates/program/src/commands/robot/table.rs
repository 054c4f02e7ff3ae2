//! The report of `orchard robot check` as plain text.

use std::fmt::Write;

use orchard_robot::{InertiaFacts, JointFacts, Survey};

use crate::columns::columns;
use crate::output::Escaped;

/// The whole report.
pub fn text(survey: &Survey) -> String {
    let mut text = format!("robot `{}`\n\n", Escaped(&survey.name));
    let head = ["joint", "type", "parent", "child", "axis", "lower", "upper", "velocity", "effort", "mimics"];
    let mut rows = vec![head.map(str::to_owned)];
    rows.extend(survey.joints.iter().map(joint_row));
    text += &columns(&rows, &[0, 1, 2, 3, 4, 9]);
    let mut rows = vec![["link", "mass [kg]", "shapes", "inertia"].map(str::to_owned)];
    rows.extend(survey.links.iter().map(|link| {
        [
            link.name.clone(),
            format!("{:.4}", link.mass),
            link.collision_shapes.to_string(),
            inertia(&link.inertia),
        ]
    }));
    let _ = write!(text, "\n{}\n", columns(&rows, &[0, 3]));
    let (joints, moving) = (survey.joints.len(), survey.moving_joints);
    let _ = writeln!(
        text,
        "{} links, {joints} joints of which {moving} move, {:.3} kg in motion",
        survey.links.len(),
        survey.mass
    );
    let corners: Vec<String> = survey.footprint.iter().map(|[x, y]| format!("({x:.3}, {y:.3})")).collect();
    match corners.is_empty() {
        true => text += "no shapes near the ground\n",
        false => {
            let _ = writeln!(text, "outline of the base on the ground [m]: {}", corners.join(" "));
        }
    }
    text += &meshes(survey);
    text += "\nparts of a harvester\n";
    let rows: Vec<[String; 4]> = survey
        .roles
        .iter()
        .map(|role| {
            let found = if role.is_there { "found" } else { "MISSING" };
            let candidates = match role.is_there || role.candidates.is_empty() {
                true => String::new(),
                false => format!("the file has: {}", role.candidates.join(" ")),
            };
            let wanted = format!("{}, named {}", role.needs, role.wanted);
            [role.role.to_owned(), found.to_owned(), wanted, candidates]
        })
        .collect();
    text += &columns(&rows, &[0, 1, 2, 3]);
    if !survey.warnings.is_empty() {
        text += "\nwarnings\n";
    }
    for warning in &survey.warnings {
        let _ = writeln!(text, "{}", Escaped(&warning.to_string()));
    }
    match &survey.obstacle {
        None => text += "\nThis robot can harvest here.\n",
        Some(reason) => {
            let _ = writeln!(text, "\nThis robot cannot harvest here: {}", Escaped(reason));
        }
    }
    text
}

/// Collision meshes, each file at one scale once, and the number of visual meshes.
fn meshes(survey: &Survey) -> String {
    let mut rows =
        vec![["mesh", "kB", "triangles", "size [m]", "shapes", "corners", "hull / mesh"].map(str::to_owned)];
    for used in &survey.meshes {
        let Some(mesh) = &used.mesh else { continue };
        let size = mesh.size.map(|side| format!("{side:.3}")).join(" x ");
        let row = [
            used.file.clone(),
            mesh.bytes.div_ceil(1000).to_string(),
            mesh.triangles.to_string(),
            size,
            mesh.shapes.to_string(),
            mesh.corners.to_string(),
            mesh.excess.map_or("flat".to_owned(), |excess| format!("{excess:.2}")),
        ];
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    let visual = survey.meshes.iter().filter(|used| !used.is_collision).count();
    let mut text = if rows.len() > 1 { format!("\n{}", columns(&rows, &[0])) } else { String::new() };
    if visual > 0 {
        let _ = writeln!(text, "{visual} visual meshes, which are not read");
    }
    text
}

fn joint_row(joint: &JointFacts) -> [String; 10] {
    let number = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.4}"));
    let axis = joint.axis.map_or("-".to_owned(), |[x, y, z]| format!("{x} {y} {z}"));
    [
        joint.name.clone(),
        joint.kind.clone(),
        joint.parent.clone(),
        joint.child.clone(),
        axis,
        number(joint.lower),
        number(joint.upper),
        number(joint.velocity),
        number(joint.effort),
        joint.mimic.clone().unwrap_or_default(),
    ]
}

fn inertia(facts: &InertiaFacts) -> String {
    match facts {
        InertiaFacts::None => "none".to_owned(),
        InertiaFacts::Possible => "ok".to_owned(),
        InertiaFacts::NotPositive { smallest } => {
            format!("impossible: a principal moment is {smallest:e} kg m2")
        }
        InertiaFacts::Unbalanced { ratio } => {
            format!("impossible: a principal moment is {ratio:.2} times the sum of the others")
        }
    }
}
