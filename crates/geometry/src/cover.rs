//! Convex shapes that stand for a triangle mesh.
//!
//! A contact costs time by parts and corners, so a mesh of any size becomes one hull or a few parts with a bounded number of corners. All
//! bounds of this file are our own choice.

use std::sync::Arc;

use parry3d_f64::math::Vector;
use parry3d_f64::transformation::vhacd::{VHACD, VHACDParameters};
use parry3d_f64::transformation::voxelization::{FillMode, VoxelSet};

use crate::{Aabb, ConvexHull, Mat3, Pose, Rotation, Shape, Vec3, math};

/// Directions in which the corners of a hull are sought, so its largest number of corners. A ball's hull then lies inside the ball by at
/// most 7 % of its radius.
const CORNERS: usize = 64;
/// Volume of the hull over that of the mesh from which on a mesh is cut into convex parts. An elbow of two equal tubes has about 1.5.
const EXCESS: f64 = 1.5;
/// Voxels along the longest side of a mesh, for its volume and its parts.
const VOXELS: u32 = 32;
/// Number of parts that the decomposition aims at. It halves a mesh three times at most and does not join halves, so 8 may come out.
const PARTS_WANTED: u32 = 4;
/// Volume, as a share of the whole hull's, by which a part's hull may exceed the part.
const CONCAVITY: f64 = 0.05;
/// Distances below which two corners become one, as shares of the cloud's diagonal: the first that gives a hull is taken.
const NEIGHBOURS: [f64; 4] = [1e-5, 1e-3, 5e-3, 2e-2];
/// Least half-extent of the box that stands for a flat mesh \[m\].
const HALF_THICKNESS: f64 = 5e-4;
/// Least half-extent of that box, as a share of its length: a hull of less has faces that cannot be distinguished.
const HALF_SHARE: f64 = 5e-4;

/// Convex shapes that stand for a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Cover {
    /// Shapes with their poses in the frame of the mesh: hulls, or one box for a flat mesh.
    pub shapes: Vec<(Shape, Pose)>,
    /// Number of corners of all shapes.
    pub corners: usize,
    /// Volume of the one hull over that of the mesh, with closed hollows filled; `None` for a flat mesh.
    pub excess: Option<f64>,
    /// Bounding box of the mesh.
    pub bounds: Aabb,
}

/// Reason for which a mesh has no cover.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CoverError {
    /// No triangle.
    #[error("the mesh has no triangle")]
    Empty,
    /// A triangle names a corner that the mesh does not have.
    #[error("triangle {triangle} names corner {corner}, which the mesh does not have")]
    NoCorner {
        /// Index of the triangle.
        triangle: usize,
        /// Index of the corner.
        corner: u32,
    },
    /// A coordinate is not finite.
    #[error("corner {corner} of the mesh is not finite")]
    NotFinite {
        /// Index of the corner.
        corner: u32,
    },
}

/// Covers a mesh: by its convex hull, or by up to 8 convex parts if the hull has 1.5 times the volume of the mesh or more. A flat mesh gets a
/// box at least 1 mm thick.
///
/// # Errors
/// The mesh has no triangle, a triangle names a corner that is not there, or a corner is not finite.
pub fn cover(corners: &[Vec3], triangles: &[[u32; 3]]) -> Result<Cover, CoverError> {
    let mut used = Vec::with_capacity(3 * triangles.len());
    for (triangle, ends) in triangles.iter().enumerate() {
        for &corner in ends {
            let p = corners.get(corner as usize).ok_or(CoverError::NoCorner { triangle, corner })?;
            if !p.iter().all(|x| x.is_finite()) {
                return Err(CoverError::NotFinite { corner });
            }
            used.push(*p);
        }
    }
    let first = *used.first().ok_or(CoverError::Empty)?;
    let bounds = used
        .iter()
        .fold(Aabb { min: first, max: first }, |b, p| Aabb { min: b.min.inf(p), max: b.max.sup(p) });
    let one = |shape, x, excess| {
        let corners = count_corners(&shape);
        Cover { shapes: vec![(shape, x)], corners, excess, bounds }
    };
    let Some(hull) = hull(&used) else {
        let (shape, x) = slab(&used);
        return Ok(one(shape, x, None));
    };
    let (voxels, points, indices) = voxels(corners, triangles);
    let excess = volume(&hull) / filled_volume(&voxels);
    if excess < EXCESS {
        return Ok(one(Shape::ConvexHull(Arc::new(hull)), Pose::identity(), Some(excess)));
    }
    let shapes = parts(voxels, &points, &indices);
    if shapes.is_empty() {
        return Ok(one(Shape::ConvexHull(Arc::new(hull)), Pose::identity(), Some(excess)));
    }
    let corners = shapes.iter().map(|(shape, _)| count_corners(shape)).sum();
    Ok(Cover { shapes, corners, excess: Some(excess), bounds })
}

/// A hull, or the box of a flat cloud. There is at least one point, and all are finite.
fn solid(points: &[Vec3]) -> (Shape, Pose) {
    match hull(points) {
        Some(hull) => (Shape::ConvexHull(Arc::new(hull)), Pose::identity()),
        None => slab(points),
    }
}

/// Hull of the points that lie farthest out in [`CORNERS`] directions; `None` for a flat cloud.
fn hull(points: &[Vec3]) -> Option<ConvexHull> {
    let first = points.first()?;
    let (min, max) = points.iter().fold((*first, *first), |(min, max), p| (min.inf(p), max.sup(p)));
    // Directions are spread over a cloud that is stretched to a cube, so that a long link gets corners along its sides.
    let stretch = (max - min).map(|extent| if extent > 0.0 { 1.0 / extent } else { 0.0 });
    let mut ends: Vec<usize> = directions()
        .map(|direction| {
            let along = direction.component_mul(&stretch);
            let ahead = points.iter().map(|p| along.dot(p)).enumerate();
            ahead.fold((0, f64::NEG_INFINITY), |best, at| if at.1 > best.1 { at } else { best }).0
        })
        .collect();
    ends.sort_unstable();
    ends.dedup();
    // Corners that almost coincide can make faces that cannot be distinguished, so more and more are taken as one.
    NEIGHBOURS.iter().find_map(|share| {
        let mut chosen: Vec<Vec3> = Vec::with_capacity(ends.len());
        for &end in &ends {
            if chosen.iter().all(|p| (p - points[end]).norm() > share * (max - min).norm()) {
                chosen.push(points[end]);
            }
        }
        ConvexHull::new(&chosen).ok()
    })
}

/// The axes both ways, and directions on a Fibonacci spiral.
fn directions() -> impl Iterator<Item = Vec3> {
    let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
    let axes = axes.into_iter().flat_map(|axis| [axis, -axis]);
    let others = CORNERS - 6;
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let spiral = (0..others).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f64 / others as f64;
        let (sin, cos) = math::sin_cos(golden * i as f64);
        let radius = (1.0 - z * z).sqrt();
        Vec3::new(radius * cos, radius * sin, z)
    });
    axes.chain(spiral)
}

/// The smaller of two boxes about a cloud that is flat, or nearly so: along the axes, or along its length, its width and its normal.
fn slab(points: &[Vec3]) -> (Shape, Pose) {
    let (own, straight) = (placed_box(points, &own_axes(points)), placed_box(points, &Mat3::identity()));
    let (half, x) = if own.0.product() < straight.0.product() { own } else { straight };
    (Shape::Box { half }, x)
}

/// Axes along the length, the width and the normal of a cloud, as columns.
fn own_axes(points: &[Vec3]) -> Mat3 {
    let origin = points[0];
    let farthest = |measure: &dyn Fn(&Vec3) -> Vec3| {
        let offsets = points.iter().map(measure);
        offsets.fold(Vec3::zeros(), |best, v| if v.norm_squared() > best.norm_squared() { v } else { best })
    };
    let along = farthest(&|p| p - origin).try_normalize(0.0).unwrap_or_else(Vec3::x);
    let side = farthest(&|p| (p - origin) - along * along.dot(&(p - origin)));
    let spare = if along.x.abs() < 0.5 { Vec3::x() } else { Vec3::y() };
    let side = side.try_normalize(0.0).unwrap_or_else(|| along.cross(&spare).normalize());
    // Made exact once more: the offset from a line of a cloud on a line is round-off.
    let side = (side - along * along.dot(&side)).normalize();
    Mat3::from_columns(&[along, side, along.cross(&side)])
}

/// Half-extents and pose of the box about a cloud along axes.
fn placed_box(points: &[Vec3], axes: &Mat3) -> (Vec3, Pose) {
    let turned = points.iter().map(|p| axes.tr_mul(p));
    let (min, max) = turned
        .fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)), |(a, b), p| {
            (a.inf(&p), b.sup(&p))
        });
    let length = (max - min).max();
    let half = ((max - min) * 0.5).map(|x| x.max(HALF_THICKNESS).max(HALF_SHARE * length));
    // The closed form: the search for the nearest rotation need not end.
    let rotation = Rotation::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(*axes));
    (half, Pose::from_parts((axes * ((min + max) * 0.5)).into(), rotation))
}

fn count_corners(shape: &Shape) -> usize {
    match shape {
        Shape::ConvexHull(hull) => hull.vertices().len(),
        _ => 8,
    }
}

/// Volume of a hull \[m^3\].
fn volume(hull: &ConvexHull) -> f64 {
    let vertices = hull.vertices();
    let centre = vertices.iter().sum::<Vec3>() / vertices.len() as f64;
    let cones = hull.faces().iter().map(|face| {
        let around: Vec<Vec3> = hull.boundary(face).iter().map(|&i| vertices[i as usize] - centre).collect();
        let fans = around.windows(2).map(|w| around[0].dot(&w[0].cross(&w[1])));
        fans.sum::<f64>() / 6.0
    });
    cones.sum()
}

fn parry_points(corners: &[Vec3]) -> Vec<Vector> {
    corners.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect()
}

/// Voxels of a mesh whose hull has a volume, with closed hollows filled; and the mesh itself for parry.
fn voxels(corners: &[Vec3], triangles: &[[u32; 3]]) -> (VoxelSet, Vec<Vector>, Vec<[u32; 3]>) {
    // Corners that no triangle uses may be anywhere.
    let mut numbers = vec![u32::MAX; corners.len()];
    let mut used = Vec::new();
    let mut number = |corner: u32| {
        let known = &mut numbers[corner as usize];
        if *known == u32::MAX {
            *known = used.len() as u32;
            used.push(corners[corner as usize]);
        }
        *known
    };
    let indices: Vec<[u32; 3]> = triangles.iter().map(|ends| ends.map(&mut number)).collect();
    let points = parry_points(&used);
    let fill = FillMode::FloodFill { detect_cavities: false };
    let voxels = VoxelSet::voxelize(&points, &indices, VOXELS, fill, true);
    (voxels, points, indices)
}

/// Volume of a mesh by its voxels: those on the surface lie half inside \[m^3\].
fn filled_volume(voxels: &VoxelSet) -> f64 {
    let halves: u32 = voxels.voxels().iter().map(|v| if v.is_on_surface { 1 } else { 2 }).sum();
    0.5 * f64::from(halves) * voxels.voxel_volume()
}

/// Convex parts by approximate convex decomposition (Mamou and Ghorbel 2009, in parry), each a hull of the triangles in its voxels.
fn parts(voxels: VoxelSet, points: &[Vector], triangles: &[[u32; 3]]) -> Vec<(Shape, Pose)> {
    let settings = VHACDParameters {
        concavity: CONCAVITY,
        max_convex_hulls: PARTS_WANTED,
        ..VHACDParameters::default()
    };
    let decomposition = VHACD::from_voxels(&settings, voxels);
    let of_part = |part: &VoxelSet| {
        let cloud = part.compute_primitive_intersections(points, triangles);
        let cloud: Vec<Vec3> = cloud.iter().map(|p| Vec3::new(p.x, p.y, p.z)).collect();
        // A part may lie wholly inside, where there are no triangles.
        (!cloud.is_empty()).then(|| solid(&cloud))
    };
    decomposition.voxel_parts().iter().filter_map(of_part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners and triangles of boxes, given by their lowest and highest corners.
    fn boxes(all: &[[[f64; 3]; 2]]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        const FACES: [[u32; 4]; 6] =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let (mut corners, mut triangles) = (Vec::new(), Vec::new());
        for ends in all {
            let first = corners.len() as u32;
            for i in 0..8 {
                let pick = |k: usize| ends[i >> k & 1][k];
                corners.push(Vec3::new(pick(0), pick(1), pick(2)));
            }
            for [a, b, c, d] in FACES {
                triangles.extend([[a, b, c], [a, c, d]].map(|t| t.map(|i| first + i)));
            }
        }
        (corners, triangles)
    }

    #[test]
    fn a_box_keeps_its_eight_corners() {
        let (corners, triangles) = boxes(&[[[-0.1, 0.0, 0.2], [0.3, 0.1, 0.25]]]);
        let cover = cover(&corners, &triangles).unwrap();
        assert_eq!((cover.shapes.len(), cover.corners), (1, 8));
        assert!((cover.excess.unwrap() - 1.0).abs() < 0.25, "{:?}", cover.excess);
        let Shape::ConvexHull(hull) = &cover.shapes[0].0 else { panic!("{cover:?}") };
        assert!((volume(hull) - 0.4 * 0.1 * 0.05).abs() < 1e-12);
        assert_eq!(cover.bounds, Aabb { min: Vec3::new(-0.1, 0.0, 0.2), max: Vec3::new(0.3, 0.1, 0.25) });
    }

    #[test]
    fn an_angle_iron_becomes_parts_that_leave_its_corner_free() {
        let (corners, triangles) =
            boxes(&[[[0.0, 0.0, 0.0], [0.5, 0.05, 0.1]], [[0.0, 0.0, 0.0], [0.05, 0.5, 0.1]]]);
        let cover = cover(&corners, &triangles).unwrap();
        assert!(cover.shapes.len() > 1 && cover.shapes.len() <= 8, "{}", cover.shapes.len());
        assert!(cover.excess.unwrap() > 2.0, "{:?}", cover.excess);
        let distance = |p: Vec3| {
            let to = cover.shapes.iter().map(|(s, x)| s.signed_distance(&crate::inverse_transform(x, &p)));
            to.fold(f64::INFINITY, f64::min)
        };
        // The one hull would hold this point.
        assert!(distance(Vec3::new(0.2, 0.2, 0.05)) > 0.05, "{}", distance(Vec3::new(0.2, 0.2, 0.05)));
        for (x, y) in [(0.4, 0.03), (0.03, 0.4), (0.02, 0.02)] {
            assert!(distance(Vec3::new(x, y, 0.05)) < 0.005, "{}", distance(Vec3::new(x, y, 0.05)));
        }
    }

    /// A fine ball: many corners become few, and the hull stays near the ball.
    #[test]
    fn a_hull_has_a_bounded_number_of_corners() {
        let (rows, columns) = (60_u32, 120_u32);
        let mut corners = Vec::new();
        for row in 0..=rows {
            let (sin, cos) = math::sin_cos(std::f64::consts::PI * f64::from(row) / f64::from(rows));
            for column in 0..columns {
                let (y, x) = math::sin_cos(std::f64::consts::TAU * f64::from(column) / f64::from(columns));
                corners.push(Vec3::new(sin * x, sin * y, cos));
            }
        }
        let mut triangles = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let at = |r: u32, c: u32| r * columns + c % columns;
                let [a, b] = [at(row, column), at(row, column + 1)];
                let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
                triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
        let cover = cover(&corners, &triangles).unwrap();
        let Shape::ConvexHull(hull) = &cover.shapes[0].0 else { panic!("{cover:?}") };
        assert!(cover.shapes.len() == 1 && cover.corners <= CORNERS, "{}", cover.corners);
        let outside = corners.iter().map(|p| hull.signed_distance(p)).fold(0.0, f64::max);
        assert!(outside < 0.07, "{outside}");
    }

    #[test]
    fn flat_meshes_become_thin_boxes_and_no_mesh_is_an_error() {
        let plate = [[0.0, 0.0, 0.0], [1.0, 0.0, 1.0], [1.0, 0.5, 1.0], [0.0, 0.5, 0.0]].map(Vec3::from);
        let made = cover(&plate, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let [(Shape::Box { half }, x)] = made.shapes.as_slice() else { panic!("{made:?}") };
        // A plate of sqrt 2 by 0.5, tilted by 45 degrees.
        let mut sizes: Vec<f64> = half.iter().map(|x| 2.0 * x).collect();
        sizes.sort_by(f64::total_cmp);
        assert!(sizes[0] > 9e-4 && sizes[0] < 4e-3 && (sizes[2] - 1.5).abs() < 0.2, "{sizes:?}");
        assert!((x.translation.vector - Vec3::new(0.5, 0.25, 0.5)).norm() < 1e-9, "{x}");
        for p in &plate {
            assert!(made.shapes[0].0.signed_distance(&crate::inverse_transform(x, p)) < 1e-9);
        }
        for points in [[Vec3::x(), Vec3::x(), Vec3::x()], [Vec3::zeros(), Vec3::y(), Vec3::y() * 2.0]] {
            assert!(matches!(cover(&points, &[[0, 1, 2]]).unwrap().shapes[0].0, Shape::Box { .. }));
        }
        assert_eq!(cover(&plate, &[]), Err(CoverError::Empty));
        assert_eq!(cover(&plate, &[[0, 1, 9]]), Err(CoverError::NoCorner { triangle: 0, corner: 9 }));
        let bad = [Vec3::zeros(), Vec3::x(), Vec3::new(0.0, f64::NAN, 0.0)];
        assert_eq!(cover(&bad, &[[0, 1, 2]]), Err(CoverError::NotFinite { corner: 2 }));
        // A corner that no triangle uses does not matter.
        let spare = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::repeat(f64::INFINITY)];
        assert!(cover(&spare, &[[0, 1, 2]]).is_ok());
    }
}
