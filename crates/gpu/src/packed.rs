//! Trees packed for the kernels, for whoever drives a device by other means than this crate: a page does by WebGPU.

use std::sync::Arc;

use orchard_batch::{Plant, Status, TreeWorld};
use orchard_multibody::Data;

use crate::layout::{LANES, world};
use crate::memory::Memory;
use crate::passes::Pass;
use crate::rules::Rules;
use crate::schedule::WARPS;
use crate::{BatchError, Solver, shader};

/// A kernel, as it is compiled and dispatched.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    /// Name of the function at which the kernel begins.
    pub entry: &'static str,
    /// Values of the source's constants (`override`) that specialise it.
    pub constants: Vec<(&'static str, f64)>,
    /// Workgroups along x and y.
    pub groups: [u32; 2],
}

/// Content of a buffer that the kernels bind.
#[derive(Debug, Clone, Copy)]
pub struct Contents<'a> {
    /// Name of the variable that the kernels bind it to.
    pub name: &'static str,
    /// True if the kernels only read it.
    pub is_read_only: bool,
    /// Bytes with which the buffer is filled before the first kernel runs.
    pub bytes: &'a [u8],
}

/// Trees with their fruit as the kernels step them by elimination: the content of every buffer, the kernels of a frame, and the state that they left.
///
/// Group 0 of the kernels binds the rules, a uniform buffer, as binding 0 and the buffers of [`Self::buffers`] as bindings 1 to 8. Memory of their
/// workgroups need not be set to zero.
#[derive(Debug)]
pub struct PackedTrees {
    memory: Memory,
    plants: Vec<Arc<Plant>>,
}

impl PackedTrees {
    /// Threads of a workgroup, at most.
    pub const THREADS: usize = LANES * WARPS;

    /// Packs trees in their states.
    ///
    /// # Errors
    /// The trees differ in their rules, one has a broken limb or no schedule, or a wind blows.
    pub fn new(worlds: &[TreeWorld]) -> Result<Self, BatchError> {
        if let Some(world) = worlds.iter().position(|world| world.plant().weather.is_some()) {
            return Err(BatchError::Wind { world });
        }
        let memory = Memory::new(worlds, 1, Solver::Aba)?;
        Ok(Self { memory, plants: worlds.iter().map(|world| world.plant().clone()).collect() })
    }

    /// Number of trees.
    pub fn len(&self) -> usize {
        self.memory.len()
    }

    /// True if there is no tree.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Source of the kernels, WGSL.
    pub fn source() -> String {
        shader::source()
    }

    /// Kernels of a frame, in order.
    pub fn kernels(&self) -> Vec<Kernel> {
        let Memory { laws, solver, .. } = self.memory;
        let tiles = self.memory.tile_count() as u32;
        let kernel = |pass: &Pass| Kernel {
            entry: pass.entry(),
            constants: pass.constants(laws),
            groups: [tiles, pass.groups_of_a_tile(laws)],
        };
        Pass::of_a_frame(solver).iter().map(kernel).collect()
    }

    /// Substeps of a frame.
    pub fn substeps(&self) -> u32 {
        self.memory.rules.substeps
    }

    /// Content of the uniform buffer of rules in a frame, the first of which has number 1.
    pub fn rules(&self, frame: u32) -> Vec<u8> {
        bytemuck::bytes_of(&Rules { frame, ..self.memory.rules }).to_vec()
    }

    /// Content of the other buffers, in the order of their bindings.
    pub fn buffers(&self) -> [Contents<'_>; 8] {
        let Memory { tiles, operations, states, links, fruit, work, worlds, pushes, .. } = &self.memory;
        [
            ("tiles", true, bytemuck::cast_slice(tiles)),
            ("operations", false, bytemuck::cast_slice(operations)),
            ("states", false, bytemuck::cast_slice(states)),
            ("links", false, bytemuck::cast_slice(links)),
            ("fruit", false, bytemuck::cast_slice(fruit)),
            ("work", false, bytemuck::cast_slice(work)),
            ("worlds", false, bytemuck::cast_slice(worlds)),
            ("pushes", true, bytemuck::cast_slice(pushes)),
        ]
        .map(|(name, is_read_only, bytes)| Contents { name, is_read_only, bytes })
    }

    /// Takes what the kernels left in a buffer, as it was read from a device. Only the state counts: `states`, `links`, `fruit` and `worlds`.
    /// Returns false if there is no such buffer or it has another size.
    #[must_use]
    pub fn take(&mut self, name: &str, bytes: &[u8]) -> bool {
        let memory = &mut self.memory;
        let to: &mut [u8] = match name {
            "states" => bytemuck::cast_slice_mut(&mut memory.states),
            "links" => bytemuck::cast_slice_mut(&mut memory.links),
            "fruit" => bytemuck::cast_slice_mut(&mut memory.fruit),
            "worlds" => bytemuck::cast_slice_mut(&mut memory.worlds),
            _ => return false,
        };
        let fits = to.len() == bytes.len();
        if fits {
            to.copy_from_slice(bytes);
        }
        fits
    }

    /// Writes a tree's state into the f64 state of its model.
    pub fn store(&self, index: usize, data: &mut Data) {
        self.memory.store(index, &self.plants[index], data);
    }

    /// Tells whether a tree runs or is in quarantine.
    pub fn status(&self, index: usize) -> Status {
        self.memory.status(index)
    }

    /// Numbers of a tree's joints that broke and of its fruit that came off.
    pub fn lost(&self, index: usize) -> [u32; 2] {
        [world::SNAPPED, world::DETACHED].map(|field| self.memory.world_number(index, field))
    }
}

#[cfg(test)]
mod tests {
    use orchard_batch::TreeWorld;
    use orchard_spec::{Preset, Spec};

    use super::*;
    use crate::trees;

    #[test]
    fn a_packed_state_is_the_state_in_f32() {
        let spec = Arc::new(Spec::paper());
        let mut worlds: Vec<TreeWorld> =
            (0..3).map(|index| TreeWorld::grow(spec.clone(), 5, index).unwrap()).collect();
        trees::kick(&mut worlds, 1.0);
        let mut packed = PackedTrees::new(&worlds).unwrap();
        assert_eq!((packed.len(), packed.is_empty(), packed.substeps()), (3, false, 3));
        let kernels = packed.kernels();
        assert_eq!(kernels.iter().map(|kernel| kernel.entry).collect::<Vec<_>>(), ["frame", "apply_events"]);
        assert!(kernels.iter().all(|kernel| kernel.groups == [1, 1]));
        for (index, world) in worlds.iter().enumerate() {
            let mut data = world.data().clone();
            data.v.fill(0.0);
            packed.store(index, &mut data);
            let is_near = |(a, b): (&f64, &f64)| *a == f64::from(*b as f32);
            assert!(data.v.iter().zip(&world.data().v).all(is_near), "world {index}");
            assert_eq!((packed.lost(index), packed.status(index)), ([0, 0], Status::Running));
        }
        let links = packed.buffers()[3].bytes.to_vec();
        assert!(packed.take("links", &links) && !packed.take("links", &links[4..]));
        assert!(!packed.take("tiles", &[]));
    }

    #[test]
    fn trees_in_wind_are_refused() {
        let e = PackedTrees::new(&trees::in_wind(1, 6.0)).unwrap_err();
        assert_eq!(e, BatchError::Wind { world: 0 });
        assert!(Spec::preset(Preset::Paper).wind.is_none());
    }
}
