//! The kernels of whole worlds, compiled for a device.

use wgpu::{BufferBindingType, ComputePipeline};

use crate::laws::Laws;
use crate::pipelines::{Kernels, Pass};
use crate::shader;

/// Kind of a pass of whole worlds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WorldPass {
    /// A pass of the trees.
    Trees(Pass),
    /// First half of the robots' substep.
    RobotBegin,
    /// Pairs of colliders that are near each other.
    Seek,
    /// Contacts.
    Meet,
    /// Their impulses.
    Answer,
    /// Second half of the robots' substep.
    RobotEnd,
}

impl WorldPass {
    /// Name of its kernel.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trees(pass) => pass.entry(),
            Self::RobotBegin => "robot_begin",
            Self::Seek => "seek",
            Self::Meet => "meet",
            Self::Answer => "answer",
            Self::RobotEnd => "robot_end",
        }
    }
}

/// Constants of the trees' laws that these kernels know.
const LAWS: [&str; 2] = ["STEMS", "WIND"];

/// Compiled kernels of whole worlds, but for those of their trees.
#[derive(Debug)]
pub(crate) struct WorldPipelines {
    pub robot_begin: ComputePipeline,
    pub seek: ComputePipeline,
    pub meet: ComputePipeline,
    pub answer: ComputePipeline,
    pub robot_end: ComputePipeline,
    /// Layout of their bindings, in the order of `kernels/robot.wgsl` and `kernels/world.wgsl`.
    pub bindings: wgpu::BindGroupLayout,
}

impl WorldPipelines {
    /// Compiles the kernels for the laws of the trees: fruit on stems that bend or on tethers, in wind or not.
    pub fn new(device: &wgpu::Device, laws: Laws) -> Self {
        let read = (BufferBindingType::Storage { read_only: true }, false);
        let written = (BufferBindingType::Storage { read_only: false }, false);
        let own = laws.constants();
        let constants: Vec<_> = own.into_iter().filter(|(name, _)| LAWS.contains(name)).collect();
        let constants = &constants[..];
        // Robot, commands, robots; rules; tables, meetings; works, fruit, worlds; number of worlds taken up.
        let [robot, rules] = [false, true].map(|has_offset| (BufferBindingType::Uniform, has_offset));
        let buffers = [robot, read, written, rules, read, written, written, written, written, written];
        let kernels = Kernels::new(device, "worlds", shader::source_of_worlds(), &buffers);
        Self {
            robot_begin: kernels.pipeline("robot_begin", constants),
            seek: kernels.pipeline("seek", constants),
            meet: kernels.pipeline("meet", constants),
            answer: kernels.pipeline("answer", constants),
            robot_end: kernels.pipeline("robot_end", constants),
            bindings: kernels.bindings,
        }
    }
}

/// Compiled kernels that move quads between device and host.
#[derive(Debug)]
pub(crate) struct QuadPipelines {
    pub gather: ComputePipeline,
    /// Layout of its bindings: places, quads, packed quads.
    pub bindings: wgpu::BindGroupLayout,
    pub scatter_quads: ComputePipeline,
    pub scatter_words: ComputePipeline,
    /// Layout of the bindings of both: records, the buffer.
    pub scatter_bindings: wgpu::BindGroupLayout,
    pub give: ComputePipeline,
    pub tell: ComputePipeline,
    /// Layout of the bindings of both, in the order of `kernels/tell.wgsl`.
    pub tell_bindings: wgpu::BindGroupLayout,
}

impl QuadPipelines {
    /// Compiles the kernels.
    pub fn new(device: &wgpu::Device) -> Self {
        let read = (BufferBindingType::Storage { read_only: true }, false);
        let written = (BufferBindingType::Storage { read_only: false }, false);
        let source = include_str!("../kernels/quads.wgsl").to_owned();
        let kernels = Kernels::new(device, "quads", source, &[read, written, written]);
        let source = include_str!("../kernels/scatter.wgsl").to_owned();
        let scattering = Kernels::new(device, "scatter", source, &[read, written]);
        let telling = crate::layout::wgsl() + include_str!("../kernels/tell.wgsl");
        let telling =
            Kernels::new(device, "tell", telling, &[read, read, written, read, read, read, written, written]);
        Self {
            gather: kernels.pipeline("gather", &[]),
            bindings: kernels.bindings,
            scatter_quads: scattering.pipeline("scatter_quads", &[]),
            scatter_words: scattering.pipeline("scatter_words", &[]),
            scatter_bindings: scattering.bindings,
            give: telling.pipeline("give", &[]),
            tell: telling.pipeline("tell", &[]),
            tell_bindings: telling.bindings,
        }
    }
}
