//! Reader of URDF text into a tree of moving links.
//!
//! Links joined by fixed joints become one moving link: their inertias are added, their shapes and frames kept. Cylinders
//! become capsules of the same overall length (spheres where they are shorter than wide), meshes one convex hull or a few.

mod build;
mod inertia;
mod limits;
mod motion;
mod parts;
mod place;
mod shape;
mod text;
mod tree;

pub(crate) use inertia::{ROUNDING, combined, massless, matrix_of, moments, moved, point_inertia};
pub use limits::Limits;
pub use parts::{Articulation, Frame, Friction, Limit, Link, LinkShape, Mimic};
pub(crate) use place::moved_by;
pub use shape::MeshUse;

use crate::RobotError;
use crate::resources::{NoMeshes, Resources};
use crate::size;
use crate::warning::{Warning, sorted};
use build::Builder;
use motion::motions;
use shape::Shapes;
use tree::Tree;

/// A robot description as it was loaded.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The robot.
    pub articulation: Articulation,
    /// Mesh files of the description: collision meshes in the order of their links, then visual ones in the order of the file.
    pub meshes: Vec<MeshUse>,
    /// Warnings: gaps and faults of the description, sorted.
    pub warnings: Vec<Warning>,
    /// The description.
    pub(crate) urdf: urdf_rs::Robot,
}

impl Articulation {
    /// Reads URDF text without meshes and without further limits. Joints may be fixed, revolute, continuous, prismatic, planar or
    /// floating.
    ///
    /// # Errors
    /// As [`Articulation::load`]; a collision mesh is an error.
    pub fn from_urdf(text: &str) -> Result<Self, RobotError> {
        Self::load(text, &mut NoMeshes, &Limits::default()).map(|loaded| loaded.articulation)
    }

    /// Reads URDF text with its collision meshes, which `resources` finds, and with `limits` for joints whose limits lack or are wrong. What
    /// the text leaves open is assumed, with a warning for each assumption ([`Warning`]).
    ///
    /// # Errors
    /// The text is not URDF; links or joints are missing, double, cyclic or unconnected; a joint type or shape is not supported; a mesh is
    /// missing, too large or broken; a number is not finite, implausibly large or negative where it must not be; there are too many joints;
    /// `limits` name a joint that is not there.
    pub fn load(text: &str, resources: &mut dyn Resources, limits: &Limits) -> Result<Loaded, RobotError> {
        size::check(text)?;
        let tidied = text::tidy(text)?;
        let urdf = urdf_rs::read_from_string(&tidied.urdf).map_err(|e| RobotError::Parse(one_line(&e)))?;
        let tree = Tree::new(&urdf)?;
        let mut warnings = tidied.warnings;
        let motions = motions(&urdf, &tree, &tidied.stated, limits, &mut warnings)?;
        let builder = Builder::new(&urdf, &tree, &motions, Shapes::new(&mut *resources), warnings);
        let (articulation, shapes, mut warnings) = builder.build()?;
        let mut meshes = shapes.meshes;
        for (link, file) in tidied.visuals {
            if resources.find(&file).is_err() {
                warnings.push(Warning::NoVisual { link: link.clone(), file: file.clone() });
            }
            meshes.push(MeshUse { link, file, is_collision: false, mesh: None });
        }
        Ok(Loaded { articulation, meshes, warnings: sorted(warnings), urdf })
    }
}

fn one_line(error: &urdf_rs::UrdfError) -> String {
    let mut text = error.to_string();
    let mut source = std::error::Error::source(error);
    while let Some(inner) = source {
        let inner_text = inner.to_string();
        if !text.contains(&inner_text) {
            text = format!("{text}: {inner_text}");
        }
        source = inner.source();
    }
    text.replace('\n', " ")
}
