//! Source of the kernels.

use crate::layout;
use crate::schedule::{LEVELS, PARTS, WARPS};

/// Source files of the kernels.
pub(crate) const FILES: [(&str, &str); 23] = [
    ("memory", include_str!("kernels/memory.wgsl")),
    ("math", include_str!("kernels/math.wgsl")),
    ("load", include_str!("kernels/load.wgsl")),
    ("motion", include_str!("kernels/motion.wgsl")),
    ("ground", include_str!("kernels/ground.wgsl")),
    ("inward", include_str!("kernels/inward.wgsl")),
    ("stem", include_str!("kernels/stem.wgsl")),
    ("pivot", include_str!("kernels/pivot.wgsl")),
    ("rod", include_str!("kernels/rod.wgsl")),
    ("wind", include_str!("kernels/wind.wgsl")),
    ("outward", include_str!("kernels/outward.wgsl")),
    ("touch", include_str!("kernels/touch.wgsl")),
    ("frame", include_str!("kernels/frame.wgsl")),
    ("substep", include_str!("kernels/substep.wgsl")),
    ("events", include_str!("kernels/events.wgsl")),
    ("conjugate", include_str!("kernels/conjugate.wgsl")),
    ("reset", include_str!("kernels/reset.wgsl")),
    ("measure", include_str!("kernels/measure.wgsl")),
    ("chacha", include_str!("kernels/chacha.wgsl")),
    ("draws", include_str!("kernels/draws.wgsl")),
    ("turns", include_str!("kernels/turns.wgsl")),
    ("habit", include_str!("kernels/habit.wgsl")),
    ("vary", include_str!("kernels/vary.wgsl")),
];

/// The whole source: constants of the layout, then all files.
pub(crate) fn source() -> String {
    let mut text = layout::wgsl();
    text += &format!(
        "const WARPS: u32 = {WARPS}u;\nconst LEVELS: u32 = {LEVELS}u;\nconst PARTS: u32 = {PARTS}u;\n"
    );
    for (_, file) in FILES {
        text += file;
    }
    text
}

/// The source of the kernels of robots, a module of their own.
pub(crate) fn source_of_robots() -> String {
    let files = [
        include_str!("kernels/math.wgsl"),
        include_str!("kernels/robot.wgsl"),
        include_str!("kernels/robot_links.wgsl"),
        include_str!("kernels/robot_servos.wgsl"),
    ];
    layout::wgsl() + &files.concat()
}

/// The source of the kernels of whole worlds: those of robots, and what lies between the two halves of their substep.
pub(crate) fn source_of_worlds() -> String {
    // The rules are the trees'; the bindings of their memory follow them.
    let memory = include_str!("kernels/memory.wgsl");
    let rules = memory.split_once("@group").map_or(memory, |(rules, _)| rules);
    let files = [
        include_str!("kernels/world.wgsl"),
        include_str!("kernels/pivot.wgsl"),
        include_str!("kernels/world_robot.wgsl"),
        include_str!("kernels/world_cup.wgsl"),
        include_str!("kernels/world_box.wgsl"),
        include_str!("kernels/world_boxes.wgsl"),
        include_str!("kernels/world_near.wgsl"),
        include_str!("kernels/world_meet.wgsl"),
        include_str!("kernels/world_answer.wgsl"),
        include_str!("kernels/world_respond.wgsl"),
        include_str!("kernels/world_paths.wgsl"),
        include_str!("kernels/world_rod.wgsl"),
        include_str!("kernels/world_newton.wgsl"),
        include_str!("kernels/world_eliminate.wgsl"),
        include_str!("kernels/world_apply.wgsl"),
    ];
    source_of_robots() + rules + &files.concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of the functions of a source.
    fn functions(text: &str) -> Vec<&str> {
        let starts = text.lines().filter_map(|line| {
            let line = line.trim_start().trim_start_matches("pub(super) ").trim_start_matches("pub(crate) ");
            line.trim_start_matches("pub ").strip_prefix("fn ")
        });
        starts.filter_map(|rest| rest.split(['(', '<']).next()).collect()
    }

    /// Every function of the kernels that draw worlds has its twin of the same name, in the file of the same name.
    #[test]
    fn drawing_kernels_have_twins() {
        let twins = [
            ("math", include_str!("twin/math.rs")),
            ("chacha", include_str!("twin/chacha.rs")),
            ("draws", include_str!("twin/draws.rs")),
            ("turns", include_str!("twin/turns.rs")),
            ("habit", include_str!("twin/habit.rs")),
            ("vary", include_str!("twin/vary.rs")),
        ];
        // Only the kernels that step worlds call these.
        let without = ["symmetric", "is_finite"];
        for (name, twin) in twins {
            let (_, kernel) = FILES.iter().find(|(file, _)| *file == name).unwrap();
            let of_twin = functions(twin);
            for function in functions(kernel) {
                assert!(
                    of_twin.contains(&function) || without.contains(&function),
                    "{name}.wgsl: {function}"
                );
            }
        }
    }
}
