//! MTG files as other programs write them: every construct of the grammar, units, missing values, trees without positions.

use orchard_exchange::DigitisedTree;
use orchard_exchange::mtg::{Choice, Import, read, read_with};
use orchard_geometry::{Vec3, math};
use proptest::prelude::*;

const ROUNDING: f64 = 1e-12;

/// A file with plants P, axes A, units U and internodes E, the given columns after five columns of codes, and a body in which `>` is a tab.
fn file(columns: &str, body: &str) -> String {
    let features: String = columns.split('>').map(|name| format!("{name}\tREAL\n")).collect();
    format!(
        "# an apple tree\n\t\t\nCODE :\tFORM-A\t\n\nCLASSES :\t\nSYMBOL\tSCALE\tDECOMPOSITION\tINDEXATION\tDEFINITION\n$ \t0\tFREE\tFREE\tIMPLICIT\n\
         P \t1\tCONNECTED\tFREE\tEXPLICIT\nA\t2\t<-LINEAR\tFREE\tEXPLICIT\nB\t2\tFREE\tFREE\tEXPLICIT\nU\t3\tFREE\tFREE\tEXPLICIT\nE\t4\tNONE\tFREE\tEXPLICIT\n\n\
         DESCRIPTION :\t\nLEFT\tRIGHT\tRELTYPE\tMAX\nA\tA,B\t+\t?\nE\tE\t<\t1\n\nFEATURES:\nNAME\tTYPE\n{features}when\tDD/MM/YY\nshape\tGEOMETRY\tleaf.geom\n\n\
         MTG:\t\n\nTOPO\t\t\t\t\t{}\n{}",
        columns.replace('>', "\t"),
        body.replace('>', "\t")
    )
}

fn in_metres(columns: &str, body: &str) -> Import {
    let choice = Choice { units: Some("m".parse().unwrap()), plant: None };
    read_with(&file(columns, body), &choice).unwrap()
}

fn refusal(columns: &str, body: &str) -> String {
    read_with(&file(columns, body), &Choice::default()).unwrap_err().to_string()
}

/// Parent, order, diameter and tip of every segment.
fn wood(tree: &DigitisedTree) -> Vec<(Option<usize>, u8, f64, Vec3)> {
    tree.segments().iter().map(|s| (s.parent, s.order, 2.0 * s.radius, s.p_tip_world())).collect()
}

fn near(a: &Vec3, b: [f64; 3]) -> bool {
    (a - Vec3::new(b[0], b[1], b[2])).norm() < ROUNDING
}

#[test]
fn positions_inside_a_series_lie_on_the_line_and_unmeasured_ends_are_left_out() {
    let body = "/P1\n^/A1>>>>>5>5>1>0.04\n^/U1/E1<<E2\n>+A2/U1/E1>>>>5.3>5>1.4>0.01 # comment > \n>^<E2<<E9\n^<E3<<E4>>>>>5>5>1.8>0.02\n^<E5\n";
    let Import { tree, notes } = in_metres("XX>YY>ZZ>TopDia", body);
    let wood = wood(&tree);
    assert_eq!(wood.len(), 3);
    assert!(
        near(&wood[0].3, [0.0, 0.0, 0.4])
            && near(&wood[1].3, [0.3, 0.0, 0.4])
            && near(&wood[2].3, [0.0, 0.0, 0.8])
    );
    assert_eq!([wood[0].0, wood[1].0, wood[2].0], [None, Some(0), Some(0)]);
    assert_eq!([wood[0].1, wood[1].1, wood[2].1], [0, 1, 0]);
    // The trunk tapers from its base to its tip; the middle lies between.
    assert!((wood[0].2 - 0.03).abs() < ROUNDING, "{}", wood[0].2);
    assert!(notes[0].starts_with("9 of 14 entities without a position"), "{notes:?}");
    assert!(notes[1].starts_with("1 of 3 diameters are not in the file"), "{notes:?}");
}

/// A plant in the ways of the manual: absolute names, aliases, columns, `^`, one line, several columns of a line.
#[test]
fn all_codings_of_a_plant_give_the_same_tree() {
    let bodies = [
        "/P1/A1/U1>>>>>1\n/P1/A1/U1<U2>>>>>1\n/P1/A1/U1<U2+A2/U1>>>>>0.5\n/P1/A1/U1<U2<U3>>>>>0.25\n",
        "/P1/A1/U1>>>>>1>one\n(one)<U2>>>>>1>two\n(two)+A2/U1>>>>>0.5\n(two)<U3>>>>>0.25\n",
        "/P1/A1>>>>>\n>/U1>>>>1\n>>\n>>>\n>>+A9\n>^<U2>>>>1\n>>+A2/U1>>>0.5\n>><U3>>>0.25\n",
        "/P1/A1\n^/U1>>>>>1\n^<U2>>>>>1\n>+A2/U1>>>>0.5\n^<U3>>>>>0.25\n",
        "/P1>/A1>/U1>>>1\n>>^<U2>>>1\n>>>+A2/U1>>0.5\n>>^<U3>>>0.25\n",
    ];
    let [first, others @ ..] = bodies.map(|body| wood(&in_metres("Length>Alias", body).tree));
    assert_eq!(first.len(), 4);
    assert!(near(&first[3].3, [0.0, 0.0, 2.25]) && first[2].0 == Some(1));
    for other in others {
        assert_eq!(other, first);
    }
}

/// An axis that is coded in the columns to the right does not move the place of the column: OpenAlea's reconstructed trees.
#[test]
fn axes_follow_each_other_in_a_column() {
    let body =
        "/P1\n>/A1\n>>/U1/E1>>>0>0>1\n>>^+A2\n>>>/U1/E1>>1>0>1\n>>^+B3\n>>>/U1/E1>>0>1>1\n>>^<E2>>>0>0>2\n";
    let tree = in_metres("XX>YY>ZZ", body).tree;
    let read: Vec<_> = wood(&tree).into_iter().map(|(parent, order, ..)| (parent, order)).collect();
    assert_eq!(read, [(None, 0), (Some(0), 1), (Some(0), 1), (Some(0), 0)]);
}

#[test]
fn observations_shared_values_and_sympodial_axes() {
    let body = "/P1/A1/U1>>>>>0.3>0.03\n*>>>>>0.5\n^<.<U3>>>>>0.25>0.02\n^+U4>>>>>0.1\n>+A2++A3/U1>>>>0.2\n";
    let wood = wood(&in_metres("Length>TopDia", body).tree);
    assert_eq!(wood.len(), 5);
    // The later length, the older diameter; two units of 0.25 m; the relay is straight and of the same order.
    assert!(
        near(&wood[0].3, [0.0, 0.0, 0.5])
            && near(&wood[2].3, [0.0, 0.0, 1.0])
            && near(&wood[3].3, [0.0, 0.0, 1.1])
    );
    assert_eq!((wood[0].2, wood[3].1, wood[4].1), (0.03, 0, 1));
}

/// Lengths alone: branches leave at 60 degrees, turned by 137.5 degrees; the length of a unit is shared by its internodes.
#[test]
fn trees_without_positions_are_shaped_from_lengths() {
    let body = "/P1/A1/U1>>>>>1.0>0.04>0.02\n^/E1<<E5\n>+A2/U1>>>>0.5\n^<E6\n>+A3/U1>>>>0.5\n^<E7<<E10\n>+A4/U1/E1<E2\n";
    let Import { tree, notes } = in_metres("Length>BottomDia>TopDia", body);
    let segments = tree.segments();
    assert_eq!(segments.len(), 5);
    assert!(
        near(&segments[0].p_tip_world(), [0.0, 0.0, 0.5])
            && near(&segments[2].p_tip_world(), [0.0, 0.0, 0.6])
    );
    assert!((2.0 * segments[0].radius - 0.03).abs() < ROUNDING);
    let (one, two) = (segments[1].heading(), segments[3].heading());
    assert!((one.z - 0.5).abs() < ROUNDING && (two.z - 0.5).abs() < ROUNDING);
    let turn = (one.x * two.x + one.y * two.y) / 0.75;
    assert!((turn - math::cos(137.5_f64.to_radians())).abs() < ROUNDING, "{turn}");
    assert!(
        notes.iter().any(|note| note.contains("60.0 degrees") && note.contains("137.5 degrees")),
        "{notes:?}"
    );
    assert!(notes.iter().any(|note| note.starts_with("2 of 14 entities without a length")), "{notes:?}");
}

/// Without any diameter the pipe model holds: two twigs of 4 mm on a trunk of 4 mm * 2^(1/2.2).
#[test]
fn diameters_follow_from_the_pipes() {
    let body = "/P1/A1/U1>>>>>0>0>1\n>+A2/U1>>>>1>0>1.5\n^<U2>>>>>0>0>2\n";
    let Import { tree, notes } = in_metres("XX>YY>ZZ", body);
    let diameters: Vec<f64> = wood(&tree).into_iter().map(|w| w.2).collect();
    assert!(
        (diameters[0] - 0.004 * math::pow(2.0, 1.0 / 2.2)).abs() < ROUNDING
            && diameters[1..] == [0.004, 0.004]
    );
    assert!(notes[0].starts_with("3 of 3 diameters"), "{notes:?}");
}

#[test]
fn units_come_from_the_file_from_the_caller_or_are_metres_if_that_can_be() {
    let body = "/P1/A1/U1>>>>>0>0>1500>300\n^<U2>>>>>0>0>2809>200\n";
    let text = file("XX>YY>ZZ>TopDia", body);
    let error = read(&text).unwrap_err().to_string();
    assert!(error.contains("in metres the tree would be 2809.00 m tall, outside 0.2 to 12 m"), "{error}");
    assert!(error.ends_with("--tree-unit LENGTH,DIAMETER; the tree is 2.81 m with --tree-unit mm, 0.28 m with --tree-unit 0.1mm"), "{error}");
    let given = |unit: &str| Choice { units: Some(unit.parse().unwrap()), plant: None };
    let import = read_with(&text, &given("mm, 0.1mm")).unwrap();
    assert!(import.notes.is_empty(), "{:?}", import.notes);
    let segment = &import.tree.segments()[1];
    assert!((segment.p_tip_world().z - 2.809).abs() < ROUNDING && (segment.radius - 0.01).abs() < ROUNDING);
    let stated = format!("# unit: mm,0.1mm\n{text}");
    assert_eq!(read(&stated).unwrap(), import.tree);
    let error = read_with(&stated, &given("cm")).unwrap_err().to_string();
    assert_eq!(error, "the file states the unit mm,0.1mm, but cm is given");
    for (unit, problem) in
        [("ft", "\"ft\" is no unit"), ("0mm", "\"0mm\" is no unit"), ("mm,-1m", "\"-1m\" is no unit")]
    {
        let error = unit.parse::<orchard_exchange::mtg::Units>().unwrap_err();
        assert!(error.starts_with(problem), "{error}");
    }
    let error = read_with(&text, &given("m")).unwrap_err().to_string();
    assert_eq!(error, "line 31: TopDia is 300 m: the allowed range is [0.0002, 10] m");
}

#[test]
fn a_plant_can_be_chosen() {
    let text = file("XX>YY>ZZ", "/P1/A1/U1>>>>>0>0>1\n/P2/A1/U1>>>>>0>0>2\n^<U2>>>>>0>0>3\n");
    let of = |plant: Option<&str>| read_with(&text, &Choice { units: None, plant: plant.map(str::to_owned) });
    let first = of(None).unwrap();
    assert_eq!(first.tree.segments().len(), 1);
    assert_eq!(first.notes[0], "the file has 2 plants, P1 to P2: P1 is read");
    assert_eq!(of(Some("P2")).unwrap().tree.segments().len(), 2);
    assert_eq!(
        of(Some("P7")).unwrap_err().to_string(),
        "there is no plant \"P7\"; the file has 2 plants, P1 to P2"
    );
}

#[test]
fn errors_name_the_true_cause() {
    let columns = "XX>YY>ZZ>TopDia";
    for (body, message) in [
        ("/P1/X3\n", "line 31: class \"X\" is not declared in CLASSES"),
        (
            "/P1/A1/U5<<U2\n",
            "line 31: code \"/P1/A1/U5<<U2\": a series needs one class and growing indices, not U5 to U2",
        ),
        ("/P1/A1/U5<<\n", "line 31: code \"/P1/A1/U5<<\": a class must follow '<'"),
        ("/P1/A1<U2\n", "line 31: code \"/P1/A1<U2\": there is no entity of scale 3 before '<U2'"),
        ("/P1\n>>^/A1\n", "line 32: code \"^/A1\": there is no entity in this column"),
        ("/P1\n(q)/A1\n", "line 32: alias \"q\" is not given before"),
        ("*\n", "line 31: \"*\": there is no entity above in this column"),
        (">>>>>1>2>3\n", "line 31: \"1\" stands in a line without an entity code"),
        (
            "/P1/A1/U1<<U9999999\n",
            "line 31: code \"/P1/A1/U1<<U9999999\": a file has at most 500000 entities",
        ),
        ("/P1/A1/U1>>>>>0>0>1>-3\n", "line 31: TopDia is -3: it must not be negative"),
        ("/P1/A1/U1>>>>>0>>1\n", "line 31: some of XX, YY and ZZ are missing"),
        ("/P1/A1/U1>>>>>0>0>1\n^<U2>>>>>0>0>-1\n", "line 32: ZZ is -1, 1 (1 m) below the base of the trunk"),
        (
            "/P1/A1/U1\n",
            "P1 has neither positions (XX, YY, ZZ) nor lengths (Length) that give it a shape; the columns are: XX, YY, ZZ, TopDia",
        ),
        ("", "the file has no entity after the line of its columns"),
    ] {
        let error = refusal(columns, body);
        assert!(error.starts_with(message), "{body}: {error}");
    }
    let twice = file(columns, "").replace("U\t3\t", "A\t3\t");
    assert_eq!(read(&twice).unwrap_err().to_string(), "line 11: class A has two scales, 2 and 3");
}

proptest! {
    /// Any body of signs, classes and numbers is read or refused; what is read stands on one root.
    #[test]
    fn any_codes_are_read_or_refused(
        lines in prop::collection::vec((0..4_usize, "[\\^]?[/<+]{1,2}[PAUE][0-9]{0,2}([/<+]{1,2}[AUE][0-9]{0,1}){0,3}", 0..5_u8), 1..20),
    ) {
        let mut body = String::from("/P1/A1/U1/E1>>>>>0>0>1>0.02\n");
        for (k, (column, code, values)) in lines.iter().enumerate() {
            body.push_str(&">".repeat(*column));
            body.push_str(code);
            body.push_str(&">".repeat(5 - column));
            body.push_str(&match values {
                0 => format!("{}>0>{}>0.01\n", k % 3, 1 + k),
                1 => format!("0>0.5>{}\n", 1 + k / 2),
                _ => "\n".to_owned(),
            });
        }
        let choice = Choice { units: Some("m".parse().unwrap()), plant: None };
        for columns in ["XX>YY>ZZ>TopDia", "TopDia>BottomDia>Length>Other"] {
            match read_with(&file(columns, &body), &choice) {
                Err(e) => prop_assert!(!e.to_string().is_empty()),
                Ok(import) => for (i, s) in import.tree.segments().iter().enumerate() {
                    prop_assert!(s.parent.is_none() == (i == 0) && s.parent.is_none_or(|p| p < i));
                    prop_assert!(s.radius > 0.0 && s.length > 0.0);
                },
            }
        }
    }
}
