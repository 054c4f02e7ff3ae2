//! The commands of docs/robots.md, run as the page writes them.

#![cfg(unix)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// The blocks of commands of a page, in their order.
fn commands(page: &str) -> Vec<&str> {
    let blocks = page.split("```sh\n").skip(1);
    blocks.map(|rest| rest.split_once("```").map_or(rest, |(block, _)| block)).collect()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let (path, there) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            copy(&path, &there);
        } else {
            fs::copy(&path, &there).unwrap();
        }
    }
}

/// Every block runs to its end in one folder, beginning where the checkout has `examples/`.
#[test]
fn the_commands_of_the_page_about_robots_run() {
    let page = fs::read_to_string(Path::new(ROOT).join("docs/robots.md")).unwrap();
    let blocks = commands(&page);
    assert!(blocks.len() >= 3 && page.contains("examples/my-robot"), "{} blocks", blocks.len());
    let folder = tempfile::tempdir().unwrap();
    copy(&Path::new(ROOT).join("examples/my-robot"), &folder.path().join("examples/my-robot"));
    // `orchard` is the program of this build.
    let program = PathBuf::from(env!("CARGO_BIN_EXE_orchard"));
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", program.parent().unwrap().display());
    let mut said = String::new();
    for block in blocks {
        let mut shell = Command::new("sh");
        shell.args(["-e", "-c", block]).current_dir(folder.path()).env("PATH", &path).stdin(Stdio::null());
        let output = shell.output().unwrap();
        said += &String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{block}{said}{}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(said.contains("\nThis robot can harvest here.\n"), "{said}");
    let results = folder.path().join("results/my-robot");
    let summary = fs::read_to_string(results.join("summary.json")).unwrap();
    assert!(summary.contains("\"robot\": \"my_robot\""), "{summary}");
    for file in ["my_robot.png", "draft.toml"] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
}
