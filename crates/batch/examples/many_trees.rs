//! Steps 64 trees with their fruit at once for two seconds, pulls at a fruit of each, and prints the events.

use orchard_batch::{Batch, TreeWorld};
use orchard_geometry::Vec3;
use orchard_spec::Spec;
use std::sync::Arc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let spec = Arc::new(Spec::paper());
    // Trees 0 to 63 of seed 1, each with a topology of its own, in f64.
    let worlds = (0..64).map(|tree| TreeWorld::grow(spec.clone(), 1, tree)).collect::<Result<Vec<_>, _>>()?;

    // The same worlds in f32, as many in a vector as the processor's registers hold.
    let mut batch = Batch::new(&worlds)?;
    for (world, tree) in worlds.iter().enumerate() {
        if !tree.plant().fruit.is_empty() {
            batch.pull(world, 0, Vec3::new(0.0, 0.0, -18.0)); // [N], world frame
        }
    }
    for event in batch.step(120) {
        // Frames of 1/60 s.
        println!("frame {}, tree {}: {:?}", event.frame, event.world, event.event);
    }

    // One tree's state, back in f64.
    let mut data = worlds[5].data().clone();
    batch.store(5, &mut data);
    println!("tree 5: fruit 0 at z = {:.3} m", data.point_p_world[0].z);
    Ok(())
}
