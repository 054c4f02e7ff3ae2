//! The commands, one file each.

pub mod bench_v1;
pub mod dataset;
pub mod detect;
pub mod explain;
pub mod export_tree;
pub mod gallery;
#[cfg(feature = "gpu")]
pub mod gpu_info;
#[cfg(not(feature = "gpu"))]
#[path = "commands/without_gpu.rs"]
pub mod gpu_info;
pub mod leaderboard;
pub mod merge;
pub mod names;
pub mod perf;
pub mod render;
#[cfg(feature = "recording")]
pub mod replay;
#[cfg(not(feature = "recording"))]
#[path = "commands/without_recording.rs"]
pub mod replay;
pub mod report;
pub mod robot;
pub mod scenario;
pub mod validate;
pub mod verify;
