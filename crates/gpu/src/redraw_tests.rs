//! Worlds that the device draws, against the twin and against the host's plantings.

use orchard_batch::Status;
use orchard_geometry::Vec3;
use orchard_spec::randomisation::Mode;
use orchard_spec::{Preset, Spec};
use std::sync::Arc;

use crate::layout::{LANES, fruit, link};
use crate::memory::{Field, Memory};
use crate::table::{BaseError, BaseTree};
use crate::testing::device;
use crate::trees::Errors;
use crate::trials::is_small;
use crate::twin::vary_tests::{SEED, TOLERANCE, base_of, bits, drawn, planted, spec};
use crate::{BatchError, Gpu, GpuBatch, GpuError, Options, Solver};

#[test]
fn the_device_draws_what_its_twin_draws() {
    let Some(gpu) = device() else { return };
    let base = base_of(&spec(Mode::DistinctDimensions, |_| 1.0));
    let twin = drawn(&base, LANES + 2, 0);
    let mut batch = GpuBatch::randomised(&gpu, &base, LANES as u32 + 2).unwrap();
    let on_device = batch.fetched().unwrap();
    // Components of a unit vector, or of an anchor some centimetres away, may be nearly zero by cancellation.
    const ANCHOR_SIZE: f32 = 0.05;
    let mut worst = 0.0_f32;
    for index in 0..LANES + 2 {
        for ((field, a), (_, b)) in on_device.constants(index).into_iter().zip(twin.constants(index)) {
            let size = match field {
                Field::Link(link::DIRECTION..link::LENGTH) => 1.0,
                Field::Fruit(fruit::ANCHOR..fruit::DROP) => ANCHOR_SIZE,
                _ => b.abs().max(f32::MIN_POSITIVE),
            };
            worst = worst.max((a - b).abs() / size);
        }
        // A radius may be rounded to either side; the lowest bit of the word does not belong to it.
        let words = on_device.last_words(index).into_iter().zip(twin.last_words(index));
        words.for_each(|(a, b)| assert!(a.abs_diff(b) <= 2, "{a:x} {b:x}"));
    }
    println!("largest error {worst:.1e}");
    // Each may have this error against f64.
    assert!(f64::from(worst) < 2.0 * TOLERANCE);
}

/// With all strengths at zero every world has the bits of the packed base, also after a redraw.
#[test]
fn strength_zero_is_the_base_bit_for_bit() {
    let Some(gpu) = device() else { return };
    let base = base_of(&spec(Mode::DistinctDimensions, |_| 0.0));
    let packed = Memory::new(std::slice::from_ref(base.world()), 4, Solver::Aba).unwrap();
    let mut batch = GpuBatch::randomised(&gpu, &base, 3).unwrap();
    for redraws in [false, true] {
        if redraws {
            batch.redraw(&[0, 2], 1).unwrap();
        }
        let memory = batch.fetched().unwrap();
        for index in 0..3 {
            assert_eq!(bits(memory, index), bits(&packed, 0));
        }
    }
    let mut data = base.world().data().clone();
    batch.store(1, &mut data).unwrap();
    let rounded = |q: &[f64]| q.iter().map(|q| *q as f32).collect::<Vec<_>>();
    assert_eq!(rounded(&data.q), rounded(&base.world().data().q));
}

/// A world has the same bits in batches of other sizes, drawn alone or with others, the first time or again.
#[test]
fn neighbours_change_no_bit() {
    let Some(gpu) = device() else { return };
    [Solver::Aba, Solver::ConjugateGradients]
        .into_iter()
        .for_each(|solver| neighbours_change_none(&gpu, solver));
}

fn neighbours_change_none(gpu: &Gpu, solver: Solver) {
    let base = base_of(&spec(Mode::DistinctDimensions, |_| 1.0));
    let options = Options { solver, ..Options::default() };
    let of_worlds = |worlds: u32| GpuBatch::randomised_with_options(gpu, &base, worlds, options).unwrap();
    let mut few = of_worlds(2);
    let mut many = of_worlds(LANES as u32 + 5);
    let state = |batch: &mut GpuBatch| {
        let mut data = base.world().data().clone();
        batch.store(1, &mut data).unwrap();
        (data.q, data.v, data.point_p_world)
    };
    let first = bits(few.fetched().unwrap(), 1);
    assert_eq!(first, bits(many.fetched().unwrap(), 1));
    for batch in [&mut few, &mut many] {
        batch.advance(3);
    }
    assert_eq!(state(&mut few), state(&mut many));
    let other = bits(few.fetched().unwrap(), 0);
    few.redraw(&[1], 0).unwrap();
    assert_eq!(first, bits(few.fetched().unwrap(), 1));
    assert_eq!(other, bits(few.fetched().unwrap(), 0));
    few.advance(3);
    assert_eq!(state(&mut few), state(&mut many));
}

/// A world drawn again after damage is whole and at rest; a later force keeps the radii that the device has drawn.
#[test]
fn a_redrawn_world_is_whole() {
    let Some(gpu) = device() else { return };
    let base = base_of(&spec(Mode::SharedDimensions, |_| 1.0));
    let mut batch = GpuBatch::randomised(&gpu, &base, 3).unwrap();
    let segment = base.world().plant().tree.len() / 3;
    assert!(batch.push(0, segment, Vec3::new(0.0, 0.0, -600.0), Vec3::zeros()));
    batch.advance(20);
    assert!(batch.statistics().unwrap()[0].snapped > 0);
    batch.redraw(&[0, 1, 2], 4).unwrap();
    let twin = drawn(&base, 3, 4);
    let q = |batch: &mut GpuBatch, index: usize| {
        let mut data = base.world().data().clone();
        batch.store(index, &mut data).unwrap();
        data.q
    };
    let rest: Vec<_> = (0..3).map(|index| q(&mut batch, index)).collect();
    batch.advance(30);
    for (index, rest) in rest.iter().enumerate() {
        assert_eq!(batch.status(index).unwrap(), Status::Running);
        let now = q(&mut batch, index);
        let off = rest.iter().zip(&now).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(off < 1e-5, "world {index} moves by {off} rad");
    }
    assert_eq!(batch.events().unwrap(), []);
    assert!(batch.push(1, segment, Vec3::new(0.0, 0.0, -1.0), Vec3::zeros()));
    batch.advance(1);
    for index in 0..3 {
        let [a, b] = [batch.fetched().unwrap(), &twin].map(|memory| memory.operation_of(index, segment)[3]);
        // The mark of a force is the lowest bit.
        assert!((a >> 1).abs_diff(b >> 1) <= 1, "{a:x} {b:x}");
    }
}

/// A drawn world is in the equilibrium that the host finds for its planting, and stays there.
#[test]
fn a_drawn_world_is_in_equilibrium() {
    let Some(gpu) = device() else { return };
    let spec = spec(Mode::DistinctDimensions, |_| 1.0);
    let base = base_of(&spec);
    let mut batch = GpuBatch::randomised(&gpu, &base, 4).unwrap();
    for frames in [0, 60] {
        batch.advance(frames);
        for index in 0..4 {
            let host = planted(&spec, index as u32, 0);
            let mut found = base.world().data().clone();
            batch.store(index, &mut found).unwrap();
            let mut data = host.data().clone();
            (data.q, data.v) = (found.q, found.v);
            let errors = Errors::of(&host, &data);
            println!("world {index}, {frames} frames: {errors:?}");
            assert!(is_small(errors));
        }
    }
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let base = base_of(&spec(Mode::DistinctDimensions, |_| 1.0));
    let grown = spec(Mode::DistinctTopology, |_| 1.0);
    let skeleton = orchard_treegen::grow(&grown, SEED, 0).unwrap();
    let refused = BaseTree::new(Arc::new(grown), &skeleton, Vec::new(), SEED).unwrap_err();
    assert!(matches!(refused, BaseError::Topology), "{refused}");
    for law in ["wood.scatter", "wood.modal_damping", "wood.young", "wood.union"] {
        let mut measured = Spec::preset(Preset::MeasuredWood);
        measured.randomisation = spec(Mode::DistinctDimensions, |_| 1.0).randomisation;
        let wood = &mut measured.wood;
        wood.scatter.take_if(|_| law != "wood.scatter");
        wood.modal_damping.take_if(|_| law != "wood.modal_damping");
        wood.young.take_if(|_| law != "wood.young");
        wood.union.take_if(|_| law != "wood.union");
        let skeleton = orchard_treegen::grow(&measured, SEED, 0).unwrap();
        let refused = BaseTree::new(Arc::new(measured), &skeleton, Vec::new(), SEED).unwrap_err();
        assert!(refused.to_string().starts_with(law), "{refused}");
    }
    let mut stemmed = spec(Mode::DistinctDimensions, |_| 1.0);
    stemmed.fruit.stem = Spec::preset(Preset::Calibrated).fruit.stem;
    let skeleton = orchard_treegen::grow(&stemmed, SEED, 0).unwrap();
    let refused = BaseTree::new(Arc::new(stemmed), &skeleton, Vec::new(), SEED).unwrap_err();
    assert!(matches!(refused, BaseError::Stems), "{refused}");
    let mut windy = spec(Mode::DistinctDimensions, |_| 1.0);
    windy.wind = crate::trees::in_wind(1, 6.0)[0].plant().spec.wind.clone();
    let refused = BaseTree::new(Arc::new(windy), &skeleton, Vec::new(), SEED).unwrap_err();
    assert!(refused.to_string().starts_with("wind.speed"), "{refused}");
    let Some(gpu) = device() else { return };
    let mut given = GpuBatch::new(&gpu, std::slice::from_ref(base.world())).unwrap();
    assert_eq!(given.redraw(&[0], 0), Err(GpuError::Batch(BatchError::NoBase)));
    let none = GpuBatch::randomised(&gpu, &base, 0).unwrap();
    assert!(none.is_empty() && none.wait().is_ok());
}
