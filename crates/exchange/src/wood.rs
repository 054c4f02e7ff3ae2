//! Links and joints of the wood for the formats of simulators, taken from the simulated model.

use orchard_geometry::Pose;
use orchard_multibody::{Body, Groups, Model, ModelBuilder, ModelError};
use orchard_spec::wood::WoodSpec;
use orchard_treegen::{Segment, Skeleton};
use orchard_treephys::{TreeBody, TreeGroups};

/// A skeleton with its simulated links and joints. Link i is segment i.
#[derive(Debug, Clone)]
pub struct Wood<'a> {
    skeleton: &'a Skeleton,
    model: Model,
    tree: TreeBody,
}

/// One segment and its link.
#[derive(Clone, Copy)]
pub(crate) struct Link<'a> {
    pub index: usize,
    pub segment: &'a Segment,
    pub body: &'a Body,
    /// Bending stiffness of its joint [N m/rad].
    pub stiffness: f64,
    /// Bending damping of its joint [N m s/rad].
    pub damping: f64,
}

impl<'a> Wood<'a> {
    /// Makes the links of a skeleton.
    ///
    /// # Errors
    /// The skeleton has no valid model.
    pub fn new(skeleton: &'a Skeleton, wood: &WoodSpec) -> Result<Self, ModelError> {
        let mut builder = ModelBuilder::new();
        let groups = TreeGroups { wood: Groups::NONE, debris: Groups::NONE };
        let tree = TreeBody::add_to(&mut builder, skeleton, wood, groups);
        Ok(Self { skeleton, model: builder.build()?, tree })
    }

    pub(crate) fn links(&self) -> impl Iterator<Item = Link<'_>> {
        self.skeleton.segments.iter().enumerate().map(|(index, segment)| Link {
            index,
            segment,
            body: self.model.body(self.tree.bodies[index]),
            stiffness: self.tree.stiffness[index],
            damping: self.tree.damping[index],
        })
    }
}

impl Link<'_> {
    /// Pose of the joint in the parent's frame; that of the root in the world.
    pub fn x_parent_joint(&self) -> &Pose {
        &self.body.x_parent_joint
    }

    /// Principal moments of inertia about the centre of mass, along the segment's axes [kg m^2].
    pub fn moments(&self) -> [f64; 3] {
        let i = &self.body.inertia.i_com;
        [i[(0, 0)], i[(1, 1)], i[(2, 2)]]
    }
}

/// Shortest texts that read back as the same numbers, joined by a separator.
pub(crate) fn numbers(values: &[f64], separator: &str) -> String {
    values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(separator)
}
