//! Leaf blade: an elliptical blade, folded along its midrib and curled, as a small triangle mesh.
//!
//! Origin at the petiole, +x along the midrib, +z the upper face. The depth camera, the pictures and the recordings use the
//! same mesh, so a leaf hides the same pixels in depth images and pictures.

use orchard_geometry::{Vec3, math};
use orchard_spec::foliage::FoliageSpec;

/// Positions along the midrib, as parts of its length, at which the outline has a vertex on either side.
const STATIONS: [f64; 3] = [0.2, 0.5, 0.8];

/// Number of vertices of a blade.
pub const VERTICES: usize = 2 + 3 * STATIONS.len();
/// Number of triangles of a blade.
pub const TRIANGLES: usize = 4 * STATIONS.len();

/// A vertex of the unit blade: position = length * `along` + width * `across`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Vertex {
    along: Vec3,
    across: Vec3,
}

/// Mesh of a leaf blade of unit length and width, shared by all leaves of a tree.
#[derive(Debug, Clone, PartialEq)]
pub struct BladeMesh {
    vertices: [Vertex; VERTICES],
}

impl BladeMesh {
    /// Makes the mesh from two angles \[rad\]: `fold`, by which each half rises from the flat blade, and `curl`, through
    /// which the midrib bends down from petiole to tip.
    pub fn new(fold: f64, curl: f64) -> Self {
        // Vertex 0 is the petiole, 1 the tip; then (midrib, left, right) of every station.
        let mut vertices = [Vertex { along: Vec3::zeros(), across: Vec3::zeros() }; VERTICES];
        vertices[1].along = midrib(curl, 1.0).0;
        let (rise, spread) = math::sin_cos(fold);
        for (i, &s) in STATIONS.iter().enumerate() {
            let (along, up) = midrib(curl, s);
            // Ellipse: half the width at s of the length.
            let half = 0.5 * (1.0 - (2.0 * s - 1.0) * (2.0 * s - 1.0)).sqrt();
            for (k, side) in [0.0, 1.0, -1.0].into_iter().enumerate() {
                let across = half * (Vec3::y() * (side * spread) + up * (f64::abs(side) * rise));
                vertices[2 + 3 * i + k] = Vertex { along, across };
            }
        }
        Self { vertices }
    }

    /// Makes the mesh with the angles of a config.
    pub fn from_spec(foliage: &FoliageSpec) -> Self {
        Self::new(foliage.blade_fold.si(), foliage.blade_curl.si())
    }

    /// Vertices of a blade of a length and a full width \[m\], in the blade's frame \[m\].
    pub fn vertices(&self, length: f64, width: f64) -> [Vec3; VERTICES] {
        self.vertices.map(|v| v.along * length + v.across * width)
    }
}

/// Point and upward normal of the midrib at a part `s` of its length: a circular arc of unit length through `curl` \[rad\].
fn midrib(curl: f64, s: f64) -> (Vec3, Vec3) {
    if curl == 0.0 {
        return (Vec3::x() * s, Vec3::z());
    }
    let (sin, cos) = math::sin_cos(curl * s);
    (Vec3::new(sin, 0.0, cos - 1.0) / curl, Vec3::new(sin, 0.0, cos))
}

/// Vertex indices of every triangle, counter-clockwise seen from the upper face.
pub const fn triangles() -> [[usize; 3]; TRIANGLES] {
    let mut out = [[0; 3]; TRIANGLES];
    let n = STATIONS.len();
    let mut count = 0;
    let mut side = 0;
    while side < 2 {
        let mut i = 0;
        while i <= n {
            // The strip between station i - 1 and i; station -1 is the petiole, station n the tip.
            let (mid_a, edge_a) = if i == 0 { (0, 0) } else { (3 * i - 1, 3 * i + side) };
            let (mid_b, edge_b) = if i == n { (1, 1) } else { (3 * i + 2, 3 * i + 3 + side) };
            if i > 0 {
                out[count] = if side == 0 { [mid_a, mid_b, edge_a] } else { [mid_a, edge_a, mid_b] };
                count += 1;
            }
            if i < n {
                out[count] = if side == 0 { [mid_b, edge_b, edge_a] } else { [mid_b, edge_a, edge_b] };
                count += 1;
            }
            i += 1;
        }
        side += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_look_up_and_cover_the_ellipse() {
        let (length, width) = (0.085, 0.05);
        let v = BladeMesh::new(0.35, 0.7).vertices(length, width);
        let mut area = 0.0;
        for [a, b, c] in triangles() {
            let n = (v[b] - v[a]).cross(&(v[c] - v[a]));
            assert!(n.z > 0.0, "{a} {b} {c}");
            area += 0.5 * n.norm();
        }
        // The polygon through five points a side of an ellipse; inscribed, so below pi/4 l w.
        let ellipse = std::f64::consts::FRAC_PI_4 * length * width;
        assert!(area > 0.80 * ellipse && area < ellipse, "{}", area / ellipse);
    }

    #[test]
    fn a_flat_blade_lies_in_its_plane() {
        let (flat, nearly) = (BladeMesh::new(0.0, 0.0), BladeMesh::new(0.0, 1e-6));
        for (p, q) in flat.vertices(0.1, 0.05).iter().zip(nearly.vertices(0.1, 0.05)) {
            assert!(p.z == 0.0 && (p - q).norm() < 1e-6, "{p} {q}");
        }
    }

    #[test]
    fn edges_are_shared_once_in_each_direction_or_on_the_rim() {
        let mut edges: Vec<(usize, usize)> =
            triangles().iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
        edges.sort_unstable();
        let count = edges.len();
        edges.dedup();
        assert_eq!(count, edges.len(), "an edge runs twice in one direction");
        let rim = edges.iter().filter(|&&(a, b)| edges.binary_search(&(b, a)).is_err()).count();
        assert_eq!(rim, 2 * (STATIONS.len() + 1));
    }
}
