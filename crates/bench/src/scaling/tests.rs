//! Cells, end states, bad input, the result file.

use std::sync::atomic::AtomicBool;

use orchard_multibody::{Data, forward_kinematics};
use orchard_spec::randomisation::Mode;

use super::cell::Start;
use super::{MemoryBasis, Scaling, ScalingError, ScalingPlan, SolverName, run, trees};
use crate::Silent;
use crate::protocol::Protocol;
use crate::store::Store;

/// A plan that takes a moment.
fn small() -> ScalingPlan {
    let protocol = Protocol::paper();
    let plan = ScalingPlan::of_protocol(&protocol, "quick", &protocol.scaling.quick);
    ScalingPlan { worlds: vec![1, 3], frames: 2, repeats: 2, cell_time: 1e-6, ..plan }
}

fn go(plan: &ScalingPlan, stop: bool) -> (Result<Scaling, ScalingError>, Option<String>) {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    store.write("scaling.json", &"an older run's").unwrap();
    let result = run(plan, &store, 2, &AtomicBool::new(stop), &Silent);
    (result, std::fs::read_to_string(folder.path().join("scaling.json")).ok())
}

#[test]
fn the_protocol_asks_for_the_papers_worlds() {
    let protocol = Protocol::paper();
    let rules = &protocol.scaling;
    assert_eq!(rules.full.worlds(), [1, 2, 4, 8, 16, 32, 64, 128, 256, 512]);
    assert_eq!(rules.quick.worlds(), [1, 8, 64]);
    let plan = ScalingPlan::of_protocol(&protocol, "full", &rules.full);
    assert_eq!(plan.cells().len(), 4 * 10 * plan.solvers.len());
    assert!(plan.solvers.starts_with(&[SolverName::Lanes, SolverName::Aba, SolverName::Cg]));
    assert!(!protocol.v1_seeds().contains(&plan.seed));
    for paper in &rules.published.env_steps_per_s {
        assert!(plan.worlds.contains(&paper.worlds) && paper.low <= paper.high, "{paper:?}");
        assert_eq!(rules.published.at(paper.mode, paper.worlds), Some(paper));
    }
}

#[test]
fn batches_grow_by_a_factor_up_to_the_largest() {
    let mut effort = Protocol::paper().scaling.full;
    let mut worlds = |most, factor| {
        effort.most_worlds = effort.most_worlds.with_value(most).unwrap();
        effort.factor = effort.factor.with_value(factor).unwrap();
        effort.worlds()
    };
    assert_eq!(worlds(1, 2), [1]);
    assert_eq!(worlds(100, 3), [1, 3, 9, 27, 81, 100]);
    assert_eq!(worlds(4096, 4096), [1, 4096]);
}

#[test]
fn every_cell_has_a_row_that_reads_back() {
    let plan = small();
    let (result, text) = go(&plan, false);
    let scaling = result.unwrap();
    assert_eq!(serde_json::from_str::<Scaling>(&text.unwrap()).unwrap(), scaling);
    let rows: Vec<_> = scaling.rows.iter().map(|row| (row.mode, row.worlds, row.solver)).collect();
    let cells: Vec<_> = plan.cells().iter().map(|cell| (cell.mode, cell.worlds, cell.solver)).collect();
    assert_eq!(rows, cells);
    for row in &scaling.rows {
        let [least, most] = row.spread;
        assert!(least > 0.0 && least <= row.step_rate_per_s && row.step_rate_per_s <= most, "{row:?}");
        assert_eq!(row.env_steps_per_s, row.step_rate_per_s * f64::from(row.worlds));
        assert!(row.repeats == 2 && row.courses >= 2 && row.unfinite == 0, "{row:?}");
        // Nearly all fruit that is asked for finds a place on every tree.
        assert!((35.0..=40.0).contains(&row.fruit_per_tree), "{row:?}");
        let is_lanes = row.solver == SolverName::Lanes;
        assert_eq!(row.memory_basis == MemoryBasis::Numbers, is_lanes);
        assert!(!is_lanes || row.memory_mib.unwrap() > 0.0);
    }
    let left_out = SolverName::ALL.into_iter().filter(|solver| !solver.is_built());
    assert_eq!(scaling.left_out, left_out.collect::<Vec<_>>());
}

/// What differs between worlds is what the mode says, and all of them move.
#[test]
fn modes_differ_in_what_their_worlds_share() {
    let plan = small();
    for mode in Mode::ALL {
        let worlds = trees::worlds(&plan, mode, 3).unwrap();
        let [first, .., last] = &worlds[..] else { unreachable!() };
        let (a, b) = (first.plant(), last.plant());
        assert_eq!(std::sync::Arc::ptr_eq(a, b), mode == Mode::Homogeneous);
        assert_eq!(a.tree.parent == b.tree.parent, mode != Mode::DistinctTopology, "{mode:?}");
        let lengths = |world: &orchard_batch::TreeWorld| -> Vec<f64> {
            world.plant().model.bodies().iter().map(|body| 2.0 * body.inertia.p_com.norm()).collect()
        };
        let alike = matches!(mode, Mode::Homogeneous | Mode::SharedDimensions);
        assert_eq!(lengths(first) == lengths(last), alike, "{mode:?}");
        assert_ne!(first.data().v, last.data().v);
    }
}

/// All solvers of a cell go through the same states: those in f64 by the tolerance of conjugate gradients, lanes by what f32 keeps
/// of a position (`crates/batch/tests/lanes/accuracy.rs` says why).
#[test]
fn all_solvers_end_a_course_in_the_same_states() {
    let plan = small();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let worlds = trees::worlds(&plan, Mode::DistinctTopology, 2).unwrap();
    let tips = |solver: SolverName| -> Vec<Vec<[f64; 3]>> {
        let (_, end) = Start::new(&worlds, solver).unwrap().course(6, &pool);
        worlds
            .iter()
            .enumerate()
            .map(|(index, world)| {
                let mut data: Data = world.data().clone();
                end.store(index, &mut data);
                forward_kinematics(&world.plant().model, &mut data);
                let links = world.plant().tree.bodies.iter();
                links.map(|body| data.x_world_body(*body).translation.vector.into()).collect()
            })
            .collect()
    };
    let apart = |a: &[Vec<[f64; 3]>], b: &[Vec<[f64; 3]>]| {
        let pairs = a.iter().flatten().flatten().zip(b.iter().flatten().flatten());
        pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()))
    };
    let reference = tips(SolverName::Aba);
    let start: Vec<Vec<[f64; 3]>> = worlds
        .iter()
        .map(|w| {
            w.plant()
                .tree
                .bodies
                .iter()
                .map(|b| w.data().x_world_body(*b).translation.vector.into())
                .collect()
        })
        .collect();
    assert!(apart(&reference, &start) > 1e-2, "nothing moved");
    for solver in small().solvers {
        let tolerance = if solver == SolverName::Lanes { 5e-5 } else { 1e-9 };
        let error = apart(&tips(solver), &reference);
        assert!(error < tolerance, "{solver:?}: {error:e} m");
    }
}

#[test]
fn what_cannot_be_timed_is_refused() {
    let refused = |plan: ScalingPlan| {
        let (result, file) = go(&plan, false);
        assert!(file.is_some(), "nothing is touched");
        result.unwrap_err().to_string()
    };
    for plan in [
        ScalingPlan { modes: Vec::new(), ..small() },
        ScalingPlan { worlds: Vec::new(), ..small() },
        ScalingPlan { worlds: vec![0, 1], ..small() },
        ScalingPlan { worlds: vec![2, 1], ..small() },
        ScalingPlan { solvers: Vec::new(), ..small() },
        ScalingPlan { repeats: 0, ..small() },
        ScalingPlan { frames: 0, ..small() },
    ] {
        assert!(refused(plan).starts_with("no cell to time"));
    }
    if !SolverName::Cholesky.is_built() {
        let line = refused(ScalingPlan { solvers: vec![SolverName::Cholesky], ..small() });
        assert_eq!(line, "this build has no solver cholesky: it needs the feature `cholesky`");
    }
}

#[test]
fn an_interrupted_run_leaves_no_figures() {
    let (result, file) = go(&small(), true);
    let line = result.unwrap_err().to_string();
    let cells = small().cells().len();
    assert_eq!(line, format!("interrupted after 0 of {cells} cells of the scaling task, which begins anew"));
    assert_eq!(file, None);
}

#[test]
fn bad_rules_are_named() {
    let text = crate::protocol::PAPER_TOML;
    let refused = |from: &str, to: &str| {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text);
        Protocol::from_toml("x.toml", &changed).unwrap_err().to_string()
    };
    let e = refused("factor = { value = 2", "factor = { value = 1");
    assert!(e.contains("scaling.full.factor") && e.contains("[2, 4096]"), "{e}");
    let e = refused("mode = \"homogeneous\"", "mode = \"equal\"");
    assert!(e.contains("equal") && e.contains("homogeneous"), "{e}");
}
