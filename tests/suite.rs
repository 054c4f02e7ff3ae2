//! Suites over whole worlds, in one binary: a file or folder a subject.

#[path = "bucket.rs"]
mod bucket;
#[path = "calibrated.rs"]
mod calibrated;
#[path = "camera.rs"]
mod camera;
#[path = "episodes.rs"]
mod episodes;
#[path = "faults.rs"]
mod faults;
#[path = "hashes.rs"]
mod hashes;
#[path = "honesty.rs"]
mod honesty;
#[path = "images_on_device.rs"]
mod images_on_device;
#[path = "imported.rs"]
mod imported;
#[path = "independence.rs"]
mod independence;
#[path = "learning_on_device.rs"]
mod learning_on_device;
#[path = "leaves.rs"]
mod leaves;
#[path = "loose.rs"]
mod loose;
#[path = "paper_controller.rs"]
mod paper_controller;
#[path = "randomised.rs"]
mod randomised;
#[path = "shortcuts.rs"]
mod shortcuts;
#[path = "skeletons.rs"]
mod skeletons;
#[path = "snapshots.rs"]
mod snapshots;
#[path = "steppers/main.rs"]
mod steppers;
#[path = "terrain.rs"]
mod terrain;
#[path = "trained.rs"]
mod trained;
#[path = "verification/main.rs"]
mod verification;
#[path = "worlds.rs"]
mod worlds;
