//! Draws of the twin, against the streams and the plantings of the host.

use std::sync::Arc;

use orchard_batch::TreeWorld;
use orchard_geometry::Vec3;
use orchard_spec::randomisation::{Axis, Mode};
use orchard_spec::wood::JointLaw;
use orchard_spec::{Preset, Spec};
use orchard_treegen::grow;
use orchard_world::Planting;

use super::Lane;
use crate::Solver;
use crate::layout::{LANES, fourth, fruit, link};
use crate::memory::Memory;
use crate::table::{AXES, BaseTree};

pub(crate) const SEED: u64 = 23;
/// Error of a direction, and relative error of a number. A limb is 20 links long and more, each with a few roundings of its own, and a limit has ten times the relative error of
/// a radius; the largest error found is a quarter of this.
pub(crate) const TOLERANCE: f64 = 5e-6;

/// The preset with given strengths. Visibility of fruit, which only the host draws, has strength 0.
pub(crate) fn spec(mode: Mode, strength: impl Fn(Axis) -> f64) -> Spec {
    let mut spec = Spec::preset(Preset::Randomised);
    spec.randomisation.mode = mode;
    for &axis in Axis::ALL {
        let dial = spec.randomisation.strength_mut(axis);
        let strength = if axis == Axis::FruitVisible { 0.0 } else { strength(axis) };
        *dial = dial.with_value(strength).unwrap();
    }
    spec
}

pub(crate) fn base_of(spec: &Spec) -> BaseTree {
    let skeleton = grow(spec, SEED, 0).unwrap();
    let planting = Planting::of_tree(Arc::new(spec.clone()), skeleton, SEED, 0);
    BaseTree::new(planting.spec, &planting.skeleton, planting.fruit, SEED).unwrap()
}

/// World as drawn by the host.
pub(crate) fn planted(spec: &Spec, world: u32, episode: u32) -> TreeWorld {
    let planting = Planting::draw(&Arc::new(spec.clone()), SEED, world, episode).unwrap();
    TreeWorld::new(planting.spec, &planting.skeleton, planting.fruit).unwrap()
}

/// All worlds of a base, drawn by the twin.
pub(crate) fn drawn(base: &BaseTree, worlds: usize, episode: u32) -> Memory {
    let mut memory = Memory::replicated(base, worlds, 4, Solver::Aba).unwrap();
    memory.draw(&(0..worlds).collect::<Vec<_>>(), episode);
    memory
}

/// Largest errors of a world's constants: of a direction, of other numbers of links over their size, of numbers of fruit over their size.
fn compare(found: &Memory, index: usize, truth: &Memory, base: &BaseTree) -> [f64; 3] {
    let mut worst = [0.0_f64; 3];
    let mut note = |kind: usize, error: f32, size: f32| {
        assert!(error.is_finite());
        worst[kind] = worst[kind].max(f64::from(error / size));
    };
    for segment in 0..base.world().plant().tree.len() {
        let of = |memory: &Memory, index: usize, field: usize| memory.link_of(index, segment, field);
        for k in link::DIRECTION..link::DIRECTION + 3 {
            note(0, (of(found, index, k) - of(truth, 0, k)).abs(), 1.0);
        }
        for field in [link::LENGTH, link::MASS, link::ACROSS, link::EXCESS, link::STIFFNESS, link::LIMIT] {
            let size = of(truth, 0, if field == link::EXCESS { link::ACROSS } else { field });
            note(1, (of(found, index, field) - of(truth, 0, field)).abs(), size);
        }
        let [a, b] = [found.operation_of(index, segment), truth.operation_of(0, segment)];
        // The host leaves out some fruit, so that others have other rows.
        assert_eq!((a[0], a[1]), (b[0], b[1]));
        let radius = |word: u32| (word >> fourth::RADIUS) as i64 & fourth::RADIUS_BITS as i64;
        assert!((radius(a[3]) - radius(b[3])).abs() <= 1, "{} {}", radius(a[3]), radius(b[3]));
        let kept = !((fourth::RADIUS_BITS << fourth::RADIUS) as u32);
        assert_eq!(a[3] & kept, b[3] & kept);
    }
    let all = &base.world().plant().fruit.fruit;
    let mut there = 0;
    for (i, fruit_there) in all.iter().enumerate() {
        let threshold = fruit_there.detach_force as f32;
        let count = truth.fruit_count(0);
        // Fruit are identified by their thresholds, which nothing changes.
        let Some(host) = (0..count).find(|&k| truth.fruit_of(0, k, fruit::THRESHOLD) == threshold) else {
            continue;
        };
        there += 1;
        let of = |field: usize| (found.fruit_of(index, i, field), truth.fruit_of(0, host, field));
        for field in [fruit::MASS, fruit::RADIUS, fruit::AIR_DRAG, fruit::STIFFNESS].into_iter().chain([
            fruit::DAMPING,
            fruit::BIAS,
            fruit::CAP,
            fruit::DROP,
        ]) {
            let (found, truth) = of(field);
            let size = if truth == 0.0 { 1.0 } else { truth.abs() };
            note(2, (found - truth).abs(), size);
        }
        let anchors = [0, 1, 2].map(|k| of(fruit::ANCHOR + k));
        let size = Vec3::from_fn(|k, _| f64::from(anchors[k].1)).norm() as f32;
        anchors.iter().for_each(|(found, truth)| note(2, (found - truth).abs(), size));
    }
    assert!(there * 2 >= all.len(), "{there} of {}", all.len());
    worst
}

#[test]
fn words_are_those_of_the_streams() {
    const WORDS: usize = 40;
    let spec = spec(Mode::SharedDimensions, |_| 1.0);
    let base = base_of(&spec);
    let mut memory = Memory::replicated(&base, LANES + 3, 1, Solver::Aba).unwrap();
    memory.set_episode(9);
    for (number, lane) in [(0, 0), (0, 7), (1, 2)] {
        let own = Lane { memory: &mut memory, number, lane };
        for (entry, &axis) in AXES.iter().enumerate() {
            let world = (number * LANES + lane) as u32;
            let mut truth = Mode::SharedDimensions.stream(axis, SEED, world, 9);
            let mut stream = own.stream_of(entry);
            for k in 0..WORDS {
                let mut bytes = [0; 8];
                truth.fill(&mut bytes);
                let [low, high] = own.next_pair(&mut stream);
                let word = u64::from(high) << 32 | u64::from(low);
                assert_eq!(word, u64::from_le_bytes(bytes), "{axis:?}, world {world}, word {k}");
            }
        }
    }
}

/// All axes at once, under each law of joints.
#[test]
fn worlds_are_those_of_the_host() {
    for law in [JointLaw::Paper, JointLaw::Corrected, JointLaw::PerLevel] {
        let mut spec = spec(Mode::DistinctDimensions, |_| 1.0);
        spec.wood.joint_law = law;
        let base = base_of(&spec);
        let mut memory = Memory::replicated(&base, 6, 1, Solver::Aba).unwrap();
        memory.draw(&[0, 1, 2, 3, 4, 5], 0);
        for world in 0..6 {
            let host = planted(&spec, world, 0);
            let truth = Memory::new(std::slice::from_ref(&host), 1, Solver::Aba).unwrap();
            let [direction, links, fruit] = compare(&memory, world as usize, &truth, &base);
            println!("{law:?}, world {world}: {direction:.1e}, {links:.1e}, {fruit:.1e}");
            assert!([direction, links, fruit].iter().all(|error| *error < TOLERANCE));
        }
    }
}

/// Bits of a world's constants.
pub(crate) fn bits(memory: &Memory, index: usize) -> Vec<u32> {
    let numbers = memory.constants(index).into_iter().map(|(_, number)| number.to_bits());
    numbers.chain(memory.last_words(index)).collect()
}

#[test]
fn strength_zero_is_the_base_bit_for_bit() {
    for (mode, strength) in
        [(Mode::Homogeneous, 1.0), (Mode::SharedDimensions, 0.0), (Mode::DistinctDimensions, 0.0)]
    {
        let base = base_of(&spec(mode, |_| strength));
        let before = Memory::replicated(&base, 3, 4, Solver::Aba).unwrap();
        let after = drawn(&base, 3, 1);
        for index in 0..3 {
            assert_eq!(bits(&before, index), bits(&after, index), "{mode:?}");
        }
        assert!(!base.varies());
    }
}

/// One dial at 1 and all others at 0.
#[test]
fn each_axis_alone_is_the_hosts() {
    for &turned in &AXES {
        let spec = spec(Mode::DistinctDimensions, |axis| f64::from(u8::from(axis == turned)));
        let base = base_of(&spec);
        let mut memory = Memory::replicated(&base, 2, 1, Solver::Aba).unwrap();
        let before = bits(&memory, 1);
        memory.draw(&[1], 0);
        let host = planted(&spec, 1, 0);
        let truth = Memory::new(std::slice::from_ref(&host), 1, Solver::Aba).unwrap();
        let [direction, links, fruit] = compare(&memory, 1, &truth, &base);
        println!("{turned:?}: {direction:.1e}, {links:.1e}, {fruit:.1e}");
        assert!([direction, links, fruit].iter().all(|error| *error < TOLERANCE));
        assert_ne!(bits(&memory, 1), before, "{turned:?}");
        assert_eq!(bits(&memory, 0), before, "a world that is not marked");
    }
}

#[test]
fn shared_dimensions_are_those_of_the_episode() {
    let spec = spec(Mode::SharedDimensions, |_| 1.0);
    let base = base_of(&spec);
    let [first, later] = [0, 3].map(|episode| drawn(&base, LANES + 2, episode));
    let of = |memory: &Memory, index: usize| -> Vec<(f32, u32)> {
        let segments = 0..base.world().plant().tree.len();
        let radius = |segment| memory.operation_of(index, segment)[3];
        segments.map(|segment| (memory.link_of(index, segment, link::LENGTH), radius(segment))).collect()
    };
    assert_eq!(of(&first, 0), of(&first, LANES + 1));
    assert_eq!(of(&later, 0), of(&later, 5));
    assert_ne!(of(&first, 0), of(&later, 0));
    assert_ne!(first.link_of(0, 9, link::STIFFNESS), first.link_of(1, 9, link::STIFFNESS));
    let host = planted(&spec, 5, 3);
    let truth = Memory::new(std::slice::from_ref(&host), 1, Solver::Aba).unwrap();
    let worst = compare(&later, 5, &truth, &base);
    assert!(worst.iter().all(|error| *error < TOLERANCE), "{worst:?}");
}

/// Branches that droop to the ground are lifted as on the host, at twice the strength and with a clearance so large that many are lifted.
#[test]
fn branches_are_lifted_off_the_ground() {
    const CLEARANCE: f64 = 0.5;
    let mut spec = spec(Mode::DistinctDimensions, |_| 2.0);
    spec.tree.clearance = spec.tree.clearance.with_value(CLEARANCE).unwrap();
    let base = base_of(&spec);
    let mut memory = Memory::replicated(&base, 6, 1, Solver::Aba).unwrap();
    memory.draw(&[0, 1, 2, 3, 4, 5], 0);
    let mut lifted = 0;
    for world in 0..6 {
        // The host refuses a tree with a branch that is too low even upright.
        let Ok(planting) = Planting::draw(&Arc::new(spec.clone()), SEED, world, 0) else { continue };
        let rests = planting.skeleton.segments.iter().filter(|segment| {
            segment.order > 0 && (segment.p_tip_world().z - CLEARANCE - segment.radius).abs() < 1e-9
        });
        lifted += rests.count();
        let host = TreeWorld::new(planting.spec, &planting.skeleton, planting.fruit).unwrap();
        let truth = Memory::new(std::slice::from_ref(&host), 1, Solver::Aba).unwrap();
        let worst = compare(&memory, world as usize, &truth, &base);
        println!("world {world}: {worst:?}");
        assert!(worst.iter().all(|error| *error < TOLERANCE), "{worst:?}");
    }
    println!("{lifted} branches rest on the clearance");
    assert!(lifted > 10, "{lifted}");
}

/// Trees of every grammar.
#[test]
fn trees_of_every_preset_are_the_hosts() {
    for &preset in Preset::ALL {
        let mut spec = Spec::preset(preset);
        // Laws that a device does not draw.
        spec.fruit = spec.fruit.on_tethers();
        let wood = &mut spec.wood;
        (wood.modal_damping, wood.young, wood.scatter, wood.union) = (None, None, None, None);
        spec.randomisation = self::spec(Mode::DistinctDimensions, |_| 1.0).randomisation;
        let base = base_of(&spec);
        let Ok(mut memory) = Memory::replicated(&base, 2, 1, Solver::Aba) else { continue };
        memory.draw(&[1], 0);
        let host = planted(&spec, 1, 0);
        let truth = Memory::new(std::slice::from_ref(&host), 1, Solver::Aba).unwrap();
        let worst = compare(&memory, 1, &truth, &base);
        println!("{}: {worst:?}", preset.name());
        assert!(worst.iter().all(|error| *error < TOLERANCE), "{}: {worst:?}", preset.name());
    }
}
