//! A robot of one's own, as a user brings it: a URDF file with odd names and order, its drafted mapping, and a harvest that needs neither
//! afterwards.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use orchard_robot::RobotModel;

fn orchard(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orchard"));
    command.args(args).current_dir(folder).stdin(Stdio::null());
    command.output().unwrap_or_else(|e| panic!("{e}"))
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A corner of a tetrahedron in ASCII STL: the convex hull of the finger's pad.
const MESH: &str = "solid pad
facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 20 0 0\nvertex 0 20 0\nendloop\nendfacet
facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 20 0\nvertex 0 0 20\nendloop\nendfacet
facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 20\nvertex 20 0 0\nendloop\nendfacet
facet normal 0 0 0\nouter loop\nvertex 20 0 0\nvertex 0 0 20\nvertex 0 20 0\nendloop\nendfacet
endsolid pad\n";

/// The pedestal's arm as a stranger would describe it: other names, elements in reverse, two axes turned round, a mesh in millimetres,
/// no bucket.
fn strangers_urdf() -> String {
    let own = RobotModel::named("fr3-fixed").unwrap().urdf().to_owned();
    let mut elements: Vec<String> = Vec::new();
    let body = &own[own.find("<link name").unwrap()..own.rfind("</robot>").unwrap()];
    for part in body.split_inclusive('>') {
        let starts = part.trim_start().starts_with("<link ") || part.trim_start().starts_with("<joint ");
        match elements.last_mut() {
            Some(last) if !starts => last.push_str(part),
            _ => elements.push(part.to_owned()),
        }
    }
    elements.retain(|element| !element.contains("bucket"));
    elements.reverse();
    let text = format!("<robot name='stranger'>{}</robot>", elements.concat());
    let text = text.replace("fr3_link", "Glied ").replace("fr3_joint", "axis/").replace("hand_tcp", "tool0");
    // The limits of this joint are symmetric.
    let flipped = text.find("\"axis/1\"").map(|at| {
        let axis = at + text[at..].find("0 0 1").unwrap();
        format!("{}0 0 -1{}", &text[..axis], &text[axis + 5..])
    });
    let text = flipped.unwrap();
    let hand = text.find("<link name=\"hand_link\">").unwrap() + "<link name=\"hand_link\">".len();
    let mesh = "<collision><origin xyz='0 0 0.02'/><geometry><mesh filename='package://odd/pad.stl' scale='0.001 0.001 0.001'/>\
                </geometry></collision>";
    format!("{}{mesh}{}", &text[..hand], &text[hand..])
}

/// The draft of an arm without a hand is read, and the check says that the hand is what lacks; the lift of a robot that stands is locked.
#[test]
fn a_draft_without_a_hand_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path();
    let link = |name: &str| {
        format!(
            "<link name='{name}'><inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial></link>"
        )
    };
    let joint = |n: u32, kind: &str| {
        format!(
            "<joint name='j{n}' type='{kind}'><parent link='l{n}'/><child link='l{}'/><origin xyz='0 0 0.2'/><axis xyz='0 {} {}'/>\
             <limit lower='-1' upper='1' effort='50' velocity='1'/></joint>",
            n + 1,
            n % 2,
            (n + 1) % 2
        )
    };
    let links: String = (0..7).map(|n| link(&format!("l{n}"))).collect();
    let joints: String = (0..6).map(|n| joint(n, if n == 0 { "prismatic" } else { "revolute" })).collect();
    fs::write(home.join("arm.urdf"), format!("<robot name='arm'>{links}{joints}</robot>")).unwrap();
    let draft = orchard(home, &["robot", "check", "--urdf", "arm.urdf", "--write-mapping", "arm.toml"]);
    assert_eq!(draft.status.code(), Some(0), "{}", text(&draft.stderr));
    let mapping = fs::read_to_string(home.join("arm.toml")).unwrap();
    assert!(
        mapping.contains("finger_joints = [\"\", \"\"]") && mapping.contains("# height_joint = "),
        "{mapping}"
    );
    let check = ["robot", "check", "--urdf", "arm.urdf", "--mapping", "arm.toml", "--require-harvest"];
    let lacking = orchard(home, &check);
    assert_eq!(lacking.status.code(), Some(3), "{}", text(&lacking.stderr));
    assert!(
        text(&lacking.stdout).contains("cannot harvest here: finger_joints: "),
        "{}",
        text(&lacking.stdout)
    );
}

#[test]
fn a_strangers_robot_is_checked_drafted_and_harvests() {
    let folder = tempfile::tempdir().unwrap();
    let (home, package) = (folder.path(), folder.path().join("odd"));
    fs::create_dir_all(&package).unwrap();
    fs::write(package.join("package.xml"), "<package/>").unwrap();
    fs::write(package.join("pad.stl"), MESH).unwrap();
    fs::write(package.join("arm.urdf"), strangers_urdf()).unwrap();
    // Without a mapping it loads and cannot harvest.
    let bare = orchard(home, &["robot", "check", "--urdf", "odd/arm.urdf", "--require-harvest"]);
    assert_eq!(bare.status.code(), Some(3), "{}", text(&bare.stderr));
    assert!(!text(&bare.stdout).contains("This robot can harvest here."));
    let missing = orchard(home, &["bench-v1", "--robot", "./odd/arm.urdf", "--out", "r"]);
    assert_eq!(missing.status.code(), Some(2));
    assert!(text(&missing.stderr).contains("--write-mapping ./odd/arm.toml"), "{}", text(&missing.stderr));
    // The draft is complete.
    let draft =
        orchard(home, &["robot", "check", "--urdf", "odd/arm.urdf", "--write-mapping", "odd/arm.toml"]);
    assert_eq!(draft.status.code(), Some(0), "{}", text(&draft.stderr));
    let check =
        ["robot", "check", "--urdf", "odd/arm.urdf", "--mapping", "odd/arm.toml", "--require-harvest"];
    let ready = orchard(home, &check);
    assert_eq!(ready.status.code(), Some(0), "{}{}", text(&ready.stdout), text(&ready.stderr));
    assert!(text(&ready.stdout).contains("\nThis robot can harvest here.\n"));
    let bench = |controller: &str| {
        let line = format!(
            "bench-v1 --tasks harvest --conditions nominal --trees 1 --seeds 3 --horizon 4 --robot ./odd/arm.urdf \
             --controller {controller} --out {controller}"
        );
        let words: Vec<&str> = line.split(' ').collect();
        orchard(home, &words)
    };
    for controller in ["baseline", "expert"] {
        let run = bench(controller);
        assert_eq!(run.status.code(), Some(0), "{controller}: {}", text(&run.stderr));
        let summary = fs::read_to_string(home.join(controller).join("summary.json")).unwrap();
        assert!(summary.contains("\"robot\": \"arm\""), "{controller}");
    }
    // The result stores the robot: nothing else is needed to look at it again.
    fs::rename(&package, home.join("elsewhere")).unwrap();
    let mut records =
        fs::read_dir(home.join("baseline/episodes")).unwrap().map(|entry| entry.unwrap().path());
    let record = records.find(|path| path.extension().is_some_and(|e| e == "json")).unwrap();
    let explained = orchard(home, &["explain", record.to_str().unwrap(), "--text"]);
    assert_eq!(explained.status.code(), Some(0), "{}", text(&explained.stderr));
    let report = orchard(home, &["report", "expert", "--no-pictures"]);
    assert_eq!(report.status.code(), Some(0), "{}", text(&report.stderr));
}
