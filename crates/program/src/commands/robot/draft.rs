//! The first draft of a mapping, as a config file with comments.

use std::fmt::Write;

use orchard_robot::{Articulation, Draft, Limit, PAPER_TOML};

/// Tables of the paper's robot that stand for servos, hand and camera until the user replaces them.
const FROM_PAPER: [&str; 3] = ["[arm]", "[finger]", "[camera]"];

/// Text of a mapping for the robot in the file `urdf`: guessed names, and figures that a robot of its size and kind needs.
pub fn text(urdf: &str, draft: &Draft, robot: &Articulation) -> String {
    let mut text = format!(
        "# First draft of a mapping for {}, written by `orchard robot check --write-mapping`.\n\
         # Each name and each figure is a guess: check it. `orchard robot check --mapping THIS_FILE` tells what is still missing;\n\
         # docs/robots.md explains all fields.\n\
         # A constant is a value with the range that is accepted, its unit and its source.\n\n\
         # Surfaces and inverse kinematics.\nbase = \"common\"\n\n# Names in the URDF.\n[parts]\n",
        urdf.escape_debug()
    );
    for guess in &draft.guesses {
        // A string of JSON is one of TOML.
        let quoted = |name: &String| serde_json::Value::from(name.as_str()).to_string();
        let names: Vec<String> = guess.names.iter().map(quoted).collect();
        let is_list = matches!(guess.role, "arm_joints" | "finger_joints");
        let is_optional = matches!(guess.role, "base_joint" | "height_joint");
        match names.first() {
            None if guess.role == "bucket_link" => {
                text +=
                    "# none found: table [bucket] below adds one of this name\nbucket_link = \"bucket\"\n";
            }
            None => {
                let off = if is_optional { "# " } else { "" };
                let value = match guess.role {
                    "arm_joints" => "[]",
                    "finger_joints" => "[\"\", \"\"]",
                    _ => "\"\"",
                };
                let _ =
                    writeln!(text, "# nothing found; sought: {}\n{off}{} = {value}", guess.why, guess.role);
            }
            Some(_) if guess.role == "base_link" && draft.names("base_joint").is_empty() => {
                text += "# the frame on the ground that table [mount] below adds\nbase_link = \"mount\"\n";
            }
            Some(first) => {
                let value = if is_list { format!("[{}]", names.join(", ")) } else { first.clone() };
                let _ = writeln!(text, "# guessed: {}\n{} = {value}", guess.why, guess.role);
            }
        }
    }
    let limits = |role: &str| -> Vec<Limit> {
        let links = draft.names(role).iter().filter_map(|name| robot.link_of_joint(name));
        links.map(|link| robot.links[link].limit.unwrap_or(Limit::NONE)).collect()
    };
    let quantity = |value: f64, low: f64, high: f64, unit: &str| {
        format!(
            "{{ value = {value:?}, range = [{low:?}, {high:?}], unit = \"{unit}\", source = \"robot_choice\" }}"
        )
    };
    text += "\n# The posture in which an episode starts: here the middle of each joint's range. Better: the hand in front of the body, level.\n[start]\n";
    let opening = draft.opening(robot).map_or(0.04, |opening| (opening.min(0.5) * 1e4).floor() / 1e4);
    let _ = writeln!(text, "finger_opening = {}\narm_home = [", quantity(opening, 0.0, 0.5, "m"));
    for limit in limits("arm_joints") {
        let (low, high) = (limit.lower.max(-6.3), limit.upper.min(6.3));
        let middle = (0.5 * (low + high) * 1e4).round() / 1e4;
        let _ = writeln!(text, "    {},", quantity(middle, low, high, "rad"));
    }
    text += "]\n";
    if draft.names("base_joint").is_empty() {
        let _ = writeln!(
            text,
            "\n# The URDF has no joint between robot and ground: it stands. For one that drives give [mount] the kind \"drives\", `parts.base_joint`\n\
             # a name, and a table [drive] (docs/robots.md).\n[mount]\njoint = {{ kind = \"stands\" }}\nheight = {}\n\n\
             # The place of the robot before the tree.\n[placement]\n\
             distance = {{ low = 1.0, high = 1.1, range = [0.1, 10.0], unit = \"m\", source = \"robot_choice\" }}\n\
             heading = {{ low = -5.0, high = 5.0, range = [-180.0, 180.0], unit = \"deg\", source = \"robot_choice\" }}",
            quantity(0.5, 0.0, 3.0, "m"),
        );
    } else {
        text += "\n# The drive of the base, from the paper's robot.\n";
        text += table_of_paper("[drive]");
    }
    if !draft.names("height_joint").is_empty() {
        text += "\n# The servo of the height, from the paper's robot.\n";
        text += table_of_paper("[height]");
    }
    if draft.names("bucket_link").is_empty() {
        text += "\n# A bucket behind the arm.\n[bucket]\n";
        for (field, value, low) in [
            ("x", -0.4, -3.0),
            ("y", 0.0, -3.0),
            ("floor", 0.3, -3.0),
            ("width", 0.3, 0.01),
            ("depth", 0.15, 0.01),
            ("wall", 0.005, 0.001),
        ] {
            let _ = writeln!(text, "{field} = {}", quantity(value, low, 3.0, "m"));
        }
    }
    let reach = (draft.reach(robot) * 100.0).round() / 100.0;
    let _ = writeln!(
        text,
        "\n# The reach sphere about the arm's second joint: the lengths of its links, stretched out.\n[reach]\nradius = {}\n\
         stand_off = {{ low = {:?}, high = {:?}, range = [0.0, 5.0], unit = \"m\", source = \"robot_choice\" }}",
        quantity(reach, 0.05, 5.0, "m"),
        (reach * 35.0).round() / 100.0,
        reach,
    );
    text += "\n# Servos, hand and camera of the paper's robot: replace them.\n";
    for table in FROM_PAPER {
        text += table_of_paper(table);
        text.push('\n');
    }
    text
}

/// A table of the paper's robot as it stands in its file.
fn table_of_paper(head: &str) -> &'static str {
    let Some(start) = PAPER_TOML.find(&format!("\n{head}\n")) else { return "" };
    let rest = &PAPER_TOML[start + 1..];
    // Up to the next table or its comment.
    let end = rest[1..].find("\n\n").map_or(rest.len(), |end| end + 2);
    &rest[..end]
}
