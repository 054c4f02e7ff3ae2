//! Layout of the device's memory, for Rust and for the kernels.
//!
//! Most arrays are `[block][row][quad][lane][4]`: a block is [`LANES`] worlds side by side, so that the threads of a warp read whole lines of memory, four fields
//! of their world at a time. Fields that are read together are adjacent. Worlds and forces on links are `[tile][field][lane]`.
//! The constants are also the head of the kernels' source ([`wgsl`]).

use std::fmt::Write;

/// Number of worlds of a block, and largest number of worlds of a tile: the threads of a warp.
pub const LANES: usize = 32;
/// Number of fields that are read at once.
pub(crate) const QUAD: usize = 4;

/// One list of constants for both languages: names in Rust are `module::NAME`, in WGSL `MODULE_NAME`.
macro_rules! fields {
    ($($(#[$about:meta])* $module:ident { $($(#[$doc:meta])* $name:ident = $value:literal,)* })*) => {
        $($(#[$about])*
        #[allow(dead_code, reason = "only the kernels use some of them")]
        pub(crate) mod $module { $($(#[$doc])* pub const $name: usize = $value;)* })*

        pub(super) const ALL: &[(&str, &str, usize)] =
            &[$($((stringify!($module), stringify!($name), $value),)*)*];
    };
}

mod drawing;
mod robots;
mod stepping;
mod worlds;

pub(crate) use drawing::*;
pub(crate) use robots::*;
pub(crate) use stepping::*;
pub(crate) use worlds::*;

/// Units of a radius in an operation [1/m].
pub(crate) const RADIUS_UNITS: f32 = 1e5;

/// Number of intervals of the curve of a finger that turns.
pub(crate) const CURVE_INTERVALS: usize = orchard_robot::Curve::INTERVALS as usize;

/// Number for an absent limit: WGSL refuses an infinity in the source.
pub(crate) const UNBOUNDED: f32 = 1e30;

/// The constants as WGSL source.
pub(crate) fn wgsl() -> String {
    let mut text = format!(
        "const LANES: u32 = {LANES}u;\nconst UNBOUNDED: f32 = {UNBOUNDED:e};\nconst QUAD: u32 = {QUAD}u;\nconst RADIUS_UNITS: f32 = {RADIUS_UNITS:e};\nconst CURVE_INTERVALS: u32 = {CURVE_INTERVALS}u;\n"
    );
    for (module, name, value) in
        stepping::ALL.iter().chain(drawing::ALL).chain(robots::ALL).chain(worlds::ALL)
    {
        // Writing to a string never fails.
        let _ = writeln!(text, "const {}_{name}: u32 = {value}u;", module.to_uppercase());
    }
    text
}
