use super::*;

/// The corners of every triangle under sizes, with their first corner's normal.
fn triangles_of(mesh: &Mesh, sizes: [f64; 3]) -> Vec<([Vec3; 3], Vec3)> {
    let vector = |numbers: &[f32]| Vec3::new(numbers[0].into(), numbers[1].into(), numbers[2].into());
    let place = |vertex: &[f32]| -> Vec3 { (0..3).map(|k| vector(&vertex[3 * k..]) * sizes[k]).sum() };
    let of = |triangle: &[f32]| {
        let corners = [0, 1, 2].map(|k| place(&triangle[k * MESH_FLOATS..]));
        (corners, vector(&triangle[9..]))
    };
    mesh.floats.chunks(3 * MESH_FLOATS).map(of).collect()
}

/// Volume inside a closed mesh by the divergence theorem; every triangle looks outwards.
fn volume(mesh: &Mesh, sizes: [f64; 3]) -> f64 {
    let triangles = triangles_of(mesh, sizes);
    for ([a, b, c], normal) in &triangles {
        assert!((b - a).cross(&(c - a)).dot(normal) >= -1e-9, "a triangle looks inwards");
    }
    triangles.iter().map(|([a, b, c], _)| a.dot(&b.cross(c)) / 6.0).sum()
}

#[test]
fn meshes_enclose_their_solids() {
    let (radius, length) = (0.3, 2.0);
    let solid = std::f64::consts::PI * radius * radius * (length + 4.0 / 3.0 * radius);
    let share = volume(&Mesh::capsule(Fineness::TWIG), [radius, length, 0.0]) / solid;
    assert!(share > 0.85 && share < 1.0, "{share}");
    let ball = 4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius;
    let share = volume(&Mesh::capsule(Fineness::APPLE), [radius, 0.0, 0.0]) / ball;
    assert!(share > 0.93 && share < 1.0, "{share}");
    assert!((volume(&Mesh::cuboid(), [1.0, 2.0, 3.0]) - 48.0).abs() < 1e-9);
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vec3::from);
    let hull = ConvexHull::new(&corners).unwrap();
    assert!((volume(&Mesh::hull(&hull), [1.0, 0.0, 0.0]) - 1.0 / 6.0).abs() < 1e-6);
}

#[test]
fn a_blade_is_the_cameras_blade() {
    let blade = BladeMesh::new(0.35, 0.7);
    let mesh = Mesh::blade(&blade);
    let (length, width) = (0.085, 0.05);
    let vertices = blade.vertices(length, width);
    for ((corners, _), indices) in triangles_of(&mesh, [length, width, 0.0]).iter().zip(triangles()) {
        for (corner, index) in corners.iter().zip(indices) {
            assert!((corner - vertices[index]).norm() < 1e-8);
        }
    }
}

/// The coarse blade has the ellipse's area under every length and width, ends where the blade does, and its two normals stand on its halves.
#[test]
fn a_coarse_blade_covers_as_much_as_a_leaf() {
    let blade = BladeMesh::new(0.35, 0.7);
    let mesh = Mesh::coarse_blade(&blade);
    assert!(mesh.is_open && mesh.triangles() == 4);
    for (length, width) in [(0.085, 0.05), (0.04, 0.03)] {
        let triangles = triangles_of(&mesh, [length, width, 0.0]);
        let across = |[a, b, c]: &[Vec3; 3]| (b - a).cross(&(c - a));
        for (corners, normal) in &triangles {
            assert!(across(corners).normalize().dot(normal).abs() > 1.0 - 1e-6 && normal.z > 0.0);
        }
        let chord = blade.vertices(length, width)[1].norm() / length;
        let area: f64 = triangles.iter().map(|(corners, _)| 0.5 * across(corners).norm()).sum();
        let ellipse = std::f64::consts::FRAC_PI_4 * length * width * chord;
        assert!((area / ellipse - 1.0).abs() < 0.01, "{}", area / ellipse);
        let tip = triangles.iter().flat_map(|(corners, _)| corners).map(|p| p.x).fold(0.0, f64::max);
        assert!((tip - blade.vertices(length, width)[1].x).abs() < 1e-8);
    }
}
