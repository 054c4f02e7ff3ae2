//! Record of a tree, written after its images.

use orchard_exchange::coco::Rle;
use orchard_geometry::Pose;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// A finished tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct TreeRecord {
    /// SHA-256 of its recipe.
    pub recipe: String,
    pub seed: u64,
    pub world: u32,
    pub views: Vec<ViewRecord>,
}

/// The images of one view and their content.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct ViewRecord {
    /// Stem of its files' names.
    pub name: String,
    pub files: ViewFiles,
    pub pose: PoseRecord,
    /// Pixels whose depth is outside the range of the depth image.
    pub unfit_depth_px: u64,
    /// Visible fruit.
    pub fruit: Vec<FruitRecord>,
}

/// The files of one view.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ViewFiles {
    pub color: FileRecord,
    /// Depth as measured by the camera model.
    pub depth: FileRecord,
    pub label: FileRecord,
    pub instance: FileRecord,
    /// True depth, if the camera model has errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub true_depth: Option<FileRecord>,
}

impl ViewFiles {
    pub fn all(&self) -> impl Iterator<Item = &FileRecord> {
        [&self.color, &self.depth, &self.label, &self.instance].into_iter().chain(&self.true_depth)
    }
}

/// A file that was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct FileRecord {
    /// Path relative to the folder of the data set.
    pub path: String,
    pub sha256: String,
}

/// Pose of the optical frame in the world: p_world = rotation p_camera + translation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct PoseRecord {
    pub translation_m: [f64; 3],
    pub rotation_xyzw: [f64; 4],
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct FruitRecord {
    pub bbox: [usize; 4],
    pub segmentation: Rle,
    #[serde(flatten)]
    pub truth: FruitTruth,
}

/// Fields of an annotation beyond the COCO format.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct FruitTruth {
    /// Value in the instance image.
    pub instance: u16,
    pub visible_fraction: f64,
    /// Pixels within the image that it would cover if nothing else existed.
    pub unoccluded_px: u32,
    pub center_camera_m: [f64; 3],
    pub radius_m: f64,
}

impl From<&Pose> for PoseRecord {
    fn from(x: &Pose) -> Self {
        let q = x.rotation.quaternion();
        Self { translation_m: x.translation.vector.into(), rotation_xyzw: [q.i, q.j, q.k, q.w] }
    }
}

/// Stem of the names of a tree's files.
pub(crate) fn stem(seed: u64, world: u32) -> String {
    format!("{seed:06}-{world:03}")
}

/// SHA-256, hexadecimal.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
