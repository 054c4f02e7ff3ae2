//! Every batch is a [`Stepper`]: the same worlds under the same inputs end alike, whatever does the arithmetic.

use orchard_batch::{
    Batch, BatchEvent, Fault, Quarantine, ReferenceBatch, Status, Stepper, TreeEvent, TreeWorld,
};
use orchard_geometry::Vec3;
use orchard_gpu::{Choice, Gpu, GpuBatch, GpuError};
use orchard_multibody::{Data, Preconditioner, Solver};
use orchard_spec::{Purpose, Spec, Stream};
use std::sync::Arc;

/// Frames of each half: everything is still on the move after both.
const FRAMES: u32 = 5;
/// Joint rates of a kick [rad/s]: nothing breaks.
const KICK: f64 = 0.5;
/// A force that lifts a fruit off its stem, over the one that suffices.
const OVER: f64 = 3.0;

/// Trees of different topology, kicked.
fn worlds() -> Vec<TreeWorld> {
    let spec = Arc::new(Spec::paper());
    let kicked = |index| {
        let mut world = TreeWorld::grow(spec.clone(), 7, index).unwrap();
        let mut stream = Stream::new(13, index, Purpose::Test);
        world.data_mut().v.iter_mut().for_each(|v| *v = stream.uniform(-KICK, KICK));
        world
    };
    (0..3).map(kicked).collect()
}

/// A device, or none, which is said.
fn device() -> Option<Gpu> {
    match Gpu::open(Choice::Any) {
        Ok(gpu) => Some(gpu),
        Err(GpuError::NoAdapter(why)) => {
            println!("SKIPPED: no graphics adapter ({why})");
            None
        }
        Err(e) => panic!("{e}"),
    }
}

/// Every kind of batch of some worlds; the first is the reference.
fn steppers(worlds: &[TreeWorld]) -> Vec<(&'static str, Box<dyn Stepper>)> {
    let cg = Solver::Cg { preconditioner: Preconditioner::ArticulatedBody };
    let mut all: Vec<(&'static str, Box<dyn Stepper>)> = vec![
        ("f64", Box::new(ReferenceBatch::new(worlds.to_vec(), Solver::Aba))),
        ("f64, conjugate gradients", Box::new(ReferenceBatch::new(worlds.to_vec(), cg))),
        ("lanes", Box::new(Batch::new(worlds).unwrap())),
    ];
    if let Some(gpu) = device() {
        all.push(("device", Box::new(GpuBatch::new(&gpu, worlds).unwrap())));
    }
    all
}

/// What becomes of worlds that are pushed and let go, one of them with a fruit torn off.
fn story(stepper: &mut dyn Stepper, worlds: &[TreeWorld]) -> (Vec<Data>, Vec<BatchEvent>) {
    assert_eq!((stepper.len(), stepper.is_empty()), (worlds.len(), false));
    let detach = worlds[1].plant().fruit.fruit[0].detach_force;
    stepper.pull(1, 0, Vec3::new(0.0, 0.0, -OVER * detach));
    let mut events = Vec::new();
    for force in [Vec3::new(0.4, -0.2, -0.3), Vec3::zeros()] {
        for (index, world) in worlds.iter().enumerate() {
            stepper.push(index, world.plant().tree.len() / 2, force, 0.1 * force).unwrap();
        }
        stepper.advance(FRAMES);
        stepper.wait().unwrap();
        events.extend(stepper.events().unwrap());
    }
    let stored = |(index, world): (usize, &TreeWorld)| {
        let mut data = world.data().clone();
        stepper.store(index, &mut data).unwrap();
        assert_eq!(stepper.status(index).unwrap(), Status::Running);
        data
    };
    (worlds.iter().enumerate().map(stored).collect(), events)
}

/// f32 carries 6e-8 relative; 20 links in a chain and 30 substeps may lose three digits of it in the angles, which are held against
/// the largest. Conjugate gradients end at their own tolerance. What comes off comes off in the same frame.
#[test]
fn all_batches_end_alike() {
    let worlds = worlds();
    let mut reference = None;
    for (name, mut stepper) in steppers(&worlds) {
        let told = story(&mut *stepper, &worlds);
        let (truth, expected) = &*reference.get_or_insert_with(|| told.clone());
        let tolerance = if name.starts_with("f64") { 1e-8 } else { 1e-4 };
        assert_eq!(told.1, *expected, "{name}");
        for (index, (data, truth)) in told.0.iter().zip(truth).enumerate() {
            let size = truth.q.iter().fold(0.0_f64, |most, q| most.max(q.abs()));
            let error = data.q.iter().zip(&truth.q).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            println!("{name}, world {index}: {:.1e} of the largest angle", error / size);
            assert!(error < tolerance * size, "{name}, world {index}: {error:e} of {size} rad");
        }
    }
    let (truth, events) = reference.unwrap();
    let moved = |(world, truth): (&TreeWorld, &Data)| {
        world.data().q.iter().zip(&truth.q).any(|(a, b)| (a - b).abs() > 1e-3)
    };
    assert!(worlds.iter().zip(&truth).any(moved), "nothing moved");
    assert!(matches!(events[..], [BatchEvent { world: 1, event: TreeEvent::Detached { fruit: 0 }, .. }]));
}

/// A world that is no longer finite is reported once, at the end of the frame, and stands still; the others go on.
#[test]
fn all_batches_take_a_world_out_that_is_not_finite() {
    let mut worlds = worlds();
    worlds[1].data_mut().v[6] = f64::NAN;
    for (name, mut stepper) in steppers(&worlds) {
        stepper.advance(2);
        let is_stop = |happened: &BatchEvent| matches!(happened.event, TreeEvent::Quarantined { .. });
        let stops: Vec<BatchEvent> = stepper.events().unwrap().into_iter().filter(is_stop).collect();
        let [BatchEvent { frame: 1, world: 1, event: TreeEvent::Quarantined { fault } }] = stops[..] else {
            panic!("{name}: {stops:?}")
        };
        assert!(matches!(fault, Fault::Joint { .. }), "{name}: {fault:?}");
        let stopped = Status::Quarantined(Quarantine { frame: 1, fault });
        assert_eq!(stepper.status(1).unwrap(), stopped, "{name}");
        assert_eq!(stepper.status(0).unwrap(), Status::Running, "{name}");
        stepper.advance(1);
        assert_eq!(stepper.events().unwrap(), [], "{name}");
    }
}
