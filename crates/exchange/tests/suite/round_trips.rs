//! Written files read back, and damaged files are refused with a reason.

use orchard_exchange::{ImportError, json, mtg};
use orchard_spec::{Preset, Spec};
use orchard_treegen::{Skeleton, grow};
use proptest::prelude::*;

fn trees() -> Vec<Skeleton> {
    let spec = Spec::paper();
    let mut trees: Vec<Skeleton> = (0..3).map(|seed| grow(&spec, seed, 0).unwrap()).collect();
    trees.push(canonical());
    trees.push(grow(&Spec::preset(Preset::Calibrated), 0, 0).unwrap());
    trees
}

/// The canonical ternary tree.
fn canonical() -> Skeleton {
    grow(&Spec::preset(Preset::Ternary), 0, 0).unwrap()
}

#[test]
fn json_gives_the_same_bits_back() {
    let spec = Spec::paper();
    for tree in trees() {
        let text = json::write(&tree);
        let back = json::read(&text).unwrap().into_skeleton(&spec, 0, 0);
        assert_eq!(back, tree);
        assert_eq!(json::write(&back), text);
    }
}

#[test]
fn mtg_gives_the_wood_back() {
    // Coordinates are sums along a limb: a few roundings of values up to 3 m.
    const ROUNDING: f64 = 1e-13;
    for tree in trees() {
        let back = mtg::read(&mtg::write(&tree)).unwrap();
        assert_eq!(back.segments().len(), tree.segments.len());
        for (a, b) in back.segments().iter().zip(&tree.segments) {
            assert_eq!((a.parent, a.order, a.radius), (b.parent, b.order, b.radius));
            assert!((a.length - b.length).abs() < ROUNDING);
            assert!((a.p_base_world - b.p_base_world).norm() < ROUNDING);
            assert!((a.p_tip_world() - b.p_tip_world()).norm() < ROUNDING);
        }
    }
}

#[test]
fn digitised_wood_gets_fruit_sites_and_leaves_of_the_grown_tree() {
    let (spec, tree) = (Spec::paper(), grow(&Spec::paper(), 5, 2).unwrap());
    let mut file: serde_json::Value = serde_json::from_str(&json::write(&tree)).unwrap();
    file.as_object_mut().unwrap().retain(|key, _| key != "fruit_sites" && key != "leaves");
    assert_eq!(json::read(&file.to_string()).unwrap().into_skeleton(&spec, 5, 2), tree);
}

/// A tree in another coding: axes as a scale, a base off the origin, other names.
const DIGITISED: &str = "CODE:\tFORM-A\n\nCLASSES:\nSYMBOL\tSCALE\tDECOMPOSITION\tINDEXATION\tDEFINITION\n$\t0\tFREE\tFREE\tIMPLICIT
P\t1\tFREE\tFREE\tEXPLICIT\nA\t2\tFREE\tFREE\tEXPLICIT\nE\t3\tFREE\tFREE\tEXPLICIT\n
DESCRIPTION:\nLEFT\tRIGHT\tRELTYPE\tMAX\nE\tE\t+\t?\n
FEATURES:\nNAME\tTYPE\nXX\tREAL\nYY\tREAL\nZZ\tREAL\nTopDia\tREAL\n
MTG:\nENTITY-CODE\t\tXX\tYY\tZZ\tTopDia
/P1\t\t10\t20\t5\t\t# measured from the field's corner
^/A1/E7\t\t10\t20\t6\t0.06
\t+A2/E1\t10.5\t20\t6\t0.02
\t^<E1\t11\t20\t6\t0.02
^<E8\t\t10\t20\t7\t0.04
";

#[test]
fn other_peoples_coding_is_read() {
    let tree = mtg::read(DIGITISED).unwrap();
    let read: Vec<_> = tree.segments().iter().map(|s| (s.parent, s.order, s.radius)).collect();
    assert_eq!(read, [(None, 0, 0.03), (Some(0), 1, 0.01), (Some(1), 1, 0.01), (Some(0), 0, 0.02)]);
    let tip = tree.segments()[2].p_tip_world();
    assert!((tip - orchard_geometry::Vec3::new(1.0, 0.0, 1.0)).norm() < 1e-14, "{tip}");
}

#[test]
fn errors_name_line_field_and_value() {
    let mtg_error = |from: &str, to: &str| {
        assert!(DIGITISED.contains(from), "{from}");
        mtg::read(&DIGITISED.replacen(from, to, 1)).unwrap_err().to_string()
    };
    for (from, to, message) in [
        ("0.06", "-0.06", "line 24: TopDia is -0.06: it must not be negative"),
        ("0.06", "thick", "line 24: TopDia is \"thick\""),
        ("10.5", "nan", "line 25: XX is \"nan\""),
        ("FORM-A", "FORM-B", "line 1: CODE is \"FORM-B\""),
        ("^<E8\t", "^<<E2\t", "line 27: code \"<<E2\": a series needs one class and growing indices"),
        ("^<E8\t", "^<K8\t", "line 27: class \"K\""),
        ("^<E8\t", "<E8\t", "line 27: code \"<E8\": there is no entity in the columns to the left"),
        ("\tTopDia\n/P", "\tGirth\n/P", "line 22: column \"Girth\""),
    ] {
        let error = mtg_error(from, to);
        assert!(error.starts_with(message), "{to}: {error}");
    }
    let text = json::write(&small());
    let json_error = |from: &str, to: &str| json::read(&text.replacen(from, to, 1)).unwrap_err().to_string();
    assert_eq!(
        json_error("\"schema_version\": 1", "\"schema_version\": 9"),
        "schema_version is 9; this version reads 1"
    );
    assert!(json_error("\"length\"", "\"width\"").starts_with("segments[0].width: unknown field"));
    assert!(
        json_error("\"parent\": 0", "\"parent\": 70")
            .starts_with("segment 1: parent is 70: a parent must come")
    );
    assert!(json_error("\"radius\": ", "\"radius\": -").starts_with("segment 0: radius is -"));
    assert!(matches!(json::read(""), Err(ImportError::Json { .. })));
}

/// Some bytes of a text replaced, cut out or doubled.
fn damaged(text: String) -> impl Strategy<Value = String> {
    let n = text.len();
    let bites = prop::collection::vec((0..n, 0..12_usize, "[-+0-9eE./<^I\t\n\"{}:,naPx]{0,6}"), 1..6);
    bites.prop_map(move |bites| {
        let mut bytes = text.clone().into_bytes();
        for (at, len, by) in bites {
            let at = at.min(bytes.len());
            let end = (at + len).min(bytes.len());
            bytes.splice(at..end, by.bytes());
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

fn small() -> Skeleton {
    let text = "preset = 'small'\nbase = 'ternary'\n[tree.grammar.ternary]\n\
                derivations = { value = 2, range = [0, 8], unit = 'derivations', source = 'x' }";
    grow(&Spec::from_toml("small", text).unwrap(), 0, 0).unwrap()
}

proptest! {
    #[test]
    fn damaged_files_never_panic_and_read_trees_are_sound(
        json_text in damaged(json::write(&small())),
        mtg_text in damaged(mtg::write(&small())),
        other_text in damaged(DIGITISED.to_owned()),
    ) {
        for read in [json::read(&json_text), mtg::read(&mtg_text), mtg::read(&other_text)] {
            match read {
                Err(e) => prop_assert!(!e.to_string().is_empty()),
                Ok(tree) => for (i, s) in tree.segments().iter().enumerate() {
                    prop_assert!(s.radius > 0.0 && s.length > 0.0 && s.p_tip_world().iter().all(|x| x.is_finite()));
                    prop_assert!(s.parent.is_none_or(|p| p < i) && s.parent.is_none() == (i == 0));
                },
            }
        }
    }
}
