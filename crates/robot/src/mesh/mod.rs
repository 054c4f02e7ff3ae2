//! Collision meshes: bytes of STL, OBJ or COLLADA files as convex shapes.
//!
//! `mesh-loader` reads STL and OBJ. Its reader of COLLADA drops shifts of nodes below 10 mm and all but one instance of a geometry, so
//! [`collada`] reads those from the document that `roxmltree` parses.

mod collada;

use crate::plausible::LENGTH_MAX;
use orchard_geometry::{Cover, Vec3, cover};
use serde::Serialize;

/// Most triangles of a mesh, our own choice: twice the largest visual mesh that we have seen, and 50 MB of binary STL.
pub(crate) const TRIANGLES_MAX: usize = 1_000_000;

/// Largest side of a mesh's bounding box \[m\], our own choice: no part of a robot is larger, and a part of 20 mm in millimetres is.
const SIZE_MAX: f64 = 20.0;

/// A collision mesh as it is used.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeshFacts {
    /// Size of the file \[bytes\].
    pub bytes: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// Sides of the bounding box after scaling \[m\].
    pub size: [f64; 3],
    /// Number of convex shapes that stand for the mesh.
    pub shapes: usize,
    /// Number of corners of these shapes.
    pub corners: usize,
    /// Volume of the one convex hull over that of the mesh; `None` for a flat mesh, for which a box stands.
    pub excess: Option<f64>,
}

/// Corners \[m\] and triangles of a mesh.
#[derive(Debug, Clone, Default, PartialEq)]
struct Mesh {
    corners: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// Reads a mesh, scales it and covers it with convex shapes. The error is a line without the name of the file.
pub(crate) fn covered(file: &str, bytes: &[u8], scale: &Vec3) -> Result<(Cover, MeshFacts), String> {
    let mut mesh = read(file, bytes)?;
    for p in &mut mesh.corners {
        p.component_mul_assign(scale);
    }
    // Products of larger numbers overflow.
    let far = mesh.corners.iter().map(|p| p.amax()).filter(|far| far.is_finite()).fold(0.0, f64::max);
    if far > LENGTH_MAX {
        return Err(format!(
            "a corner is {far:.1e} m from the origin, and {LENGTH_MAX:e} m is the most that is read"
        ));
    }
    let cover = cover(&mesh.corners, &mesh.triangles).map_err(|e| e.to_string())?;
    let size = cover.bounds.max - cover.bounds.min;
    if size.max() > SIZE_MAX {
        return Err(format!(
            "the mesh is {:.0} m large, and {SIZE_MAX} m is the most that is read: is it in millimetres? Then its element needs \
             scale=\"0.001 0.001 0.001\"",
            size.max()
        ));
    }
    let facts = MeshFacts {
        bytes: bytes.len(),
        triangles: mesh.triangles.len(),
        size: size.into(),
        shapes: cover.shapes.len(),
        corners: cover.corners,
        excess: cover.excess,
    };
    Ok((cover, facts))
}

fn read(file: &str, bytes: &[u8]) -> Result<Mesh, String> {
    let end = file.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
    let mesh = match end.as_str() {
        "stl" => read_stl(bytes)?,
        "obj" => read_obj(bytes)?,
        "dae" => collada::read(bytes)?,
        _ => return Err("its format is not read: .stl, .obj and .dae (COLLADA) are".to_owned()),
    };
    check_count(mesh.triangles.len())?;
    Ok(mesh)
}

fn check_count(triangles: usize) -> Result<(), String> {
    if triangles > TRIANGLES_MAX {
        return Err(format!("it has {triangles} triangles, and {TRIANGLES_MAX} is the most that is read"));
    }
    Ok(())
}

/// Header and count of a binary STL file \[bytes\].
const STL_HEAD: usize = 84;
/// A triangle of a binary STL file \[bytes\].
const STL_TRIANGLE: usize = 50;

/// Reads binary or ASCII STL. A binary file holds as many triangles as it states.
fn read_stl(bytes: &[u8]) -> Result<Mesh, String> {
    let stated = bytes
        .get(STL_HEAD - 4..STL_HEAD)
        .and_then(|count| Some(u32::from_le_bytes(count.try_into().ok()?) as usize));
    let says_solid = bytes.trim_ascii_start().starts_with(b"solid");
    let holds = bytes.len().saturating_sub(STL_HEAD) / STL_TRIANGLE;
    let is_binary = match stated {
        Some(stated) => !says_solid || STL_HEAD + stated * STL_TRIANGLE == bytes.len(),
        None => false,
    };
    let scene = match stated.filter(|_| is_binary) {
        None => mesh_loader::stl::from_slice(bytes),
        Some(stated) => {
            check_count(stated)?;
            if stated > holds {
                return Err(format!("the file is cut off: it states {stated} triangles and holds {holds}"));
            }
            let mut whole = bytes[..STL_HEAD + stated * STL_TRIANGLE].to_vec();
            // Many writers begin the header of a binary file with the `solid` of the other format.
            whole[..STL_HEAD - 4].fill(0);
            mesh_loader::stl::from_slice(&whole)
        }
    };
    joined(scene)
}

/// Reads OBJ. Its materials are not sought.
fn read_obj(bytes: &[u8]) -> Result<Mesh, String> {
    let faces = bytes.split(|&b| b == b'\n').filter(|line| line.starts_with(b"f "));
    let triangles =
        faces.map(|line| line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).count());
    // A face of n corners is n - 2 triangles, and its line has n + 1 words.
    check_count(triangles.map(|words| words.saturating_sub(3)).sum())?;
    let no_material = |_: &std::path::Path| Err::<Vec<u8>, _>(std::io::ErrorKind::NotFound.into());
    joined(mesh_loader::obj::from_slice(bytes, None, no_material))
}

/// All meshes of a scene as one.
fn joined(scene: std::io::Result<mesh_loader::Scene>) -> Result<Mesh, String> {
    let scene = scene.map_err(|e| format!("it cannot be read: {}", e.to_string().replace('\n', " ")))?;
    let mut all = Mesh::default();
    for mesh in scene.meshes {
        let first = all.corners.len() as u32;
        all.corners.extend(mesh.vertices.iter().map(|p| Vec3::from(p.map(f64::from))));
        all.triangles.extend(mesh.faces.iter().map(|face| face.map(|i| first.saturating_add(i))));
    }
    Ok(all)
}

#[cfg(test)]
mod tests;
