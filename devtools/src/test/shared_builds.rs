//! Tests that the tools and the tests, and the programs of the page, share each compiled crate.

use std::collections::BTreeSet;
use std::process::Command;

use crate::workspace;

/// Crates with their versions and features, as `cargo tree` resolves them for some packages and kinds of dependencies.
fn builds(selection: &[&str], edges: &str) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--quiet", "--prefix", "none", "--format", "{p} {f}", "--edges", edges])
        .args(selection)
        .current_dir(workspace::root())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout);
    let lines = text.lines().map(|line| line.trim_end_matches(" (*)").to_owned());
    lines.filter(|line| !line.contains(" feature ")).collect()
}

/// Features of the viewer's window, as its step switches them on.
const WINDOW: &str = "orchard-view/window,orchard-view/recording,orchard-view/demos,orchard-view/live";
/// Crates that the feature `live` changes.
const LIVE: [&str; 2] = ["foxglove v", "orchard-recording v"];

/// The tools, the tests, the viewer's window, the Python package and the fuzz targets compile each crate with the same features. A difference would have cargo compile
/// the crate, and all that use it, twice.
#[test]
fn all_builds_share_each_compiled_crate() {
    let tools = builds(&["--package", "devtools"], "features,no-dev");
    let apart = ["--exclude", "orchard-fuzz", "--exclude", "orchard-python"];
    let window = ["--package", "devtools", "--package", "orchard-view", "--features", WINDOW];
    // Live channels are compiled for the window alone.
    let of_window = builds(&window, "features")
        .into_iter()
        .chain(tools.iter().filter(|build| LIVE.iter().any(|name| build.starts_with(name))).cloned());
    for (name, others) in [
        ("tests", builds(&[&["--workspace"], &apart[..]].concat(), "features")),
        ("python", builds(&["--package", "devtools", "--package", "orchard-python"], "features,no-dev")),
        ("view", of_window.collect()),
        ("fuzz", builds(&["--package", "devtools", "--package", "orchard-fuzz"], "features,no-dev")),
    ] {
        let other: Vec<&String> = tools.difference(&others).collect();
        let fits = tools.len() > 100 && other.is_empty();
        assert!(fits, "{name}: set the features that it has in devtools/Cargo.toml: {other:?}");
    }
}

/// The programs of the page have the same features in the crates that both of them use.
#[test]
fn the_programs_of_the_page_share_each_compiled_crate() {
    let of = |package| {
        let selection = ["--package", package, "--target", "wasm32-unknown-unknown", "--no-dedupe"];
        builds(&selection, "normal,build")
    };
    let (page, batch) = (of("orchard-web"), of("orchard-web-batch"));
    let name = |build: &String| build.split(' ').take(2).collect::<Vec<_>>().join(" ");
    let names: BTreeSet<String> = page.iter().map(name).collect();
    let other: Vec<&String> = batch.difference(&page).filter(|build| names.contains(&name(build))).collect();
    let count = batch.intersection(&page).count();
    assert!(count > 80 && other.is_empty(), "{count} are shared; crates/web-batch differs in {other:?}");
}
