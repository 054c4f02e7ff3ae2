//! Pulls a fruit off one of eight trees on a graphics device, and resets that tree.
//!
//! `cargo run --release -p orchard-gpu --example trees_on_a_device`

use orchard_batch::TreeWorld;
use orchard_geometry::Vec3;
use orchard_gpu::{Choice, Gpu, GpuBatch, GpuError};
use orchard_spec::Spec;
use std::error::Error;
use std::sync::Arc;

fn main() -> Result<(), Box<dyn Error>> {
    let gpu = match Gpu::open(Choice::Any) {
        Ok(gpu) => gpu,
        Err(e @ GpuError::NoAdapter(_)) => {
            println!("This example needs a graphics adapter: {e}.");
            return Ok(());
        }
        Err(e) => return Err(e.into()),
    };
    println!("adapter: {}", gpu.info().name);

    let spec = Arc::new(Spec::paper());
    let worlds =
        (0..8).map(|world| TreeWorld::grow(spec.clone(), 1, world)).collect::<Result<Vec<_>, _>>()?;
    let mut batch = GpuBatch::new(&gpu, &worlds)?;

    // Three times the force that detaches fruit 0 of world 3 [N], for half a second.
    let force = 3.0 * worlds[3].plant().fruit.fruit[0].detach_force;
    batch.pull(3, 0, Vec3::new(0.0, 0.0, -force));
    batch.advance(30);
    for event in batch.events()? {
        println!("frame {}, world {}: {:?}", event.frame, event.world, event.event);
    }
    for (world, statistics) in batch.statistics()?.into_iter().enumerate() {
        println!("world {world}: {} fruit came off, energy {:.1} J", statistics.detached, statistics.energy);
    }

    batch.pull(3, 0, Vec3::zeros());
    batch.reset(&[3]);
    println!("world 3 after its reset: {} fruit came off", batch.statistics()?[3].detached);
    Ok(())
}
