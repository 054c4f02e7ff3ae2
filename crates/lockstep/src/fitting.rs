//! Constants of a world as lanes need them. They are found once for a world that enters lanes many times.

use orchard_batch::TreeWorld;
use orchard_gpu::{Fitted, GpuError, WorldBatch, world_colliders};
use orchard_multibody::ColliderId;
use orchard_world::World;

/// Constants of a world for the lanes of a lockstep, the same in all locksteps that were made of the same samples ([`Lockstep::fit`](crate::Lockstep::fit)).
#[derive(Debug)]
pub struct Fitting {
    /// Constants of the world's tree, from which its state is put on the device.
    pub(crate) tree: TreeWorld,
    /// `None` if the lanes have no room for the tree.
    pub(crate) fitted: Option<Fitted>,
    /// Colliders in the order of the device.
    pub(crate) colliders: Vec<ColliderId>,
}

impl Fitting {
    /// Finds them for lanes of a batch.
    ///
    /// # Errors
    /// The kernels cannot step the world.
    pub(crate) fn new(batch: &WorldBatch, world: &World) -> Result<Self, GpuError> {
        let tree = tree_of(world);
        let fitted = batch.fitted(&tree, &world.x_world_start())?;
        let colliders = world_colliders(world.model(), world.tree(), world.fruit(), world.handle());
        Ok(Self { tree, fitted, colliders })
    }
}

/// The tree of a world in its present state.
pub(crate) fn tree_of(world: &World) -> TreeWorld {
    TreeWorld::within(
        world.shared_spec().clone(),
        world.model().clone(),
        world.tree().clone(),
        world.fruit().clone(),
        world.weather().cloned(),
        world.data().clone(),
    )
}
