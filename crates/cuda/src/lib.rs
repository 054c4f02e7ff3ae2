//! Exported memory of a graphics device as arrays of CUDA, described by DLPack.
//!
//! `Card::import` opens the memory of an [`orchard_tensor::ExportedBuffer`] in CUDA on the same card as a `CudaMemory`, which `CudaArray` describes to other libraries by DLPack. Nothing is copied, and nothing orders the work of the two sides:
//! whoever writes waits for the device before others read, and waits for them before writing again.
//!
//! Memory lives as long as one of its owners: the buffer of wgpu, or the import of CUDA, which each array of DLPack shares.
//!
//! All of it works on Linux; elsewhere the crate is empty.
#![allow(
    unsafe_code,
    reason = "memory of CUDA and DLPack is handled by raw handles: docs/decisions/0033-memory-shared-with-cuda.md"
)]
#![deny(clippy::undocumented_unsafe_blocks)]

#[cfg(target_os = "linux")]
mod arrays;

#[cfg(target_os = "linux")]
pub use arrays::{Card, CudaArray, CudaError, CudaMemory, Number};
