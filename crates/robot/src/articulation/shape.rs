//! Collision shapes of links.

use super::place::pose_of;
use crate::RobotError;
use crate::mesh::{MeshFacts, covered};
use crate::plausible::{LENGTH_MAX, within};
use crate::resources::Resources;
use crate::warning::Warning;
use orchard_geometry::{Cover, Pose, Shape, Vec3};
use std::collections::BTreeMap;
use urdf_rs::Geometry;

/// A mesh file as a description uses it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MeshUse {
    /// The link.
    pub link: String,
    /// File name as it stands in the URDF.
    pub file: String,
    /// True for a collision mesh, false for a visual one.
    pub is_collision: bool,
    /// Content of the file; `None` for a visual mesh, which is not read.
    pub mesh: Option<MeshFacts>,
}

/// Most triangles of all meshes together, our own choice: the largest public robots have 1 million.
const ALL_TRIANGLES_MAX: usize = 5_000_000;

/// Shapes of one file at one scale; the scale as its bits.
type Known = BTreeMap<(String, [u64; 3]), (Cover, MeshFacts)>;

/// Reader of the shapes of a description; a file that several links use is read once.
pub(super) struct Shapes<'r> {
    resources: &'r mut dyn Resources,
    known: Known,
    triangles: usize,
    /// Collision meshes, in the order of the links' places.
    pub meshes: Vec<MeshUse>,
}

impl<'r> Shapes<'r> {
    pub fn new(resources: &'r mut dyn Resources) -> Self {
        Self { resources, known: BTreeMap::new(), triangles: 0, meshes: Vec::new() }
    }

    /// Shapes of a collision element with their poses in the frame of the link.
    pub fn of(
        &mut self,
        link: &str,
        collision: &urdf_rs::Collision,
        warnings: &mut Vec<Warning>,
    ) -> Result<Vec<(Shape, Pose)>, RobotError> {
        let place = format!("collision of link `{link}`");
        let x = pose_of(&place, &collision.origin)?;
        let capsule = |radius: f64, length: f64| {
            let centred = Pose::translation(0.0, 0.0, -0.5 * length);
            (Shape::Capsule { radius, length }, x * centred)
        };
        let (sizes, made) = match &collision.geometry {
            Geometry::Box { size } => (size.0.to_vec(), (Shape::Box { half: Vec3::from(size.0) * 0.5 }, x)),
            Geometry::Cylinder { radius, length } => {
                (vec![*radius, *length], capsule(*radius, (length - 2.0 * radius).max(0.0)))
            }
            Geometry::Capsule { radius, length } => (vec![*radius, *length], capsule(*radius, *length)),
            Geometry::Sphere { radius } => (vec![*radius], (Shape::Sphere { radius: *radius }, x)),
            Geometry::Mesh { filename, scale } => {
                let scale = scale.map_or(Vec3::repeat(1.0), |s| Vec3::from(s.0));
                within(&place, scale.as_slice(), LENGTH_MAX)?;
                return self.mesh(link, filename, &scale, &x, warnings);
            }
        };
        within(&place, &sizes, LENGTH_MAX)?;
        if sizes.iter().any(|s| *s < 0.0) {
            return Err(RobotError::Geometry { link: link.to_owned(), kind: "of a negative size" });
        }
        if sizes.contains(&0.0) {
            warnings.push(Warning::EmptyShape { link: link.to_owned() });
            return Ok(Vec::new());
        }
        Ok(vec![made])
    }

    fn mesh(
        &mut self,
        link: &str,
        file: &str,
        scale: &Vec3,
        x: &Pose,
        warnings: &mut Vec<Warning>,
    ) -> Result<Vec<(Shape, Pose)>, RobotError> {
        let key = (file.to_owned(), [scale.x, scale.y, scale.z].map(f64::to_bits));
        if !self.known.contains_key(&key) {
            let read = |resources: &mut dyn Resources| covered(file, &resources.read(file)?, scale);
            let error = |problem| RobotError::Mesh { link: link.to_owned(), file: file.to_owned(), problem };
            let found = read(&mut *self.resources).map_err(error)?;
            self.triangles += found.1.triangles;
            if self.triangles > ALL_TRIANGLES_MAX {
                return Err(RobotError::TooMany { what: "triangles in its meshes", most: ALL_TRIANGLES_MAX });
            }
            self.known.insert(key.clone(), found);
        }
        let (cover, facts) = &self.known[&key];
        if facts.excess.is_none() {
            warnings.push(Warning::FlatMesh { link: link.to_owned(), file: file.to_owned() });
        }
        self.meshes.push(MeshUse {
            link: link.to_owned(),
            file: file.to_owned(),
            is_collision: true,
            mesh: Some(facts.clone()),
        });
        Ok(cover.shapes.iter().map(|(shape, x_mesh_shape)| (shape.clone(), x * x_mesh_shape)).collect())
    }
}
