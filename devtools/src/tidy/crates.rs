//! Checks the crate graph: the layers, and that the blind crates have no access to ground truth.
//!
//! Development dependencies are free: a test may compare with anything, and users of a crate do not get them.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::Context;
use cargo_metadata::{DependencyKind, MetadataCommand};

use super::LAYERS;

/// Crates that may only use sensor data: they find fruit, control the robot, run policies.
const BLIND: [&str; 5] = ["network", "perception", "picker", "policy", "learned"];

/// The crates that contain neither seeds nor ground truth. [`BLIND`] may depend on no others, directly or indirectly: a crate that is split from
/// another one, or new, counts as one with truth until it is named here.
const WITHOUT_TRUTH: [&str; 9] =
    ["quantity", "geometry", "multibody", "network", "perception", "robot", "picker", "policy", "learned"];

/// A workspace package, by its name without the prefix `orchard-`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Package {
    /// Name.
    pub name: String,
    /// Workspace packages that it, or its build script, depends on.
    pub uses: BTreeSet<String>,
}

/// Reads the workspace's packages.
pub fn packages(root: &Path) -> anyhow::Result<Vec<Package>> {
    let metadata = MetadataCommand::new()
        .manifest_path(root.join("Cargo.toml"))
        .no_deps()
        .exec()
        .context("cargo metadata")?;
    let members: BTreeSet<&str> = metadata.packages.iter().map(|p| p.name.as_str()).collect();
    let short = |name: &str| name.strip_prefix("orchard-").unwrap_or(name).to_owned();
    let mut packages: Vec<Package> = metadata
        .packages
        .iter()
        .map(|p| Package {
            name: short(&p.name),
            uses: p
                .dependencies
                .iter()
                .filter(|d| d.kind != DependencyKind::Development && members.contains(d.name.as_str()))
                .map(|d| short(&d.name))
                .collect(),
        })
        .collect();
    packages.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(packages)
}

/// Checks that every package is in the layers, uses only packages before it, and has no forbidden dependency.
pub fn check(packages: &[Package]) -> Vec<String> {
    let mut errors = Vec::new();
    let layer = |name: &str| LAYERS.iter().position(|l| *l == name);
    for package in packages {
        let Some(own) = layer(&package.name) else {
            errors.push(format!("crate {} is missing in the layers (devtools/src/tidy.rs)", package.name));
            continue;
        };
        for used in &package.uses {
            if layer(used).is_none_or(|used| used >= own) {
                errors.push(format!("crate {} uses {used}, which is not below it", package.name));
            }
        }
    }
    for blind in BLIND {
        for reached in reach(packages, blind) {
            if !WITHOUT_TRUTH.contains(&reached.as_str()) {
                errors.push(format!("crate {blind} depends on {reached}: it may only use sensor data"));
            }
        }
    }
    errors
}

/// Everything that a package depends on, over any number of steps.
fn reach(packages: &[Package], from: &str) -> BTreeSet<String> {
    let mut reached = BTreeSet::new();
    let mut open = vec![from.to_owned()];
    while let Some(name) = open.pop() {
        for used in packages.iter().filter(|p| p.name == name).flat_map(|p| &p.uses) {
            if reached.insert(used.clone()) {
                open.push(used.clone());
            }
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    fn package(name: &str, uses: &[&str]) -> Package {
        Package { name: name.into(), uses: uses.iter().map(|u| (*u).into()).collect() }
    }

    #[test]
    fn this_workspace_is_in_order() {
        let packages = packages(&crate::workspace::root()).unwrap();
        assert!(packages.iter().any(|p| p.name == "picker" && p.uses.contains("perception")));
        assert_eq!(check(&packages), Vec::<String>::new());
    }

    #[test]
    fn upward_and_sideways_uses_are_found() {
        let errors = check(&[package("spec", &["quantity", "treegen"]), package("fruit", &["fruit"])]);
        assert_eq!(
            errors,
            [
                "crate spec uses treegen, which is not below it",
                "crate fruit uses fruit, which is not below it"
            ]
        );
    }

    #[test]
    fn unknown_crates_are_found() {
        let errors = check(&[package("utils", &[])]);
        assert_eq!(errors, ["crate utils is missing in the layers (devtools/src/tidy.rs)"]);
    }

    #[test]
    fn truth_is_found_behind_a_go_between() {
        let errors = check(&[
            package("picker", &["robot"]),
            package("robot", &["multibody"]),
            package("multibody", &["spec"]),
        ]);
        assert_eq!(errors, ["crate picker depends on spec: it may only use sensor data"]);
    }

    #[test]
    fn a_crate_that_nobody_cleared_counts_as_one_with_truth() {
        let errors = check(&[package("policy", &["exchange"]), package("exchange", &[])]);
        assert_eq!(errors, ["crate policy depends on exchange: it may only use sensor data"]);
    }

    fn workspace_with(picker_dependencies: &str) -> Vec<Package> {
        let manifest = |name: &str, rest: &str| {
            format!("[package]\nname = \"orchard-{name}\"\nversion = \"0.1.0\"\nedition = \"2024\"\n{rest}")
        };
        let folder = super::super::fixture::folder(&[
            ("Cargo.toml", "[workspace]\nresolver = \"3\"\nmembers = [\"picker\", \"treegen\"]\n"),
            ("picker/Cargo.toml", &manifest("picker", picker_dependencies)),
            ("picker/src/lib.rs", ""),
            ("treegen/Cargo.toml", &manifest("treegen", "")),
            ("treegen/src/lib.rs", ""),
        ]);
        packages(folder.path()).unwrap()
    }

    #[test]
    fn renamed_optional_and_platform_dependencies_count() {
        for table in ["dependencies", "build-dependencies", "target.'cfg(unix)'.dependencies"] {
            let packages = workspace_with(&format!(
                "[{table}]\nplants = {{ package = \"orchard-treegen\", path = \"../treegen\", optional = true }}\n"
            ));
            assert_eq!(
                check(&packages),
                ["crate picker depends on treegen: it may only use sensor data"],
                "{table}"
            );
        }
    }

    #[test]
    fn tests_may_compare_with_anything() {
        let packages = workspace_with("[dev-dependencies]\norchard-treegen = { path = \"../treegen\" }\n");
        assert_eq!(check(&packages), Vec::<String>::new());
    }
}
