//! Convex hulls of point clouds.

use parry3d_f64::math::Vector;
use parry3d_f64::shape::ConvexPolyhedron;

use crate::{Pose, Vec3, transform};

/// Least thickness of a cloud, as a share of its length: parry's hull loses points of a plate of 6e-5.
const FLAT: f64 = 3e-4;
/// Largest distance of a corner from the plane of its face, or of a point outside the hull, as a share of the cloud's length.
/// Parry merges two faces that differ by 1.7e-4 rad or less, and a lens that is too thin is then no longer convex.
const MERGED: f64 = 2e-4;

/// Reason why points have no convex hull with a volume.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HullError {
    /// Fewer than four points.
    #[error("a convex hull needs at least 4 points, not {count}")]
    TooFew {
        /// Number of points.
        count: usize,
    },
    /// A coordinate is not finite.
    #[error("point {index} of a convex hull is not finite")]
    NotFinite {
        /// Index of the point.
        index: usize,
    },
    /// The points lie in a plane, on a line or at one position, or so near to a plane that faces cannot be distinguished.
    #[error("the points of a convex hull enclose no volume, or one too thin to tell its faces apart")]
    Flat,
}

/// An edge between two faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HullEdge {
    /// Indices of the two end vertices.
    pub vertices: [u32; 2],
    /// Indices of the two faces that meet at the edge.
    pub faces: [u32; 2],
}

/// A flat face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HullFace {
    /// Outward unit normal.
    pub normal: Vec3,
    /// The hull lies where `normal . p <= offset` \[m\].
    pub offset: f64,
    /// Range of the face's boundary in the list of all boundaries.
    boundary: (u32, u32),
}

/// Convex hull of a point cloud, in its own frame.
///
/// Faces within 1.7e-4 rad of one plane are merged; the merged plane touches the outermost of their corners.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvexHull {
    polyhedron: ConvexPolyhedron,
    vertices: Vec<Vec3>,
    edges: Vec<HullEdge>,
    faces: Vec<HullFace>,
    boundaries: Vec<u32>,
}

impl ConvexHull {
    /// Computes the hull of points \[m\].
    ///
    /// # Errors
    /// [`HullError`] if the points are not finite or enclose no volume.
    pub fn new(points: &[Vec3]) -> Result<ConvexHull, HullError> {
        if let Some(index) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(HullError::NotFinite { index });
        }
        if points.len() < 4 {
            return Err(HullError::TooFew { count: points.len() });
        }
        if is_flat(points) {
            return Err(HullError::Flat);
        }
        let length = points.iter().map(|p| (p - points[0]).norm()).fold(0.0, f64::max);
        let cloud: Vec<Vector> = points.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
        let polyhedron = ConvexPolyhedron::from_convex_hull(&cloud).ok_or(HullError::Flat)?;
        let vertices: Vec<Vec3> = polyhedron.points().iter().map(|p| Vec3::new(p.x, p.y, p.z)).collect();
        let mut faces = Vec::with_capacity(polyhedron.faces().len());
        // Every edge occurs once in each direction: sorted, the two are neighbours.
        let mut sides: Vec<([u32; 2], u32)> = Vec::new();
        let boundaries = polyhedron.vertices_adj_to_face().to_vec();
        for (index, face) in polyhedron.faces().iter().enumerate() {
            let normal = Vec3::new(face.normal.x, face.normal.y, face.normal.z);
            let offset = vertices.iter().map(|p| normal.dot(p)).fold(f64::NEG_INFINITY, f64::max);
            let boundary =
                (face.first_vertex_or_edge, face.first_vertex_or_edge + face.num_vertices_or_edges);
            let around = &boundaries[boundary.0 as usize..boundary.1 as usize];
            for (&from, &to) in around.iter().zip(around.iter().cycle().skip(1)) {
                sides.push(([from.min(to), from.max(to)], index as u32));
            }
            let misses = |k: &u32| offset - normal.dot(&vertices[*k as usize]) > MERGED * length;
            if around.iter().any(misses) || points.iter().any(|p| normal.dot(p) - offset > MERGED * length) {
                return Err(HullError::Flat);
            }
            faces.push(HullFace { normal, offset, boundary });
        }
        sides.sort_unstable();
        let mut edges = Vec::with_capacity(sides.len() / 2);
        for pair in sides.chunks(2) {
            match *pair {
                [(ends, one), (other_ends, other)] if ends == other_ends && one != other => {
                    edges.push(HullEdge { vertices: ends, faces: [one, other] });
                }
                _ => return Err(HullError::Flat),
            }
        }
        Ok(ConvexHull { polyhedron, vertices, edges, faces, boundaries })
    }

    /// Corners \[m\].
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Edges.
    pub fn edges(&self) -> &[HullEdge] {
        &self.edges
    }

    /// Faces.
    pub fn faces(&self) -> &[HullFace] {
        &self.faces
    }

    /// Vertices around a face, counter-clockwise seen from outside.
    pub fn boundary(&self, face: &HullFace) -> &[u32] {
        &self.boundaries[face.boundary.0 as usize..face.boundary.1 as usize]
    }

    /// The hull as parry's type, for parry's queries.
    pub fn parry(&self) -> &ConvexPolyhedron {
        &self.polyhedron
    }

    /// Lowest and highest corner of the placed hull's bounding box.
    pub(crate) fn extent(&self, pose: &Pose) -> (Vec3, Vec3) {
        let first = transform(pose, &self.vertices[0]);
        self.vertices
            .iter()
            .map(|p| transform(pose, p))
            .fold((first, first), |(min, max), p| (min.inf(&p), max.sup(&p)))
    }

    /// Distance from a point to the surface, negative inside: exact on both sides.
    pub fn signed_distance(&self, p: &Vec3) -> f64 {
        let above =
            self.faces.iter().map(|face| face.normal.dot(p) - face.offset).fold(f64::NEG_INFINITY, f64::max);
        if above <= 0.0 {
            return above;
        }
        (p - self.closest_outside(p)).norm().max(above)
    }

    /// Closest point of the surface to a point outside.
    fn closest_outside(&self, p: &Vec3) -> Vec3 {
        let mut best = self.vertices[0];
        let mut consider = |candidate: Vec3| {
            if (p - candidate).norm_squared() < (p - best).norm_squared() {
                best = candidate;
            }
        };
        for edge in &self.edges {
            let [start, end] = edge.vertices.map(|index| self.vertices[index as usize]);
            let along = end - start;
            let share = (along.dot(&(p - start)) / along.norm_squared()).clamp(0.0, 1.0);
            consider(start + along * share);
        }
        for face in &self.faces {
            let height = face.normal.dot(p) - face.offset;
            let foot = p - face.normal * height;
            if height > 0.0 && self.is_on_face(face, &foot) {
                consider(foot);
            }
        }
        best
    }

    /// True if a point of a face's plane lies within the face's boundary.
    fn is_on_face(&self, face: &HullFace, p: &Vec3) -> bool {
        let around = self.boundary(face);
        around.iter().zip(around.iter().cycle().skip(1)).all(|(&from, &to)| {
            let (from, to) = (self.vertices[from as usize], self.vertices[to as usize]);
            face.normal.cross(&(to - from)).dot(&(p - from)) >= 0.0
        })
    }
}

/// True if the points lie in a plane, to [`FLAT`] of their length.
fn is_flat(points: &[Vec3]) -> bool {
    let farthest = |measure: &dyn Fn(&Vec3) -> f64| {
        points.iter().fold((points[0], f64::NEG_INFINITY), |best, p| {
            let size = measure(p);
            if size > best.1 { (*p, size) } else { best }
        })
    };
    let origin = points[0];
    let (end, length) = farthest(&|p| (p - origin).norm());
    if length <= 0.0 {
        return true;
    }
    let along = (end - origin) / length;
    let (side, width) = farthest(&|p| along.cross(&(p - origin)).norm());
    if width <= FLAT * length {
        return true;
    }
    let normal = along.cross(&(side - origin)) / width;
    farthest(&|p| normal.dot(&(p - origin)).abs()).1 <= FLAT * length
}
