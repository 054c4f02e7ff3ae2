//! Every robot that comes with the program has a page, whose table of figures is that of its files.

use std::path::Path;

use orchard_multibody::JointKind;
use orchard_quantity::Quantity;
use orchard_robot::RobotModel;

use super::marked;

/// Name of the table in a page.
const PART: &str = "figures";

/// Compares the tables of all pages with the robots; with `write`, brings them up to date instead.
pub fn check(root: &Path, write: bool) -> anyhow::Result<Vec<String>> {
    let mut errors = Vec::new();
    for name in RobotModel::names() {
        let page = format!("docs/robots/{name}.md");
        if !root.join(&page).exists() {
            errors.push(format!("{page} is missing: a robot that comes with the program has a page"));
            continue;
        }
        let robot = RobotModel::named(name).map_err(anyhow::Error::msg)?;
        errors.extend(marked::keep(root, &page, PART, &table(&robot), write)?);
    }
    Ok(errors)
}

/// Moving links with their masses, limits, rotors and friction, a row each.
fn table(robot: &RobotModel) -> String {
    let (config, articulation) = (robot.config(), robot.articulation());
    let mut text = "| joint | link | mass, kg | from | to | speed | effort | rotor, kg m2 | Coulomb friction | viscous friction |\n\
                    |---|---|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for link in &articulation.links {
        let (unit, effort) = match link.joint {
            JointKind::Slide(_) => ("m", "N"),
            _ => ("rad", "N m"),
        };
        let number = |x: f64, unit: &str| match x.is_finite() {
            true => format!("{} {unit}", rounded(x)),
            false => String::new(),
        };
        let [from, to, speed, most] = link.limit.map_or_else(Default::default, |limit| {
            [
                number(limit.lower, unit),
                number(limit.upper, unit),
                number(limit.velocity, &format!("{unit}/s")),
                number(limit.effort, effort),
            ]
        });
        let joint = config.parts.arm_joints.iter().position(|name| *name == link.joint_name);
        let given =
            |list: &[Quantity], other: f64| joint.and_then(|i| list.get(i)).map_or(other, Quantity::si);
        let some = |x: f64, unit: &str| if x == 0.0 { String::new() } else { number(x, unit) };
        let armature = some(given(&config.arm.armature, 0.0), "");
        let (mut coulomb, mut viscous) = (String::new(), String::new());
        if joint.is_some() {
            coulomb = some(given(&config.arm.friction, link.friction.coulomb), "N m");
            viscous = some(given(&config.arm.viscous_friction, link.friction.viscous), "N m s/rad");
        }
        let name = if link.joint_name.is_empty() { "ground" } else { &link.joint_name };
        text += &format!(
            "| `{name}` | `{}` | {} | {from} | {to} | {speed} | {most} | {} | {coulomb} | {viscous} |\n",
            link.name,
            rounded(link.inertia.mass),
            armature.trim()
        );
    }
    text
}

/// A number with at most four decimals.
fn rounded(x: f64) -> String {
    let text = format!("{x:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pages_of_this_workspace_are_up_to_date() {
        assert_eq!(check(&crate::workspace::root(), false).unwrap(), Vec::<String>::new());
    }

    #[test]
    fn a_missing_page_and_a_table_that_differs_are_named() {
        let folder = super::super::fixture::folder(&[(
            "docs/robots/fr3-fixed.md",
            "a\n<!-- figures -->\nold\n<!-- end of figures -->\n",
        )]);
        let errors = check(folder.path(), false).unwrap();
        assert!(
            errors.iter().any(|e| e.starts_with("docs/robots/ridgeback-fr3.md is missing")),
            "{errors:?}"
        );
        assert!(
            errors.iter().any(|e| e.starts_with("docs/robots/fr3-fixed.md: the part `figures` differs")),
            "{errors:?}"
        );
        check(folder.path(), true).unwrap();
        let text = std::fs::read_to_string(folder.path().join("docs/robots/fr3-fixed.md")).unwrap();
        assert!(
            text.contains(
                "| `fr3_joint1` | `fr3_link1` | 2.9275 | -2.7437 rad | 2.7437 rad | 2.62 rad/s | 87 N m |"
            ),
            "{text}"
        );
    }
}
