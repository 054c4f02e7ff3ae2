//! The kernels of robots, compiled for a device.

use wgpu::{BufferBindingType, ComputePipeline};

use crate::pipelines::Kernels;
use crate::shader;

/// Kind of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RobotPass {
    /// Advances a frame.
    Frame,
    /// Resets marked worlds.
    Reset,
}

/// Compiled kernels of robots: one for all robots, whose joints are data.
#[derive(Debug)]
pub(crate) struct RobotPipelines {
    frame: ComputePipeline,
    reset: ComputePipeline,
    /// Layout of their bindings: the table, commands, states.
    pub bindings: wgpu::BindGroupLayout,
}

impl RobotPipelines {
    /// Compiles the kernels.
    pub fn new(device: &wgpu::Device) -> Self {
        let read_only = |read_only| (BufferBindingType::Storage { read_only }, false);
        let buffers = [(BufferBindingType::Uniform, false), read_only(true), read_only(false)];
        let kernels = Kernels::new(device, "robots", shader::source_of_robots(), &buffers);
        Self {
            frame: kernels.pipeline("robot_frame", &[]),
            reset: kernels.pipeline("robot_reset", &[]),
            bindings: kernels.bindings,
        }
    }

    /// Pipeline of a pass.
    pub fn of(&self, pass: RobotPass) -> &ComputePipeline {
        match pass {
            RobotPass::Frame => &self.frame,
            RobotPass::Reset => &self.reset,
        }
    }
}
