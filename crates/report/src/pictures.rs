//! Pictures of a run, drawn by the caller.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

/// Pictures of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pictures {
    /// Trees of the run.
    pub trees: Vec<Picture>,
    /// One attempt, moment by moment.
    pub pick: Option<Pick>,
    /// Reason why some or all pictures are missing, if so.
    pub left_out: Option<String>,
}

/// A picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// The picture as PNG.
    pub png: Vec<u8>,
    /// Width and height \[px\].
    pub size: [u32; 2],
    /// Text description of the picture, for readers who cannot see it.
    pub alt: String,
    /// Caption below the picture.
    pub caption: String,
}

/// An attempt in pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Pick {
    /// Title: episode, attempt and outcome.
    pub title: String,
    /// Moments of the attempt, in the order of time.
    pub moments: Vec<Moment>,
}

/// A moment of an attempt.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Caption: time and event.
    pub caption: String,
    /// Text with the opening of the fingers and their distances.
    pub detail: String,
    /// Seen from outside.
    pub outside: Picture,
    /// Seen by the wrist camera.
    pub wrist: Picture,
}

impl Picture {
    /// The picture as an HTML element with embedded data.
    pub(crate) fn element(&self) -> Markup {
        let source = format!("data:image/png;base64,{}", STANDARD.encode(&self.png));
        html! { img src=(source) alt=(self.alt) width=(self.size[0]) height=(self.size[1]); }
    }
}
