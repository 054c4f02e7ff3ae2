//! Geometry of COLLADA files: the instances of the visual scene, placed by their nodes, in metres.
//!
//! The axes are taken as they stand, whatever `up_axis` says, as ROS does: RViz, MoveIt and Pinocchio undo the turn that other readers
//! make, and the meshes of public robots rely on that.

use super::{Mesh, check_count};
use nalgebra::{Matrix4, Rotation3, Unit, Vector4};
use orchard_geometry::Vec3;
use roxmltree::{Document, Node};
use std::collections::BTreeMap;

/// Most nodes of a scene, our own choice; nodes that are used again count again, so nodes that use one another come to an end.
const NODES_MAX: usize = 10_000;

/// Most numbers that are read, our own choice; those of a geometry that is used again count again. A mesh of the largest size has 9 million
/// coordinates and up to 12 million indices.
const NUMBERS_MAX: usize = 30_000_000;

/// A document on its way to a mesh.
struct Reader<'a> {
    /// Elements by their ids.
    ids: BTreeMap<&'a str, Node<'a, 'a>>,
    mesh: Mesh,
    /// Count of the numbers read so far.
    read: usize,
}

/// Reads a file; the error is a line without its name.
pub(super) fn read(bytes: &[u8]) -> Result<Mesh, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not text in UTF-8".to_owned())?;
    let text = text.trim_start_matches('\u{feff}');
    let document = Document::parse(text).map_err(|e| format!("it is not XML: {e}"))?;
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err(format!("it is not COLLADA: its first element is `{}`", root.tag_name().name()));
    }
    let ids = root.descendants().filter_map(|node| Some((node.attribute("id")?, node))).collect();
    let mut reader = Reader { ids, mesh: Mesh::default(), read: 0 };
    let unit = child(root, "asset").and_then(|asset| child(asset, "unit")).and_then(|u| u.attribute("meter"));
    let unit = unit.map_or(Ok(1.0), |text| number(text, "the unit"))?;
    let placed = Matrix4::new_scaling(unit);
    let instance = child(root, "scene").and_then(|scene| child(scene, "instance_visual_scene"));
    let named = instance.and_then(|instance| reader.target(instance.attribute("url")));
    let any = || child(root, "library_visual_scenes").and_then(|library| child(library, "visual_scene"));
    match named.or_else(any) {
        Some(scene) => reader.add_scene(scene, placed)?,
        // A file without a scene is a list of geometries.
        None => {
            for geometry in root.descendants().filter(|node| node.has_tag_name_of("geometry")) {
                reader.add_geometry(geometry, &placed)?;
            }
        }
    }
    Ok(reader.mesh)
}

/// Comparison of tags without their namespace: writers use several.
trait Tagged {
    fn has_tag_name_of(&self, name: &str) -> bool;
}

impl Tagged for Node<'_, '_> {
    fn has_tag_name_of(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|inner| inner.has_tag_name_of(name))
}

impl<'a> Reader<'a> {
    /// The element that a reference such as `#base` names.
    fn target(&self, url: Option<&str>) -> Option<Node<'a, 'a>> {
        self.ids.get(url?.strip_prefix('#')?).copied()
    }

    /// Adds all geometry of a scene.
    fn add_scene(&mut self, scene: Node<'a, 'a>, placed: Matrix4<f64>) -> Result<(), String> {
        let mut open = vec![(scene, placed)];
        let mut visited = 0;
        while let Some((node, outer)) = open.pop() {
            visited += 1;
            if visited > NODES_MAX {
                return Err(format!("it has more than {NODES_MAX} nodes, or nodes that use one another"));
            }
            let placed = outer * transform_of(node)?;
            let mut inner = Vec::new();
            for part in node.children().filter(Node::is_element) {
                let url = part.attribute("url");
                match part.tag_name().name() {
                    "node" => inner.push((part, placed)),
                    "instance_node" => inner.extend(self.target(url).map(|node| (node, placed))),
                    "instance_geometry" => {
                        let missing = || format!("there is no geometry `{}`", short(url.unwrap_or_default()));
                        self.add_geometry(self.target(url).ok_or_else(missing)?, &placed)?;
                    }
                    _ => {}
                }
            }
            open.extend(inner.into_iter().rev());
        }
        Ok(())
    }

    /// Adds the triangles of a geometry.
    fn add_geometry(&mut self, geometry: Node<'a, 'a>, placed: &Matrix4<f64>) -> Result<(), String> {
        let Some(body) = child(geometry, "mesh") else { return Ok(()) };
        for faces in body.children().filter(Node::is_element) {
            let kind = faces.tag_name().name();
            if !matches!(kind, "triangles" | "polylist" | "polygons" | "tristrips" | "trifans") {
                continue;
            }
            let inputs: Vec<Node> = faces.children().filter(|n| n.has_tag_name_of("input")).collect();
            let offset =
                |input: &Node| input.attribute("offset").unwrap_or("0").parse::<usize>().unwrap_or(0);
            let stride = inputs.iter().map(offset).max().unwrap_or(0).saturating_add(1);
            let vertex = inputs.iter().find(|input| input.attribute("semantic") == Some("VERTEX"));
            let Some(vertex) = vertex else { return Err(format!("its `{kind}` have no vertices")) };
            let first = self.mesh.corners.len() as u32;
            self.add_positions(self.target(vertex.attribute("source")), placed)?;
            let counts = child(faces, "vcount").map(|list| self.indices(list)).transpose()?;
            for list in faces.children().filter(|n| n.has_tag_name_of("p")) {
                let all = self.indices(list)?;
                let corners: Vec<u32> = all.iter().skip(offset(vertex)).step_by(stride).copied().collect();
                self.add_faces(kind, &corners, counts.as_deref(), first)?;
            }
        }
        Ok(())
    }

    /// Adds the corners that the input `VERTEX` of faces names.
    fn add_positions(&mut self, vertices: Option<Node<'a, 'a>>, placed: &Matrix4<f64>) -> Result<(), String> {
        let positions = vertices.and_then(|vertices| {
            let mut inputs = vertices.children().filter(|n| n.has_tag_name_of("input"));
            self.target(inputs.find(|n| n.attribute("semantic") == Some("POSITION"))?.attribute("source"))
        });
        let source = positions.ok_or("its faces name vertices that are not there")?;
        let values = child(source, "float_array").and_then(|n| n.text()).unwrap_or_default();
        let values = numbers(values, "float_array")?;
        self.count(values.len())?;
        let accessor = child(source, "technique_common").and_then(|n| child(n, "accessor"));
        let entry = |key: &str, default: usize| {
            accessor.and_then(|a| a.attribute(key)).and_then(|text| text.parse().ok()).unwrap_or(default)
        };
        let (skip, stride) = (entry("offset", 0), entry("stride", 3).max(3));
        let rows = values.get(skip..).unwrap_or_default().chunks(stride).filter(|row| row.len() >= 3);
        let corner = |row: &[f64]| (placed * Vector4::new(row[0], row[1], row[2], 1.0)).xyz();
        self.mesh.corners.extend(rows.map(corner));
        Ok(())
    }

    /// Adds faces as triangles; `corners` count from the corner `first` of the mesh.
    fn add_faces(
        &mut self,
        kind: &str,
        corners: &[u32],
        counts: Option<&[u32]>,
        first: u32,
    ) -> Result<(), String> {
        let triangles = &mut self.mesh.triangles;
        let mut add = |ends: [u32; 3]| triangles.push(ends.map(|i| first.saturating_add(i)));
        let mut fan = |face: &[u32]| (2..face.len()).for_each(|i| add([face[0], face[i - 1], face[i]]));
        match kind {
            "triangles" => corners.chunks_exact(3).for_each(fan),
            "tristrips" => corners.windows(3).for_each(fan),
            "polylist" => {
                let mut rest = corners;
                for &count in counts.unwrap_or_default() {
                    let short = || "its `polylist` has fewer corners than it states".to_owned();
                    let (face, others) = rest.split_at_checked(count as usize).ok_or_else(short)?;
                    fan(face);
                    rest = others;
                }
            }
            _ => fan(corners),
        }
        check_count(self.mesh.triangles.len())
    }

    fn indices(&mut self, list: Node) -> Result<Vec<u32>, String> {
        let index =
            |word: &str| word.parse().map_err(|_| format!("`{}` is no index of a corner", short(word)));
        let text = list.text().unwrap_or_default();
        let all: Vec<u32> = text.split_ascii_whitespace().map(index).collect::<Result<_, _>>()?;
        self.count(all.len())?;
        Ok(all)
    }

    /// Counts numbers that were read.
    fn count(&mut self, numbers: usize) -> Result<(), String> {
        // A list without numbers costs time, too.
        self.read += numbers.max(1);
        match self.read > NUMBERS_MAX {
            true => Err(format!("it has more than {NUMBERS_MAX} numbers, or uses its geometries too often")),
            false => Ok(()),
        }
    }
}

/// Transform of a node: the product of its elements in their order.
fn transform_of(node: Node) -> Result<Matrix4<f64>, String> {
    let mut placed = Matrix4::identity();
    for part in node.children().filter(Node::is_element) {
        let tag = part.tag_name().name();
        let count = match tag {
            "matrix" => 16,
            "rotate" => 4,
            "translate" | "scale" => 3,
            "lookat" | "skew" => {
                return Err(format!("its nodes have the transform `{tag}`, which is not read"));
            }
            _ => continue,
        };
        let values = numbers(part.text().unwrap_or_default(), tag)?;
        if values.len() != count {
            return Err(format!("`{tag}` has {} numbers, not {count}", values.len()));
        }
        placed *= match tag {
            "matrix" => Matrix4::from_row_slice(&values),
            "translate" => Matrix4::new_translation(&Vec3::from_column_slice(&values)),
            "scale" => Matrix4::new_nonuniform_scaling(&Vec3::from_column_slice(&values)),
            _ => match Unit::try_new(Vec3::from_column_slice(&values[..3]), 0.0) {
                Some(axis) => Rotation3::from_axis_angle(&axis, values[3].to_radians()).to_homogeneous(),
                None => Matrix4::identity(),
            },
        };
    }
    Ok(placed)
}

fn numbers(text: &str, place: &str) -> Result<Vec<f64>, String> {
    text.split_ascii_whitespace().map(|word| number(word, place)).collect()
}

fn number(word: &str, place: &str) -> Result<f64, String> {
    match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(format!("`{place}` holds `{}`, which is no finite number", short(word))),
    }
}

/// The first characters of a word that may have any length.
fn short(word: &str) -> String {
    word.chars().take(24).collect()
}
