//! The wrist depth camera.

use orchard_quantity::{Count, Quantity};
use serde::{Deserialize, Serialize};

/// Pinhole depth camera. Its mount pose belongs to the robot's config.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// Columns.
    pub width: Count,
    /// Rows.
    pub height: Count,
    /// Vertical field of view.
    pub vertical_fov: Quantity,
    /// Nearest valid depth; nearer surfaces occlude but read as invalid.
    pub near: Quantity,
    /// Farthest valid depth.
    pub far: Quantity,
    /// Image rate.
    pub rate: Quantity,
}
