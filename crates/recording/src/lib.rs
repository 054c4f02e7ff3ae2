//! Recordings of OrchardBench episodes as MCAP files for Foxglove, and their replay.
//!
//! A [`Recorder`] watches an episode and turns each frame into messages; a [`Sink`] takes them. [`file`] writes them down,
//! [`replay`] holds them against a recording while the world is simulated again under the recorded commands. `docs/recording.md`
//! tells what each channel holds.
//!
//! A recording is a function of what its episode is a function of, and of `configs/paper/recording.toml`: the same bytes on
//! every run.

mod camera;
pub mod channel;
mod clock;
pub mod command;
mod config;
mod event;
mod exact;
pub mod file;
mod folder;
mod joints;
mod layout;
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
