//! Solids with corners: a core of vertices, edges and faces, and a radius about it.

use std::sync::LazyLock;

use nalgebra::vector;
use orchard_geometry::hull::{HullEdge, HullFace};
use orchard_geometry::{ConvexHull, Pose, Shape, Vec3, transform};

/// The cube with half-extents 1; every box has its faces and edges.
static CUBE: LazyLock<ConvexHull> = LazyLock::new(|| {
    let sign = |index: usize, bit: usize| if index >> bit & 1 == 0 { -1.0 } else { 1.0 };
    let corners: [Vec3; 8] = std::array::from_fn(|i| vector![sign(i, 0), sign(i, 1), sign(i, 2)]);
    ConvexHull::new(&corners).expect("a cube encloses a volume")
});

/// The one edge of a capsule's axis; it has no faces.
const AXIS: [HullEdge; 1] = [HullEdge { vertices: [0, 1], faces: [0, 0] }];

/// A plane with the core under it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    /// Outward unit normal.
    pub normal: Vec3,
    /// `normal . p` of its points \[m\].
    pub offset: f64,
}

impl Plane {
    pub fn height(&self, p: &Vec3) -> f64 {
        self.normal.dot(p) - self.offset
    }
}

/// Memory of a placed core.
#[derive(Debug, Clone, Default)]
pub(super) struct CoreBuffers {
    vertices: Vec<Vec3>,
    planes: Vec<Plane>,
}

/// A placed sphere (one vertex), capsule (one edge), box or hull.
pub(super) struct Core<'s> {
    pub vertices: &'s [Vec3],
    /// Planes of the faces; none for spheres and capsules.
    pub planes: &'s [Plane],
    /// All points within this distance of the core belong to the shape \[m\].
    pub radius: f64,
    hull: Option<&'s ConvexHull>,
}

impl CoreBuffers {
    /// Places a shape; `None` for those without corners (half-spaces and terrain).
    pub fn place<'s>(&'s mut self, shape: &'s Shape, pose: &Pose) -> Option<Core<'s>> {
        self.vertices.clear();
        self.planes.clear();
        let (radius, hull) = match shape {
            Shape::Sphere { radius } => {
                self.vertices.push(pose.translation.vector);
                (*radius, None)
            }
            Shape::Capsule { radius, length } => {
                self.vertices.push(pose.translation.vector);
                self.vertices.push(transform(pose, &Vec3::new(0.0, 0.0, *length)));
                (*radius, None)
            }
            Shape::Box { half } => {
                self.place_hull(&CUBE, half, pose, |face| face.normal.abs().dot(half));
                (0.0, Some(&*CUBE))
            }
            Shape::ConvexHull(hull) => {
                self.place_hull(hull, &Vec3::repeat(1.0), pose, |face| face.offset);
                (0.0, Some(&**hull))
            }
            Shape::HalfSpace | Shape::HeightField(_) => return None,
        };
        Some(Core { vertices: &self.vertices, planes: &self.planes, radius, hull })
    }

    /// A hull stretched along its axes by factors that keep its normals; `offset` of the stretched faces.
    fn place_hull(
        &mut self,
        hull: &ConvexHull,
        stretch: &Vec3,
        pose: &Pose,
        offset: impl Fn(&HullFace) -> f64,
    ) {
        let turn = pose.rotation.to_rotation_matrix();
        let origin = pose.translation.vector;
        self.vertices.extend(hull.vertices().iter().map(|p| turn * p.component_mul(stretch) + origin));
        self.planes.extend(hull.faces().iter().map(|face| {
            let normal = turn * face.normal;
            Plane { normal, offset: offset(face) + normal.dot(&origin) }
        }));
    }
}

impl Core<'_> {
    /// The edges, by the indices of their vertices and planes (an axis has no planes).
    pub fn edges(&self) -> &[HullEdge] {
        match self.hull {
            Some(hull) => hull.edges(),
            None => &AXIS[..self.vertices.len() - 1],
        }
    }

    /// True if the core has faces.
    pub fn is_solid(&self) -> bool {
        self.hull.is_some()
    }

    /// Ends of an edge.
    pub fn ends(&self, edge: &HullEdge) -> [Vec3; 2] {
        edge.vertices.map(|index| self.vertices[index as usize])
    }

    /// Normals of the two faces that meet at an edge of a solid.
    pub fn normals_at(&self, edge: &HullEdge) -> [Vec3; 2] {
        edge.faces.map(|index| self.planes[index as usize].normal)
    }

    /// Vertices about a face of a solid, counter-clockwise from outside; all vertices of a core without faces.
    pub fn boundary(&self, face: usize) -> impl Iterator<Item = Vec3> + Clone + '_ {
        let around = self.hull.map(|hull| hull.boundary(&hull.faces()[face]));
        let count = around.map_or(self.vertices.len(), <[u32]>::len);
        (0..count).map(move |k| self.vertices[around.map_or(k, |around| around[k] as usize)])
    }

    /// Ends of all edges; a sphere's centre twice.
    pub fn segments(&self) -> impl Iterator<Item = [Vec3; 2]> + '_ {
        let edges = self.edges();
        (0..edges.len().max(1))
            .map(move |k| edges.get(k).map_or([self.vertices[0]; 2], |edge| self.ends(edge)))
    }

    /// True if a point of a face's plane lies within its boundary.
    pub fn is_on_face(&self, face: usize, p: &Vec3) -> bool {
        let normal = self.planes[face].normal;
        let around = self.boundary(face);
        around
            .clone()
            .zip(around.cycle().skip(1))
            .all(|(from, to)| normal.cross(&(to - from)).dot(&(p - from)) >= 0.0)
    }

    /// The face whose normal is closest to a direction, and the cosine between; `None` without faces.
    pub fn face_along(&self, direction: &Vec3) -> Option<(usize, f64)> {
        let cosines = self.planes.iter().map(|plane| plane.normal.dot(direction)).enumerate();
        cosines.reduce(|best, other| if other.1 > best.1 { other } else { best })
    }

    /// The vertex farthest along a direction.
    pub fn support(&self, direction: &Vec3) -> Vec3 {
        let reach = |p: &Vec3| (*p, p.dot(direction));
        let farther = |best: (Vec3, f64), other: (Vec3, f64)| if other.1 > best.1 { other } else { best };
        self.vertices.iter().map(reach).reduce(farther).map_or_else(Vec3::zeros, |best| best.0)
    }
}
