//! Worlds in lockstep on the device at hand. One program: its tests share devices, whose kernels are compiled once each.

mod broken;
mod course;
mod cup;
#[path = "../../../gpu/tests/device/mod.rs"]
mod device;
mod in_hand;
#[path = "../../../gpu/tests/laid/mod.rs"]
mod laid;
#[expect(dead_code, reason = "the suite of another crate, which calls what is not called here")]
#[path = "../../../../tests/scripted.rs"]
mod scripted;
mod seats;
mod standing;
mod stems;
mod together;
mod wind;
