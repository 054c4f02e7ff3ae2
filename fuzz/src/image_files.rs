//! The readers of depth images, masks, intrinsics and detector configs: an error or something that can be used.

use orchard_exchange::{depth_png, intrinsics};
use orchard_perception::DetectorConfig;

/// One case.
pub fn run(bytes: &[u8]) {
    if let Ok(depth) = depth_png::read(bytes, depth_png::MILLIMETRE) {
        assert!(depth.pixels().iter().all(|z| z.is_finite() && *z >= 0.0));
        let again = depth_png::write(&depth, depth_png::MILLIMETRE).unwrap();
        assert_eq!(depth_png::read(&again, depth_png::MILLIMETRE).unwrap(), depth);
    }
    let _ = depth_png::read_mask(bytes);
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(k) = intrinsics::read(text) {
        assert_eq!(intrinsics::read(&intrinsics::write(&k)), Ok(k));
    }
    let _ = DetectorConfig::from_toml("fuzz.toml", text);
}
