//! Buffers of a graphics device whose memory other interfaces can open.
//!
//! An [`ExportedBuffer`] is a buffer of wgpu whose memory Vulkan exports; the crate `orchard-cuda` opens it in CUDA. It works on Linux; elsewhere [`ExportedBuffer::new`] says that it does not.
#![allow(
    unsafe_code,
    reason = "memory of Vulkan is handled by raw handles: docs/decisions/0033-memory-shared-with-cuda.md"
)]
#![deny(clippy::undocumented_unsafe_blocks)]

#[cfg(target_os = "linux")]
mod vulkan;

/// Identity of a card: the UUID by which Vulkan and CUDA both name it.
pub type CardId = [u8; 16];

/// The reason why a device cannot export memory.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExportError {
    /// The system or the graphics interface has no such memory.
    #[error("memory is shared with other programs on Linux, by Vulkan alone")]
    NotVulkan,
    /// The driver cannot export memory.
    #[error("its driver cannot share memory ({0})")]
    Unsupported(&'static str),
    /// The driver refused.
    #[error("its driver refused to share {bytes} bytes: {why}")]
    Refused {
        /// Bytes asked for.
        bytes: u64,
        /// Answer of the driver.
        why: String,
    },
}

/// Memory as other interfaces open it.
#[derive(Debug)]
pub struct Handle {
    /// Handle of the memory, which whoever opens it takes.
    #[cfg(target_os = "linux")]
    pub fd: std::os::fd::OwnedFd,
    /// All bytes of the memory, which may be more than the buffer has.
    pub bytes: u64,
    /// Card that has the memory.
    pub card: CardId,
}

/// A buffer whose memory is exported.
#[derive(Debug)]
pub struct ExportedBuffer {
    /// The buffer, to be bound as storage and copied from and to.
    pub buffer: wgpu::Buffer,
    /// Handle by which other interfaces open the buffer's memory.
    pub handle: Handle,
}

impl ExportedBuffer {
    /// Makes a buffer of some bytes, all zero once the queue has done what was submitted to it.
    ///
    /// # Errors
    /// The device cannot export memory, or has no room.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        label: &str,
        bytes: u64,
    ) -> Result<Self, ExportError> {
        #[cfg(target_os = "linux")]
        return vulkan::create(device, queue, label, bytes);
        #[cfg(not(target_os = "linux"))]
        {
            let _ = (device, queue, label, bytes);
            Err(ExportError::NotVulkan)
        }
    }
}

/// The example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
