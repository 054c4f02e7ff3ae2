//! Writes wood as binary glTF 2.0 (`.glb`), for viewers and modelling tools.
//!
//! All segments share one cylinder of unit radius and length; node `linkI` places, turns and scales it. glTF has single precision
//! and y up: the node `tree` above them turns z up into y up, and every segment is placed in the tree's frame rather
//! than in its parent's, so that rounding errors do not add up along a limb. `extras` of a node has parent, radius, length,
//! order and mass.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use gltf_json as json;
use json::validation::{Checked, USize64};
use json::{Index, Root};
use orchard_geometry::math;
use serde_json::{json, value::to_raw_value};

use crate::wood::{Link, Wood};

/// Number of sides of the cylinder.
const SIDES: u32 = 12;

/// Writes the wood as a `.glb` file.
///
/// # Errors
/// The document cannot be written as JSON.
pub fn write(wood: &Wood) -> Result<Vec<u8>, serde_json::Error> {
    let (positions, indices) = cylinder();
    let mut binary: Vec<u8> = positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let indices_at = binary.len();
    binary.extend(indices.iter().flat_map(|i| i.to_le_bytes()));

    let mut root = Root::default();
    let buffer = root.push(buffer(binary.len()));
    let view = |offset, length, target| json::buffer::View {
        buffer,
        byte_length: USize64::from(length),
        byte_offset: Some(USize64::from(offset)),
        byte_stride: None,
        name: None,
        target: Some(Checked::Valid(target)),
        extensions: None,
        extras: None,
    };
    let vertices = root.push(view(0, indices_at, json::buffer::Target::ArrayBuffer));
    let faces =
        root.push(view(indices_at, binary.len() - indices_at, json::buffer::Target::ElementArrayBuffer));
    let positions = root.push(json::Accessor {
        min: Some(json!([-1.0, -1.0, 0.0])),
        max: Some(json!([1.0, 1.0, 1.0])),
        ..accessor(vertices, positions.len(), json::accessor::ComponentType::F32, json::accessor::Type::Vec3)
    });
    let faces = root.push(accessor(
        faces,
        indices.len(),
        json::accessor::ComponentType::U16,
        json::accessor::Type::Scalar,
    ));
    let mesh = root.push(mesh(positions, faces));

    let mut children = Vec::new();
    for link in wood.links() {
        children.push(root.push(segment(&link, mesh)?));
    }
    // A quarter turn about -x: z becomes y.
    let half = FRAC_1_SQRT_2 as f32;
    let tree = root.push(json::Node {
        children: Some(children),
        name: Some("tree".into()),
        rotation: Some(json::scene::UnitQuaternion([-half, 0.0, 0.0, half])),
        ..Default::default()
    });
    root.scene =
        Some(root.push(json::Scene { extensions: None, extras: None, name: None, nodes: vec![tree] }));
    Ok(container(json::serialize::to_vec(&root)?, binary))
}

fn buffer(length: usize) -> json::Buffer {
    json::Buffer { byte_length: USize64::from(length), name: None, uri: None, extensions: None, extras: None }
}

fn accessor(
    view: Index<json::buffer::View>,
    count: usize,
    component: json::accessor::ComponentType,
    kind: json::accessor::Type,
) -> json::Accessor {
    json::Accessor {
        buffer_view: Some(view),
        byte_offset: None,
        count: USize64::from(count),
        component_type: Checked::Valid(json::accessor::GenericComponentType(component)),
        extensions: None,
        extras: None,
        type_: Checked::Valid(kind),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
    }
}

fn mesh(positions: Index<json::Accessor>, indices: Index<json::Accessor>) -> json::Mesh {
    json::Mesh {
        extensions: None,
        extras: None,
        name: Some("wood".into()),
        primitives: vec![json::mesh::Primitive {
            attributes: [(Checked::Valid(json::mesh::Semantic::Positions), positions)].into(),
            extensions: None,
            extras: None,
            indices: Some(indices),
            material: None,
            mode: Checked::Valid(json::mesh::Mode::Triangles),
            targets: None,
        }],
        weights: None,
    }
}

fn segment(link: &Link, mesh: Index<json::Mesh>) -> Result<json::Node, serde_json::Error> {
    let s = link.segment;
    let r = &s.r_world_segment;
    let extras = json!({
        "parent": s.parent, "length": s.length, "radius": s.radius, "order": s.order, "mass": link.body.inertia.mass,
    });
    Ok(json::Node {
        mesh: Some(mesh),
        name: Some(format!("link{}", link.index)),
        translation: Some([s.p_base_world.x as f32, s.p_base_world.y as f32, s.p_base_world.z as f32]),
        rotation: Some(json::scene::UnitQuaternion([r.i as f32, r.j as f32, r.k as f32, r.w as f32])),
        scale: Some([s.radius as f32, s.radius as f32, s.length as f32]),
        extras: Some(to_raw_value(&extras)?),
        ..Default::default()
    })
}

/// A closed cylinder of radius 1 from z = 0 to 1: two rims, then the centres of its ends.
fn cylinder() -> (Vec<[f32; 3]>, Vec<u16>) {
    let rim = |z: f32| {
        (0..SIDES).map(move |k| {
            let (sin, cos) = math::sin_cos(TAU * f64::from(k) / f64::from(SIDES));
            [cos as f32, sin as f32, z]
        })
    };
    let positions = rim(0.0).chain(rim(1.0)).chain([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]).collect();
    let n = SIDES as u16;
    let faces = (0..n).flat_map(|k| {
        let next = (k + 1) % n;
        [[k, next, n + next], [k, n + next, n + k], [next, k, 2 * n], [n + k, n + next, 2 * n + 1]]
    });
    (positions, faces.flatten().collect())
}

/// The container of glTF 2.0: a header and two chunks, each padded to four bytes, all little-endian.
fn container(mut json: Vec<u8>, mut binary: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = 12 + 8 + json.len() + 8 + binary.len();
    let mut file = Vec::with_capacity(total);
    file.extend(b"glTF");
    file.extend(2_u32.to_le_bytes());
    file.extend((total as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", binary)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    file
}
