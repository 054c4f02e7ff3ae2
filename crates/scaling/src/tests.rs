//! Cells, end states, bad input, the result file.

use std::sync::atomic::AtomicBool;

use orchard_bench::NoProgress;
use orchard_bench::store::Store;
use orchard_multibody::{Data, forward_kinematics};
use orchard_scenario::Scenario;
use orchard_spec::randomisation::Mode;
use orchard_spec::{Preset, Spec};
use orchard_tasks::plan_file::Backend;
use orchard_tasks::protocol::Protocol;

use super::{
    AxesPlan, AxisKind, Limits, MemoryBasis, Scaling, ScalingError, ScalingPlan, ScalingRules, SolverName,
    axes, measure, run, trees,
};
use crate::cell::{BatchStart, course};
use crate::plan::Cell;
use crate::results::Row;
use crate::trees::Worlds;

fn scenario() -> Scenario {
    Scenario::of(&[]).unwrap()
}

fn rules() -> ScalingRules {
    ScalingRules::of(&Protocol::paper()).unwrap()
}

/// A plan that takes a moment.
fn small() -> ScalingPlan {
    let plan = ScalingPlan::new(&scenario(), "quick", &rules().quick, Backend::Cpu).unwrap();
    ScalingPlan { worlds: vec![1, 3], frames: 2, repeats: 2, cell_time: 1e-6, ..plan }
}

fn go(plan: &ScalingPlan, stop: bool) -> (Result<Scaling, ScalingError>, Option<String>) {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path()).unwrap();
    store.write("scaling.json", &serde_json::json!({ "run": "older" })).unwrap();
    let result = run(plan, None, &store, 2, &AtomicBool::new(stop), &NoProgress);
    (result, std::fs::read_to_string(folder.path().join("scaling.json")).ok())
}

#[test]
fn the_protocol_asks_for_the_papers_worlds() {
    let protocol = Protocol::paper();
    let rules = rules();
    assert_eq!(rules.full.worlds(), [1, 2, 4, 8, 16, 32, 64, 128, 256, 512]);
    assert_eq!(rules.quick.worlds(), [1, 8, 64]);
    let plan = ScalingPlan::new(&scenario(), "full", &rules.full, Backend::Cpu).unwrap();
    assert_eq!(plan.cells().len(), 4 * 10 * plan.solvers.len());
    assert!(plan.solvers.starts_with(&[SolverName::Lanes, SolverName::Aba, SolverName::Cg]));
    assert!(!protocol.official_seeds().contains(&plan.seed));
    for paper in &rules.published.env_steps_per_s {
        assert!(plan.worlds.contains(&paper.worlds) && paper.low <= paper.high, "{paper:?}");
        assert_eq!(rules.published.at(paper.mode, paper.worlds), Some(paper));
    }
}

/// On the default scenario the worlds are those of preset `randomised`; another scenario gives its own, and its own strengths stay.
#[test]
fn worlds_are_the_scenarios() {
    let of = |options: &[(&str, &str)]| {
        let scenario = Scenario::of(options).unwrap();
        (*ScalingPlan::new(&scenario, "quick", &rules().quick, Backend::Cpu).unwrap().spec).clone()
    };
    let randomised = Spec::preset(Preset::Randomised);
    assert_eq!(Spec { preset: randomised.preset.clone(), ..of(&[]) }.randomisation, randomised.randomisation);
    assert_eq!(Spec { randomisation: randomised.randomisation.clone(), ..Spec::paper() }, of(&[]));
    assert_eq!(of(&[("preset", "randomised")]), randomised);
    let half = of(&[("randomisation", "0.5")]);
    assert_eq!(half.randomisation.scale.strength.si(), 0.5);
    assert_eq!(of(&[("preset", "v-trellis")]).preset, "v-trellis");
}

#[test]
fn batches_grow_by_a_factor_up_to_the_largest() {
    let mut effort = rules().full;
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
        assert_eq!(row.substeps_per_s, row.env_steps_per_s * f64::from(scaling.substeps));
        assert!(row.grow_s > 0.0 && row.pack_s > 0.0 && row.note.is_none(), "{row:?}");
        assert!(row.repeats == 2 && row.courses >= 2 && row.unfinite == 0, "{row:?}");
        // Nearly all requested fruit is placed on every tree.
        assert!((35.0..=40.0).contains(&row.fruit_per_tree), "{row:?}");
        let is_lanes = row.solver == SolverName::Lanes;
        assert_eq!(row.memory_basis == MemoryBasis::Numbers, is_lanes);
        assert!(!is_lanes || row.memory_mib.unwrap() > 0.0);
    }
    let is_left_out = |solver: &SolverName| solver.backend() == Backend::Cpu && !solver.is_built();
    assert_eq!(scaling.left_out, SolverName::ALL.into_iter().filter(is_left_out).collect::<Vec<_>>());
    assert_eq!((scaling.backend, scaling.adapter, scaling.omitted.len()), (Backend::Cpu, None, 0));
}

/// The worlds of a batch differ exactly as the mode says, and all of them move.
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
        let worlds_again = Worlds { count: 2, world: &|index| worlds[index as usize].clone() };
        let mut end = BatchStart { worlds: worlds_again, solver, gpu: None }.batch().unwrap();
        course(&mut *end, 6, &pool).unwrap();
        worlds
            .iter()
            .enumerate()
            .map(|(index, world)| {
                let mut data: Data = world.data().clone();
                end.store(index, &mut data).unwrap();
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
        assert!(refused(plan).starts_with("the plan has no cell"));
    }
    if !SolverName::Cholesky.is_built() {
        let line = refused(ScalingPlan { solvers: vec![SolverName::Cholesky], ..small() });
        assert_eq!(line, "this build lacks the solver cholesky: it needs the feature `cholesky`");
    }
}

#[test]
fn an_interrupted_run_leaves_no_figures() {
    let (result, file) = go(&small(), true);
    let line = result.unwrap_err().to_string();
    let cells = small().cells().len();
    assert_eq!(
        line,
        format!("interrupted after 0 of {cells} cells; the scaling task must be run again from the start")
    );
    assert_eq!(file, None);
}

#[test]
fn bad_rules_are_named() {
    let text = orchard_tasks::protocol::PAPER_TOML;
    let refused = |from: &str, to: &str| {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text);
        ScalingRules::of(&Protocol::from_toml("x.toml", &changed).unwrap()).unwrap_err().to_string()
    };
    let e = refused("factor = { value = 2", "factor = { value = 1");
    assert!(e.contains("scaling.full.factor") && e.contains("[2, 4096]"), "{e}");
    let e = refused("backend = \"cpu\"", "backend = \"tpu\"");
    assert!(e.contains("x.toml") && e.contains("scaling.backend") && e.contains("tpu"), "{e}");
    assert!(e.contains("`cpu` or `gpu`"), "{e}");
    let e = refused("mode = \"homogeneous\"", "mode = \"equal\"");
    assert!(e.contains("equal") && e.contains("homogeneous"), "{e}");
}

/// Worlds beyond the kinds share the plants of the first and move by themselves.
#[test]
fn plants_repeat_and_kicks_do_not() {
    let plan = ScalingPlan { kinds: 2, ..small() };
    let mut forest = trees::Forest::new(&plan, Mode::DistinctTopology);
    for count in [1, 3, 5] {
        forest.grow(count).unwrap();
    }
    let worlds: Vec<_> = (0..5).map(|index| forest.world(index)).collect();
    let shares = |a: usize, b: usize| std::sync::Arc::ptr_eq(worlds[a].plant(), worlds[b].plant());
    assert!(shares(0, 2) && shares(1, 3) && shares(0, 4) && !shares(0, 1));
    let v = |index: usize| &worlds[index].data().v;
    assert!(v(0) != v(2) && v(2) != v(4));
    // The result does not depend on the number of worlds grown at a time.
    let at_once = trees::worlds(&plan, Mode::DistinctTopology, 5).unwrap();
    assert!(at_once.iter().zip(&worlds).all(|(a, b)| a.data().v == b.data().v && a.data().q == b.data().q));
}

/// A cell that would take too much time or memory is omitted with the reason, not timed.
#[test]
fn cells_over_a_limit_are_left_out() {
    let measured = |limits| {
        let plan = ScalingPlan {
            limits: Some(limits),
            modes: vec![Mode::Homogeneous],
            solvers: vec![SolverName::Lanes],
            ..small()
        };
        measure(&plan, None, 1, &AtomicBool::new(false), &NoProgress).unwrap()
    };
    let slow = measured(Limits { cell_time: 1e-9, memory_share: 1.0 });
    assert_eq!((slow.rows.len(), slow.omitted.len()), (1, 1));
    assert_eq!(slow.omitted[0].worlds, 3);
    assert!(slow.omitted[0].why.starts_with("estimated time 0 s, limit 0 s"), "{:?}", slow.omitted);
    let free = measured(Limits { cell_time: 60.0, memory_share: 1.0 });
    assert_eq!((free.rows.len(), free.omitted.len()), (2, 0));
    // A world of a megabyte: in lanes no more than a chunk of them, and the numbers of a smaller batch in proportion.
    let needed = |solver, smaller| {
        run::bytes_needed(&Cell { mode: Mode::Homogeneous, worlds: 65536, solver }, 1e6, smaller)
    };
    assert_eq!(needed(SolverName::Aba, None), 65536e6);
    assert_eq!(needed(SolverName::Lanes, None), 8192e6);
    let smaller = Row { worlds: 4, memory_mib: Some(1.0), ..free.rows[0].clone() };
    assert_eq!(needed(SolverName::Lanes, Some(&smaller)), 8192e6 + 16384.0 * 1024.0 * 1024.0);
}

/// Each kind of randomisation acts, and no other with it.
#[test]
fn kinds_of_randomisation_act_alone() {
    let plan = small();
    let axes_plan = AxesPlan { worlds: 2, damping: (0.5, 2.0) };
    let identical = axes::worlds_of(&plan, &axes_plan, None).unwrap();
    let [a, b] = &identical[..] else { unreachable!() };
    assert!(std::sync::Arc::ptr_eq(a.plant(), b.plant()));
    for kind in AxisKind::ALL {
        let worlds = axes::worlds_of(&plan, &axes_plan, Some(kind)).unwrap();
        let [a, b] = [&worlds[0], &worlds[1]].map(|world| world.plant());
        assert!(worlds.iter().all(|world| world.data().v.iter().all(|v| *v == 0.0)), "settled");
        assert_eq!(a.tree.parent, b.tree.parent);
        let mass =
            |p: &orchard_batch::Plant| p.model.bodies().iter().map(|b| b.inertia.mass).collect::<Vec<_>>();
        let com = |p: &orchard_batch::Plant| {
            p.model.bodies().iter().map(|b| b.inertia.p_com.norm()).collect::<Vec<_>>()
        };
        let fruit = |p: &orchard_batch::Plant| p.fruit.fruit.iter().map(|f| f.mass).collect::<Vec<_>>();
        let is = |of: AxisKind| kind == of;
        assert_eq!(com(a) != com(b), is(AxisKind::Size), "{kind:?}");
        assert_eq!(mass(a) != mass(b), is(AxisKind::Size) || is(AxisKind::Mass), "{kind:?}");
        let stiffer = is(AxisKind::Stiffness) || is(AxisKind::Size);
        assert_eq!(a.tree.stiffness != b.tree.stiffness, stiffer, "{kind:?}");
        assert_eq!(a.tree.damping != b.tree.damping, stiffer || is(AxisKind::Damping), "{kind:?}");
        if is(AxisKind::FruitAndLeaves) {
            assert_ne!(fruit(a), fruit(b));
        }
    }
}

/// The plan for a software adapter is short, and its note says so.
#[test]
fn little_is_left_of_the_plan_in_software() {
    let whole = ScalingPlan::study(&scenario(), Backend::Gpu, false).unwrap();
    assert_eq!(whole.worlds.last(), Some(&65536));
    assert_eq!(whole.solvers, SolverName::built_for(Backend::Gpu));
    assert!(whole.solvers.starts_with(&[SolverName::DeviceAba]) && whole.note.is_none());
    let cut = whole.for_software(&rules());
    assert_eq!((cut.worlds, cut.frames), (vec![1, 2, 4, 8], 6));
    assert!(cut.note.is_some_and(|note| note.contains("software") && note.contains("8 worlds")));
    let cpu = ScalingPlan::study(&scenario(), Backend::Cpu, false).unwrap();
    assert_eq!(cpu.worlds.last(), Some(&65536));
}
