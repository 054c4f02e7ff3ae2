//! Worlds of the benchmark's tasks in berths.

use orchard_robot::Command;
use orchard_tasks::harvest::adapter::Simulated;
use orchard_tasks::stage::Stage;
use orchard_world::World;

use crate::berths::{Berth, Berths};

/// A world in its berth.
#[derive(Debug)]
pub struct Berthed {
    /// `None` only while its frame is computed.
    world: Option<Box<World>>,
    berth: Berth,
}

impl Simulated for Berthed {
    fn world(&self) -> &World {
        self.world.as_deref().unwrap_or_else(|| unreachable!("it is here between frames"))
    }

    fn world_mut(&mut self) -> &mut World {
        self.world.as_deref_mut().unwrap_or_else(|| unreachable!("it is here between frames"))
    }

    /// Advances it with all others.
    fn advance(&mut self, command: &Command) {
        self.world = self.world.take().map(|world| self.berth.step(world, command));
    }
}

impl Stage for Berths {
    type Place = Berth;
    type World = Berthed;

    fn take(&self, condition: &str) -> Berth {
        Berths::take(self, condition)
    }

    fn enter(&self, mut berth: Berth, world: World) -> Result<Berthed, String> {
        berth.enter(&world).map_err(|e| e.to_string())?;
        Ok(Berthed { world: Some(Box::new(world)), berth })
    }

    fn renew(&self, berthed: &mut Berthed) -> Result<(), String> {
        let Berthed { world, berth } = berthed;
        world.as_deref().map_or(Ok(()), |world| berth.enter(world)).map_err(|e| e.to_string())
    }

    fn at_once(&self, _: usize) -> usize {
        self.lanes()
    }

    fn failed(&self) -> Option<String> {
        self.lost()
    }
}
