//! Errors of the detector.

/// An input that the detector cannot use.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PerceptionError {
    /// The image has no pixel.
    #[error("depth image is empty ({width} x {height})")]
    Empty {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// Two inputs disagree in size.
    #[error("{what} is {width} x {height}, the depth image {depth_width} x {depth_height}")]
    SizeMismatch {
        /// The input that disagrees with the depth image.
        what: &'static str,
        /// Columns of that input.
        width: usize,
        /// Rows of that input.
        height: usize,
        /// Columns of the depth image.
        depth_width: usize,
        /// Rows of the depth image.
        depth_height: usize,
    },
    /// The intrinsics are not those of a pinhole camera.
    #[error(
        "focal lengths and axis must be finite, focal lengths positive: fx {fx}, fy {fy}, cx {cx}, cy {cy}"
    )]
    Intrinsics {
        /// Horizontal focal length \[px\].
        fx: f64,
        /// Vertical focal length \[px\].
        fy: f64,
        /// Column of the optical axis \[px\].
        cx: f64,
        /// Row of the optical axis \[px\].
        cy: f64,
    },
    /// The network looks at colour, and no colour image is given.
    #[error("the network of the detector looks at colour, and there is no colour image")]
    NoColour,
    /// The network cannot be computed.
    #[error("the network of the detector {0}")]
    Network(String),
    /// The image has more pixels than the network computes.
    #[error("a depth image of {width} x {height} is too large for the network of the detector")]
    TooLarge {
        /// Columns that it would look at.
        width: usize,
        /// Rows that it would look at.
        height: usize,
    },
}
