//! Variants of the detector with parts switched off.

use orchard_perception::DetectorConfig;

/// A variant of a detector.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// Name in result files.
    pub name: &'static str,
    /// Title for readers.
    pub title: &'static str,
    /// Name of the variant that equals this one without the anti-branch gates, if there is one.
    pub without_anti_branch: Option<&'static str>,
    /// The detector.
    pub config: DetectorConfig,
}

/// A name, a title, and the function that switches parts off.
type Change = (&'static str, &'static str, fn(&mut DetectorConfig));

const ALL_GATES: &str = "all_gates";
const NO_ANTI_BRANCH: &str = "no_anti_branch";
const PATCH: &str = "patch";
const PATCH_NO_ANTI_BRANCH: &str = "patch_no_anti_branch";

const CHANGES: &[Change] = &[
    (ALL_GATES, "all gates", |_| ()),
    (NO_ANTI_BRANCH, "without the anti-branch gates", anti_branch_off),
    ("no_radius", "without radius", |c| c.gates.radius.on = false),
    ("no_residual", "without residual", |c| c.gates.residual.on = false),
    ("no_convexity", "without convexity", |c| c.gates.convexity.on = false),
    ("no_pixel_ratio", "without pixel ratio", |c| c.gates.pixel_ratio.on = false),
    ("no_elongation", "without elongation", |c| c.gates.elongation.on = false),
    ("no_isolation", "without isolation", |c| c.gates.isolation.on = false),
    ("no_cylinder", "without cylinder", |c| c.gates.cylinder.on = false),
    ("no_hidden", "without hidden-pixel rule", |c| c.gates.hidden.on = false),
    (PATCH, "one sphere per patch", one_sphere_a_patch),
    (PATCH_NO_ANTI_BRANCH, "one sphere per patch, without the anti-branch gates", |c| {
        one_sphere_a_patch(c);
        anti_branch_off(c);
    }),
];

/// Switches off the gates against branches: elongation and cylinder.
fn anti_branch_off(config: &mut DetectorConfig) {
    config.gates.elongation.on = false;
    config.gates.cylinder.on = false;
}

/// Sets the fit of the paper: one sphere per patch, without a model of occlusion.
fn one_sphere_a_patch(config: &mut DetectorConfig) {
    config.fit.refine = false;
    config.gates.hidden.on = false;
}

/// All variants of a detector: unchanged; without both anti-branch gates; without each single gate; and with one sphere fitted to
/// each whole patch, as in the paper, with and without the anti-branch gates.
pub fn variants(config: &DetectorConfig) -> Vec<Variant> {
    let variant = |&(name, title, change): &Change| {
        let mut config = config.clone();
        change(&mut config);
        let without_anti_branch = match name {
            ALL_GATES => Some(NO_ANTI_BRANCH),
            PATCH => Some(PATCH_NO_ANTI_BRANCH),
            _ => None,
        };
        Variant { name, title, without_anti_branch, config }
    };
    CHANGES.iter().map(variant).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    /// Dotted names of the fields in which two configs differ.
    fn differences(a: &Value, b: &Value, path: &str, out: &mut Vec<String>) {
        match (a, b) {
            (Value::Object(a), Value::Object(b)) => {
                for (name, value) in a {
                    differences(value, &b[name], &format!("{path}.{name}"), out);
                }
            }
            _ if a != b => out.push(path.trim_start_matches('.').to_owned()),
            _ => {}
        }
    }

    #[test]
    fn every_switch_of_the_detector_has_a_variant_and_no_variant_does_more() {
        let config = DetectorConfig::paper();
        let json = |config: &DetectorConfig| serde_json::to_value(config).unwrap();
        let switched = |name: &str| {
            let all = variants(&config);
            let variant = all.iter().find(|v| v.name == name).unwrap_or_else(|| panic!("no variant {name}"));
            let mut out = Vec::new();
            differences(&json(&config), &json(&variant.config), "", &mut out);
            out
        };
        let gates = json(&config)["gates"].as_object().unwrap().clone();
        for gate in gates.keys() {
            assert_eq!(switched(&format!("no_{gate}")), [format!("gates.{gate}.on")]);
        }
        let both = ["gates.cylinder.on", "gates.elongation.on"];
        assert_eq!(switched(NO_ANTI_BRANCH), both);
        assert_eq!(switched(PATCH), ["fit.refine", "gates.hidden.on"]);
        assert_eq!(
            switched(PATCH_NO_ANTI_BRANCH),
            [&["fit.refine"], &both[..], &["gates.hidden.on"]].concat()
        );
        assert!(switched(ALL_GATES).is_empty());
        assert_eq!(variants(&config).len(), gates.len() + 4);
    }
}
