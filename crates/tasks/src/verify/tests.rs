use std::sync::atomic::AtomicBool;

use orchard_bench::task::NoProgress;
use orchard_robot::{Command, RobotModel};
use orchard_scenario::Scenario;

use super::*;
use crate::protocol::Protocol;

const LONGEST: f64 = 600.0;

fn csv(text: &str) -> Result<Trajectory, String> {
    Trajectory::from_csv("t.csv", text, &RobotModel::paper(), LONGEST).map_err(|e| e.to_string())
}

fn lines(text: &str) -> Result<Trajectory, String> {
    Trajectory::from_json_lines("t.jsonl", text, &RobotModel::paper(), LONGEST).map_err(|e| e.to_string())
}

/// Rows from the start posture: (time, change of q1, forward speed).
fn table(rows: &[(f64, f64, f64)]) -> String {
    let start = RobotModel::paper().start_command();
    let mut text = fields(7).join(",") + "\n";
    for &(time, turned, forward) in rows {
        let mut command = Command { base_velocity: [forward, 0.0, 0.0], ..start };
        command.arm_q[0] += turned;
        text +=
            &Row { time, command }.values()[..13].iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        text.push('\n');
    }
    text
}

#[test]
fn both_formats_read_the_same_and_write_back() {
    let text = table(&[(0.0, 0.0, 0.0), (1.0, 0.5, 0.2)]);
    let trajectory = csv(&text).unwrap();
    assert_eq!(trajectory.warnings(), [""; 0]);
    assert_eq!(trajectory.to_csv(), text);
    let json: String = trajectory
        .rows()
        .iter()
        .map(|Row { time, command: c }| {
            format!(
                "{{\"time\":{time},\"arm_q\":{:?},\"base_velocity\":{:?},\"finger_q\":{},\"finger_force\":{}}}\n\n",
                c.arm_q, c.base_velocity, c.finger_q, c.finger_force
            )
        })
        .collect();
    assert_eq!(lines(&json).unwrap(), trajectory);
    // Columns may be in any order.
    let turned: Vec<String> =
        text.lines().map(|line| line.split(',').rev().collect::<Vec<_>>().join(",")).collect();
    assert_eq!(csv(&turned.join("\n")).unwrap(), trajectory);
}

#[test]
fn between_rows_all_numbers_are_linear_and_the_ends_are_held() {
    let trajectory = csv(&table(&[(1.0, 0.0, 0.1), (2.0, 0.4, 0.3)])).unwrap();
    let q0 = RobotModel::paper().start_command().arm_q[0];
    for (time, turned, forward) in [
        (0.0, 0.0, 0.0),
        (1.0, 0.0, 0.1),
        (1.5, 0.2, 0.2),
        (1.75, 0.3, 0.25),
        (2.0, 0.4, 0.0),
        (9.0, 0.4, 0.0),
    ] {
        let command = trajectory.at(time);
        assert!((command.arm_q[0] - q0 - turned).abs() < 1e-15, "{time}");
        assert!((command.base_velocity[0] - forward).abs() < 1e-15, "{time}");
    }
}

#[test]
fn what_is_wrong_is_told_with_line_field_value_and_range() {
    let good = table(&[(0.0, 0.0, 0.0), (1.0, 0.1, 0.0)]);
    let refused = |from: &str, to: &str| {
        let text = good.replacen(from, to, 1);
        assert_ne!(text, good);
        csv(&text).unwrap_err()
    };
    assert_eq!(refused("\n1,", "\n0,"), "t.csv: line 3: time: 0 s is not greater than the previous time 0 s");
    assert_eq!(refused("\n1,", "\nx,"), "t.csv: line 3: time: 'x' is not a number");
    assert_eq!(refused("\n1,", "\nNaN,"), "t.csv: line 3: time: NaN is not a finite number");
    assert_eq!(refused("\n0,", "\n-1,"), "t.csv: line 2: time: -1 is outside the allowed range [0, 600] s");
    assert_eq!(refused("\n1,", "\n"), "t.csv: line 3: 12 cells, but the header has 13 columns");
    assert_eq!(refused("wz", "wx").split(';').next(), Some("t.csv: line 1: unknown column 'wx'"));
    assert_eq!(refused("wz", "vy"), "t.csv: line 1: column 'vy' occurs twice");
    assert_eq!(csv("time\n0\n").unwrap_err(), "t.csv: line 1: column 'q1' is missing");
    assert_eq!(csv(&(fields(7).join(",") + "\n")).unwrap_err(), "t.csv: line 1: no rows");
    assert!(csv("").is_err());
    let far = csv(&table(&[(0.0, 9.0, 0.0)])).unwrap_err();
    assert!(
        far.starts_with("t.csv: line 2: q1: ") && far.contains("is outside the allowed range ["),
        "{far}"
    );
    assert!(lines("{\"time\":0}").unwrap_err().starts_with("t.jsonl: line 1: missing field `arm_q`"));
    assert!(lines("\n{\"time\":0,\"q\":1}").unwrap_err().starts_with("t.jsonl: line 2: unknown field `q`"));
}

#[test]
fn what_the_robot_cannot_follow_is_a_warning() {
    let warnings = |rows: &[(f64, f64, f64)]| csv(&table(rows)).unwrap().warnings().to_vec();
    let fast = warnings(&[(0.0, 0.0, 0.0), (0.1, 0.5, 0.0)]);
    assert!(fast.len() == 1 && fast[0].starts_with("t.csv: line 3: q1: 5.000 rad/s exceeds"), "{fast:?}");
    let fast = warnings(&[(0.0, 0.0, -3.0)]);
    assert!(fast.len() == 1 && fast[0].starts_with("t.csv: line 2: vx: 3.000 m/s exceeds"), "{fast:?}");
    let jump = warnings(&[(0.0, 0.2, 0.0)]);
    assert!(jump.len() == 1 && jump[0].contains("from the robot's start posture"), "{jump:?}");
}

fn plan(text: &str) -> VerifyPlan {
    VerifyPlan {
        scenario: Scenario::of(&[("preset", "randomised")]).unwrap(),
        trajectory: csv(text).unwrap(),
        seeds: vec![20250704],
        trees: 2,
        protocol: Protocol::paper(),
    }
}

fn report(plan: &VerifyPlan, threads: usize) -> String {
    let trees = run(plan, threads, &AtomicBool::new(false), &NoProgress).unwrap();
    serde_json::to_string(&Report::of_run(plan, "t.csv", trees)).unwrap()
}

#[test]
fn a_robot_that_stands_touches_nothing() {
    let plan = plan(&table(&[(0.0, 0.0, 0.0), (0.5, 0.0, 0.0)]));
    for tree in &run(&plan, 2, &AtomicBool::new(false), &NoProgress).unwrap() {
        assert_eq!((&tree.quarantined, tree.branches_snapped, tree.fruit_dropped), (&None, 0, 0));
        assert_eq!((tree.contact_impulse_n_s, tree.peak_contact_force_n), (0.0, 0.0));
        // At rest under gravity but for roundings of the equilibrium.
        assert!(tree.peak_moment_excess < 1e-6 && tree.peak_moment_ratio > 0.0, "{tree:?}");
    }
}

/// Straight ahead for 3 s at 0.8 m/s: into the canopy.
#[test]
fn a_drive_into_the_tree_is_told_and_repeats_for_any_number_of_threads() {
    let plan = plan(&table(&[(0.0, 0.0, 0.8), (3.0, 0.0, 0.8)]));
    let one = report(&plan, 1);
    assert_eq!(one, report(&plan, 2));
    let read: Report = serde_json::from_str(&one).unwrap();
    assert!(read.trees.iter().all(|tree| tree.contact_impulse_n_s > 0.0), "{:?}", read.trees);
    assert!(read.trees.iter().all(|tree| tree.peak_moment_excess > 0.0 && tree.moment_excess_s > 0.0));
    let impulse = &read.metrics["contact_impulse_n_s"];
    let mean = read.trees.iter().map(|tree| tree.contact_impulse_n_s).sum::<f64>() / 2.0;
    assert!((impulse.mean.unwrap() / mean - 1.0).abs() < 1e-12 && impulse.n == 2);
    assert!(read.trees.iter().all(|tree| (tree.duration_s - 4.5).abs() < 1e-9));
}

#[test]
fn an_interrupted_run_has_no_report() {
    let plan = plan(&table(&[(0.0, 0.0, 0.0)]));
    let e = run(&plan, 1, &AtomicBool::new(true), &NoProgress).unwrap_err();
    assert_eq!(e.to_string(), "interrupted after 0 of 2 trees; nothing was written");
}

/// The example that comes with the project is valid, within the robot's limits but for a few speeds, and meets trees.
#[test]
fn the_example_runs() {
    let text = include_str!("../../../../assets/trajectories/baseline-reach.csv");
    let plan = VerifyPlan { trees: 3, ..plan(text) };
    assert!(plan.trajectory.rows().len() > 100 && plan.trajectory.duration() == 20.0);
    let trees = run(&plan, 2, &AtomicBool::new(false), &NoProgress).unwrap();
    assert!(trees.iter().all(|tree| tree.quarantined.is_none()));
    assert!(trees.iter().any(|tree| tree.contact_impulse_n_s > 0.0));
}
