//! Recordings of OrchardBench episodes as MCAP files for Foxglove, and their replay.
//!
//! A [`Recorder`] observes an episode and turns each frame into messages; a [`Sink`] takes them. [`mod@file`] writes them to a file,
//! [`replay`] compares them with a recording while the world is simulated again under the recorded commands. `docs/recording.md`
//! describes the channels.
//!
//! [`bag`] reads depth images from other people's bags of ROS 2, and writes detections as one.
//!
//! A recording is a function of the inputs of its episode and of `configs/paper/recording.toml`: the same bytes on
//! every run.

pub mod bag;
mod camera;
pub mod channel;
mod clock;
pub mod command;
mod config;
mod cup;
mod event;
mod exact;
pub mod file;
mod folder;
mod joints;
mod layout;
#[cfg(feature = "live")]
pub mod live;
mod picker;
mod read;
mod recorder;
pub mod replay;
mod scene;
mod sink;
mod transforms;

pub use channel::Channel;
pub use config::{PAPER_TOML, RecordingConfig};
pub use folder::{FOLDER, Recordings, name_of};
pub use layout::{LAYOUT, topics_of};
pub use read::{Recording, RecordingError};
pub use recorder::Recorder;
pub use sink::{Message, Sink};
