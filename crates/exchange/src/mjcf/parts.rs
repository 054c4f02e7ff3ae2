//! The shapes and anchors of each body of a model, found once: a search for each body takes time in proportion to their number squared.

use orchard_multibody::{BodyId, Model, Owner};

/// Deepest chain of links, our own choice: the deepest trees of this project have 200. A line is indented by a blank for each link that
/// contains it, so a deeper chain gives a file in proportion to its length squared, and readers of XML take stack for each level.
pub const DEEPEST: usize = 1000;

/// Indices by body.
#[derive(Default)]
pub struct Parts {
    links: Vec<Vec<usize>>,
    points: Vec<Vec<usize>>,
    anchors: Vec<Vec<usize>>,
}

impl Parts {
    /// Finds the parts of a model.
    pub fn of(model: &Model) -> Self {
        let empty = |n| vec![Vec::new(); n];
        let (bodies, points) = (model.bodies().len(), model.points().len());
        let mut parts = Self { links: empty(bodies), points: empty(points), anchors: empty(bodies) };
        for (index, collider) in model.colliders().iter().enumerate() {
            match collider.owner {
                Owner::Body(id) => parts.links[id.index()].push(index),
                Owner::Point(id) => parts.points[id.0 as usize].push(index),
                _ => {}
            }
        }
        for (index, point) in model.points().iter().enumerate() {
            if let Some(tether) = &point.tether {
                parts.anchors[tether.body.index()].push(index);
            }
        }
        parts
    }

    /// Indices of the colliders of an owner.
    pub fn colliders(&self, owner: Owner) -> &[usize] {
        match owner {
            Owner::Body(id) => &self.links[id.index()],
            Owner::Point(id) => &self.points[id.0 as usize],
            _ => &[],
        }
    }

    /// Indices of the point bodies that hang from a link.
    pub fn anchors(&self, link: BodyId) -> &[usize] {
        &self.anchors[link.index()]
    }
}

/// The first link that is deeper than [`DEEPEST`].
pub fn too_deep(model: &Model) -> Option<usize> {
    let mut depths: Vec<usize> = Vec::with_capacity(model.bodies().len());
    for id in model.body_ids() {
        let depth = model.body(id).parent.map_or(0, |parent| depths[parent.index()] + 1);
        depths.push(depth);
    }
    depths.iter().position(|&depth| depth >= DEEPEST)
}
