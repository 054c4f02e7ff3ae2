//! Many worlds, tile by tile.

use crate::fault::Status;
use crate::isa::Isa;
use crate::tile::{BatchEvent, Tile};
use crate::tree_world::TreeWorld;
use orchard_geometry::{Vec3, rotation_from_z};
use orchard_multibody::{Data, JointKind};
use rayon::prelude::*;

/// Largest twist of a link's frame \[rad\]: the round-off of the turns along a trunk.
const TWIST: f64 = 1e-9;
/// Least cosine between a link and its parent at rest: nearer to -1 the smallest turn between them loses digits in f32.
const FOLDED: f64 = -0.99;

/// Reason why worlds cannot form a batch.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BatchError {
    /// The worlds do not step alike.
    #[error("world {world} has another substep, frame or gravity than world 0")]
    Time {
        /// Index of the world.
        world: usize,
    },
    /// A world has a feature that the lanes lack.
    #[error("world {world}: {what}")]
    Unsupported {
        /// Index of the world.
        world: usize,
        /// Problem found.
        what: &'static str,
    },
    /// The processor lacks the instructions asked for.
    #[error("this processor has no {0:?}")]
    Instructions(Isa),
}

/// Tree worlds that advance together, in f32. A clone continues with the same bits; there is no save file.
///
/// The result of a world does not depend on the others, on their number or on the number of threads. Worlds of
/// equal topology, of a chunk, are put into the same tiles; a tile of different ones works too, somewhat slower.
#[derive(Debug, Clone)]
pub struct Batch {
    tiles: Vec<Tile>,
    /// Tile and lane of each world.
    places: Vec<(usize, usize)>,
}

impl Batch {
    /// Builds a batch from the state and the applied forces of some worlds, with the fastest instruction set of the processor.
    /// Counts of frames over a limit start at 0.
    ///
    /// # Errors
    /// The worlds do not step alike, or one has fed-forward torques or springs at rest at other angles than 0.
    pub fn new(worlds: &[TreeWorld]) -> Result<Self, BatchError> {
        Self::with_isa(worlds, Isa::best())
    }

    /// Builds a batch as [`Self::new`] with a chosen instruction set.
    ///
    /// # Errors
    /// As [`Self::new`], or the processor lacks the instructions.
    pub fn with_isa(worlds: &[TreeWorld], isa: Isa) -> Result<Self, BatchError> {
        Self::of_chunks(std::iter::once(worlds), isa)
    }

    /// Builds a batch from chunks of worlds, each packed by itself: only one chunk need be in memory in f64.
    ///
    /// # Errors
    /// As [`Self::with_isa`].
    pub fn of_chunks<C: AsRef<[TreeWorld]>>(
        chunks: impl IntoIterator<Item = C>,
        isa: Isa,
    ) -> Result<Self, BatchError> {
        if !Isa::available().contains(&isa) {
            return Err(BatchError::Instructions(isa));
        }
        let mut batch = Self { tiles: Vec::new(), places: Vec::new() };
        let mut time = None;
        for chunk in chunks {
            let worlds = chunk.as_ref();
            for (index, world) in (batch.len()..).zip(worlds) {
                check(world).map_err(|what| BatchError::Unsupported { world: index, what })?;
                let sim = &world.plant().spec.sim;
                let own = (sim.substep(), sim.substeps.get(), sim.gravity.si());
                if *time.get_or_insert(own) != own {
                    return Err(BatchError::Time { world: index });
                }
            }
            batch.add(worlds, isa);
        }
        Ok(batch)
    }

    fn add(&mut self, worlds: &[TreeWorld], isa: Isa) {
        // Equal topologies side by side, small trees before large ones.
        let mut order: Vec<usize> = (0..worlds.len()).collect();
        order.sort_by_cached_key(|&index| {
            let plant = worlds[index].plant();
            let fruit: Vec<usize> = plant.fruit.fruit.iter().map(|fruit| fruit.segment).collect();
            (worlds[index].has_stems(), plant.tree.len(), plant.tree.parent.clone(), fruit, index)
        });
        let start = self.len();
        self.places.resize(start + worlds.len(), (0, 0));
        let alike = order.chunk_by(|&a, &b| worlds[a].has_stems() == worlds[b].has_stems());
        for members in alike.flat_map(|members| members.chunks(isa.lanes())) {
            for (lane, &index) in members.iter().enumerate() {
                self.places[start + index] = (self.tiles.len(), lane);
            }
            let members: Vec<_> = members.iter().map(|&index| (start + index, &worlds[index])).collect();
            self.tiles.push(Tile::new(isa, &members));
        }
    }

    /// Number of worlds.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// True if there is no world.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Advances every world by whole frames, tiles in parallel. Returns the events, by frame and world.
    pub fn step(&mut self, frames: u32) -> Vec<BatchEvent> {
        self.run(frames);
        self.drain_events()
    }

    /// Advances every world by whole frames; the events stay in the tiles.
    pub(crate) fn run(&mut self, frames: u32) {
        self.tiles.par_iter_mut().for_each(|tile| tile.run(frames));
    }

    /// Takes the events since the last call, by frame and world.
    pub(crate) fn drain_events(&mut self) -> Vec<BatchEvent> {
        let mut events: Vec<BatchEvent> = self.tiles.iter_mut().flat_map(Tile::drain_events).collect();
        events.sort_unstable();
        events
    }

    /// State of a world. One that is found to be non-finite at the end of a frame is reported by that frame's
    /// events and stands still from then on: it takes no more inputs, and [`Self::store`] returns its numbers at that moment.
    pub fn status(&self, world: usize) -> Status {
        let (tile, lane) = self.places[world];
        self.tiles[tile].status(lane)
    }

    /// Writes a world's state into the f64 state of its model: joints, fruit, tethers, and the springs, dampers
    /// and drag that breaking has changed.
    pub fn store(&self, world: usize, data: &mut Data) {
        let (tile, lane) = self.places[world];
        self.tiles[tile].store(lane, data);
    }

    /// Resets some worlds as [`crate::Stepper::reset`] does, tiles in parallel.
    pub fn reset(&mut self, worlds: &[usize]) {
        let mut lanes = vec![Vec::new(); self.tiles.len()];
        for &world in worlds {
            let (tile, lane) = self.places[world];
            lanes[tile].push(lane);
        }
        let tiles = self.tiles.par_iter_mut().zip(lanes);
        tiles.for_each(|(tile, lanes)| lanes.into_iter().for_each(|lane| tile.reset(lane)));
    }

    /// Sets the external force \[N\] at, and torque [N m] about, a segment's centre of mass until changed.
    pub fn push(&mut self, world: usize, segment: usize, force_world: Vec3, torque_world: Vec3) {
        let (tile, lane) = self.places[world];
        self.tiles[tile].push(lane, segment, force_world, torque_world);
    }

    /// Sets the external force \[N\] on a fruit until changed.
    pub fn pull(&mut self, world: usize, fruit: usize, force_world: Vec3) {
        let (tile, lane) = self.places[world];
        self.tiles[tile].pull(lane, fruit, force_world);
    }

    /// Breaks the joint at a segment's base now.
    pub fn break_branch(&mut self, world: usize, segment: usize) {
        let (tile, lane) = self.places[world];
        self.tiles[tile].break_joint(lane, segment);
    }

    /// Memory that a step works on \[bytes\].
    pub fn bytes(&self) -> usize {
        self.tiles.iter().map(Tile::bytes).sum()
    }
}

/// Checks the assumptions of the lanes about a world.
fn check(world: &TreeWorld) -> Result<(), &'static str> {
    let (plant, data) = (world.plant(), world.data());
    // Springs that lead are set anew in every substep.
    let rest = data.rest.iter().filter(|_| !plant.tree.is_modal);
    if rest.chain(&data.torque).any(|x| *x != 0.0) {
        return Err("a joint has a torque or a spring that is at rest elsewhere than at 0");
    }
    for body in plant.tree.bodies.iter().map(|id| plant.model.body(*id)) {
        let (inertia, i_com) = (&body.inertia, &body.inertia.i_com);
        let axial = inertia.p_com.x == 0.0 && inertia.p_com.y == 0.0;
        let symmetric = i_com[(0, 0)] == i_com[(1, 1)] && i_com.iter().filter(|x| **x != 0.0).count() <= 3;
        if body.joint != JointKind::Universal || !axial || !symmetric {
            return Err("a link is not a bending joint with a body that is symmetric about its own axis");
        }
        let frame = body.x_parent_joint.rotation;
        let direction = frame * Vec3::z();
        // Twist up to round-off, and away from the direction where the smallest turn is undefined.
        let untwisted = rotation_from_z(&direction.normalize());
        if frame.angle_to(&untwisted) > TWIST || direction.z < FOLDED {
            return Err("a link's frame is twisted about the link, or the link folds back on its parent");
        }
        if let Some(parent) = body.parent {
            let p_tip = plant.model.body(parent).inertia.p_com * 2.0;
            // Round-off of half a length, doubled.
            if (body.x_parent_joint.translation.vector - p_tip).norm() > f64::EPSILON {
                return Err("a link does not sit at its parent's tip");
            }
        }
    }
    Ok(())
}
