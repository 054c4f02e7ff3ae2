//! The window, and pictures of it without a screen.

mod blit;
mod clock;
mod detail;
mod device;
mod file;
#[cfg(feature = "gamepad")]
mod gamepad;
mod keys;
mod layer;
mod layout;
mod looks;
mod offscreen;
mod open;
mod panels;
mod pipelines;
mod plots;
mod pointer;
mod renderer;
mod video;
mod viewer;

pub use file::{write_png, write_png_fast};
pub use offscreen::Offscreen;
pub use open::open;
pub use video::{Tally, video};
pub use viewer::{Costs, Viewer};

/// A viewer that cannot be shown. The message says what to do.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// There is no graphics device.
    #[error(
        "no graphics device was found ({0}); install a Vulkan driver (on Debian mesa-vulkan-drivers, which needs no graphics card)"
    )]
    NoAdapter(String),
    /// There is no screen.
    #[error(
        "no screen was found: neither DISPLAY nor WAYLAND_DISPLAY leads to one; run it on a desktop, or write a picture with --screenshot FILE.png, which needs no screen"
    )]
    NoScreen,
    /// A world or an option that cannot be used.
    #[error("{0}")]
    Refused(String),
    /// A file that cannot be written.
    #[error(transparent)]
    File(#[from] orchard_bench::store::StoreError),
    /// The device failed while it drew.
    #[error("the graphics device failed: {0}")]
    Device(String),
}
