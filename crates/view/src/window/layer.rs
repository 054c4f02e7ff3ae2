//! Meshes on the device, with their instances.

use std::collections::BTreeMap;

use orchard_play::{INSTANCE_FLOATS, MESH_FLOATS, Mesh};
use wgpu::util::DeviceExt;

pub const FLOAT: u64 = size_of::<f32>() as u64;

/// A mesh on the device: each vertex once, and the triangles as places in them.
struct Loaded {
    vertices: wgpu::Buffer,
    places: wgpu::Buffer,
    count: u32,
    look: Look,
}

/// Form of a mesh, by which it is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// With normals, closed: no back is seen.
    Closed,
    /// With normals, open.
    Open,
    /// Without normals: each triangle has its own.
    Facets,
}

impl Look {
    fn of(mesh: &Mesh) -> Self {
        let has_normals = mesh.floats.get(9..MESH_FLOATS).is_some_and(|n| n.iter().any(|x| *x != 0.0));
        match (has_normals, mesh.is_open) {
            (false, _) => Self::Facets,
            (true, false) => Self::Closed,
            (true, true) => Self::Open,
        }
    }
}

/// A list of meshes on the device, with their instances.
pub struct Layer {
    meshes: Vec<Loaded>,
    instances: wgpu::Buffer,
    counts: Vec<u32>,
}

/// The vertices of a mesh, each once, and the triangles as places in them. Numbers that differ by less than a millionth are the same.
fn indexed(mesh: &Mesh) -> (Vec<f32>, Vec<u32>) {
    const UNIT: f32 = 1e-6;
    let (mut known, mut vertices, mut places) = (BTreeMap::new(), Vec::new(), Vec::new());
    for vertex in mesh.floats.chunks_exact(MESH_FLOATS) {
        let key: Vec<i64> = vertex.iter().map(|x| (x / UNIT).round() as i64).collect();
        let next = known.len() as u32;
        let place = *known.entry(key).or_insert(next);
        if place == next {
            vertices.extend(vertex);
        }
        places.push(place);
    }
    (vertices, places)
}

fn instance_buffer(device: &wgpu::Device, floats: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("instances"),
        size: floats.max(1).next_power_of_two() as u64 * FLOAT,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

impl Layer {
    /// No meshes.
    pub fn new(device: &wgpu::Device) -> Self {
        Self { meshes: Vec::new(), instances: instance_buffer(device, 1), counts: Vec::new() }
    }

    /// True without meshes.
    pub fn is_empty(&self) -> bool {
        self.meshes.is_empty()
    }

    /// Forgets the meshes: others follow.
    pub fn forget(&mut self) {
        self.meshes.clear();
        self.counts.clear();
    }

    /// Number of instances of a mesh.
    pub fn count(&self, mesh: usize) -> u32 {
        self.counts.get(mesh).copied().unwrap_or(0)
    }

    /// Brings meshes that are not there yet and all instances to the device.
    pub fn load<'a>(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        meshes: impl IntoIterator<Item = &'a Mesh>,
        instances: &[&[f32]],
    ) {
        for mesh in meshes.into_iter().skip(self.meshes.len()) {
            let (vertices, places) = indexed(mesh);
            let buffer = |contents, usage| {
                device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: Some("mesh"),
                    contents,
                    usage,
                })
            };
            self.meshes.push(Loaded {
                vertices: buffer(bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
                places: buffer(bytemuck::cast_slice(&places), wgpu::BufferUsages::INDEX),
                count: places.len() as u32,
                look: Look::of(mesh),
            });
        }
        let floats: usize = instances.iter().map(|list| list.len()).sum();
        if self.instances.size() < floats as u64 * FLOAT {
            self.instances = instance_buffer(device, floats);
        }
        let mut offset = 0;
        for list in instances.iter().filter(|list| !list.is_empty()) {
            queue.write_buffer(&self.instances, offset, bytemuck::cast_slice(list));
            offset += list.len() as u64 * FLOAT;
        }
        self.counts = instances.iter().map(|list| (list.len() / INSTANCE_FLOATS) as u32).collect();
    }

    /// Draws the instances of every mesh for which there is a pipeline; returns the number of draw calls.
    pub fn draw<'a>(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: impl Fn(usize, Look) -> Option<&'a wgpu::RenderPipeline>,
    ) -> u32 {
        let (mut offset, mut calls) = (0, 0);
        for (number, (count, mesh)) in self.counts.iter().zip(&self.meshes).enumerate() {
            if *count > 0
                && mesh.count > 0
                && let Some(pipeline) = pipeline(number, mesh.look)
            {
                pass.set_pipeline(pipeline);
                pass.set_vertex_buffer(0, mesh.vertices.slice(..));
                pass.set_vertex_buffer(1, self.instances.slice(offset..));
                pass.set_index_buffer(mesh.places.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..mesh.count, 0, 0..*count);
                calls += 1;
            }
            offset += u64::from(*count) * INSTANCE_FLOATS as u64 * FLOAT;
        }
        calls
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_play::Fineness;

    /// A capsule of 8 sides has 4 rings of 8 vertices and 2 poles.
    #[test]
    fn shared_vertices_are_kept_once() {
        let mesh = Mesh::capsule(Fineness::TWIG);
        let (vertices, places) = indexed(&mesh);
        assert_eq!((vertices.len() / MESH_FLOATS, places.len()), (4 * 8 + 2, 3 * mesh.triangles()));
        for (place, vertex) in places.iter().zip(mesh.floats.chunks(MESH_FLOATS)) {
            let kept = &vertices[*place as usize * MESH_FLOATS..][..MESH_FLOATS];
            assert!(kept.iter().zip(vertex).all(|(a, b)| (a - b).abs() <= 1e-6));
        }
        assert_eq!([Look::of(&mesh), Look::of(&Mesh::square())], [Look::Closed, Look::Open]);
    }
}
