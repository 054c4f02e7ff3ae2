//! Stems that bend and wind on the device at hand, against the f64 worlds. The suite `steppers` of the workspace compares motions, events and resets.

use orchard_batch::{TreeEvent, TreeWorld};
use orchard_fruit::Release;
use orchard_geometry::Vec3;
use orchard_multibody::energy;

use crate::memory::Memory;
use crate::testing::device;
use crate::trees::{bits, in_wind, kick, on_tethers_in_wind, state, stemmed};
use crate::trials::Trial;
use crate::{GpuBatch, Options, Solver};

/// Speed of the wind [m/s].
const WIND: f64 = 6.0;

/// The energy of the device's own state, computed in f64: rods, hanging fruit, and fruit that came off their rods.
#[test]
fn energy_of_stems_is_that_of_f64() {
    let Some(gpu) = device() else { return };
    let mut worlds = stemmed(3);
    kick(&mut worlds, 0.5);
    let mut batch = GpuBatch::new(&gpu, &worlds).unwrap();
    for (index, world) in worlds.iter().enumerate() {
        batch.pull(index, 0, Vec3::new(0.5, 0.0, -2.0) * world.plant().fruit.fruit[0].detach_force);
    }
    for _ in 0..12 {
        let statistics = batch.statistics().unwrap();
        for (index, world) in worlds.iter().enumerate() {
            let (plant, data) = (world.plant(), state(&mut batch, world, index));
            let truth = energy(&plant.model, &data, &plant.settings.gravity);
            let found = f64::from(statistics[index].energy);
            let error = (found - truth.total()).abs();
            assert!(error < 2e-6 * truth.gravitational.abs(), "world {index}: {found} J, {truth:?}");
        }
        batch.advance(1);
    }
    assert!(batch.statistics().unwrap().iter().all(|world| world.detached > 0));
}

/// Worlds on stems and in wind have the same bits alone, beside others, in tiles of their own, and whoever sets their air.
#[test]
fn worlds_in_wind_have_their_own_bits() {
    let Some(gpu) = device() else { return };
    for (worlds, solver) in [
        (in_wind(3, WIND), Solver::Aba),
        (in_wind(3, WIND), Solver::ConjugateGradients),
        (on_tethers_in_wind(3, WIND), Solver::Aba),
    ] {
        let (worlds, trial) = Trial::harsh(worlds);
        let batch = |tiles: usize, of: &[TreeWorld], trial: &Trial| {
            let options = Options { tiles: Some(tiles), solver, ..Options::default() };
            let mut batch = GpuBatch::with_options(&gpu, of, options).unwrap();
            // As in a batch of many tiles.
            batch.memory.laws.air_aside &= tiles == 1;
            batch.memory.laws.press_aside &= tiles == 1;
            trial.apply_to_batch(&mut batch);
            batch.advance(6);
            batch.advance(6);
            batch
        };
        let (mut together, mut spread) = (batch(1, &worlds, &trial), batch(3, &worlds, &trial));
        for (index, world) in worlds.iter().enumerate() {
            let mut alone = batch(1, std::slice::from_ref(world), &trial.of_world(index));
            let truth = bits(&state(&mut alone, world, 0));
            assert_eq!(bits(&state(&mut together, world, index)), truth, "world {index}");
            assert_eq!(bits(&state(&mut spread, world, index)), truth, "world {index}");
        }
        assert!(!together.events().unwrap().is_empty());
    }
}

/// A pull on a fruit stays on in wind, frame after frame, until the stem gives way as in f64; without the pull it holds.
#[test]
fn a_pull_stays_on_in_wind() {
    const FRAMES: u32 = 30;
    let Some(gpu) = device() else { return };
    let worlds = in_wind(1, WIND);
    let plant = worlds[0].plant().clone();
    let pull = Vec3::new(0.0, 0.0, -0.9 * plant.fruit.fruit[0].detach_force);
    let is_off = |event: &TreeEvent| matches!(event, TreeEvent::Detached { fruit: 0, .. });
    let detached = |batch: &mut GpuBatch| -> Vec<u32> {
        batch.advance(FRAMES);
        let events = batch.events().unwrap().into_iter();
        events.filter(|e| is_off(&e.event)).map(|e| e.frame).collect()
    };
    let mut held = GpuBatch::new(&gpu, &worlds).unwrap();
    assert!(detached(&mut held).is_empty());
    let mut pulled = GpuBatch::new(&gpu, &worlds).unwrap();
    pulled.pull(0, 0, pull);
    let found = detached(&mut pulled);
    let mut world = worlds[0].clone();
    world.data_mut().point_force_world[plant.fruit.points[0].index()] = pull;
    let truth: Vec<u32> = (1..=FRAMES).filter(|_| world.step().iter().any(is_off)).collect();
    assert_eq!(found, truth);
    assert!(truth.iter().all(|frame| *frame > 1) && truth.len() == 1, "{truth:?}");
}

/// A spur that is the weaker tears, and a zone without strength against twist is twisted off by the swing: both as in f64, by elimination and by conjugate gradients.
#[test]
fn weak_spurs_tear_and_weak_zones_twist_off() {
    const FRAMES: u32 = 30;
    let Some(gpu) = device() else { return };
    let spec = stemmed(1)[0].plant().spec.clone();
    let skeleton = orchard_treegen::grow(&spec, 7, 0).unwrap();
    let mut fruit = orchard_fruit::place(&spec.fruit, &skeleton, 7, 0);
    (fruit[0].spur_strength, fruit[1].twist_strength) = (0.1 * fruit[0].detach_force, 1e-3);
    let pull = Vec3::new(0.0, 0.0, -0.2) * fruit[0].detach_force;
    let mut start = TreeWorld::new(spec, &skeleton, fruit).unwrap();
    let plant = start.plant().clone();
    // A quick turn of fruit 1 about its stem.
    let stem = plant.model.dofs(plant.fruit.stem(1).unwrap());
    start.data_mut().v[stem.start + 2] = 3.0;
    for solver in [Solver::Aba, Solver::ConjugateGradients] {
        let mut world = start.clone();
        let options = Options { solver, ..Options::default() };
        let mut batch = GpuBatch::with_options(&gpu, std::slice::from_ref(&world), options).unwrap();
        batch.pull(0, 0, pull);
        world.data_mut().point_force_world[plant.fruit.points[0].index()] = pull;
        batch.advance(FRAMES);
        let found: Vec<(u32, TreeEvent)> =
            batch.events().unwrap().into_iter().map(|e| (e.frame, e.event)).collect();
        let truth: Vec<(u32, TreeEvent)> = (1..=FRAMES)
            .flat_map(|frame| world.step().into_iter().map(move |event| (frame, event)))
            .collect();
        assert_eq!(found, truth, "{solver:?}");
        for (fruit, way) in [(0, Release::Spur), (1, Release::Twist)] {
            let event = TreeEvent::Detached { fruit, release: Some(way) };
            assert!(truth.iter().any(|(_, found)| *found == event), "{truth:?}");
        }
    }
}

/// Worlds on tethers in still air have the memory that they had before there were stems and wind: 36 numbers of a fruit, 16 of a link.
#[test]
fn stems_and_wind_take_memory_only_where_they_are() {
    let memory = |worlds: &[TreeWorld]| Memory::new(worlds, 1, Solver::Aba).unwrap();
    let [plain, stems, windy] = [crate::trees::measured(1), stemmed(1), in_wind(1, WIND)];
    let plain = memory(&plain);
    let rows = plain.operations.len() / crate::layout::LANES;
    assert_eq!(plain.links.len(), rows * (16 + 4) * crate::layout::LANES);
    assert_eq!(plain.fruit.len() % (36 * crate::layout::LANES), 0);
    let [stems, windy] = [memory(&stems), memory(&windy)];
    assert_eq!(plain.links.len(), stems.links.len());
    assert_eq!(plain.fruit.len() * 60, stems.fruit.len() * 36);
    assert_eq!(plain.fruit.len() * 68, windy.fruit.len() * 36);
    let places = 4 * windy.rules.fours as usize;
    let air = rows * 8 + 72 * (8 + 2 * places) + 13 * places;
    assert!(places > 0);
    assert_eq!(windy.links.len(), plain.links.len() + air * crate::layout::LANES);
}
