use super::*;

/// Lowest and highest corner, and the number of triangles.
fn facts(file: &str, bytes: &[u8]) -> ([f64; 3], [f64; 3], usize) {
    let mesh = read(file, bytes).unwrap_or_else(|e| panic!("{file}: {e}"));
    let first = mesh.corners[0];
    let bounds = mesh.corners.iter().fold((first, first), |(a, b), p| (a.inf(p), b.sup(p)));
    (bounds.0.into(), bounds.1.into(), mesh.triangles.len())
}

const OBJ: &str =
    "mtllib no.mtl\nv 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nv 0 0 3\nusemtl a\nf 1 2 3 4\nf 1/1/1 2/2/2 5/3/3\n";

fn ascii_stl() -> String {
    "solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 3e0\nendloop\nendfacet\nendsolid t\n".to_owned()
}

fn binary_stl(header: &[u8; 5], triangles: u32) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes[..5].copy_from_slice(header);
    bytes.extend(triangles.to_le_bytes());
    for i in 0..triangles {
        for x in [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, i as f32 + 3.0] {
            bytes.extend(f32::to_le_bytes(x));
        }
        bytes.extend([0, 0]);
    }
    bytes
}

/// A triangle in a scene; `asset`, `geometry` and `nodes` fill a COLLADA file.
fn dae(asset: &str, faces: &str, nodes: &str) -> String {
    format!(
        "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema'><asset>{asset}</asset>\
         <library_geometries><geometry id='g'><mesh><source id='s'><float_array id='f' count='12'>\
         0 0 0 1 0 0 0 2 0 0 0 3</float_array><technique_common><accessor source='#f' count='4' stride='3'/>\
         </technique_common></source><vertices id='v'><input semantic='POSITION' source='#s'/></vertices>{faces}\
         </mesh></geometry></library_geometries><library_nodes><node id='again'>\
         <instance_geometry url='#g'/></node></library_nodes><library_visual_scenes><visual_scene id='w'>{nodes}\
         </visual_scene></library_visual_scenes><scene><instance_visual_scene url='#w'/></scene></COLLADA>"
    )
}

const FACES: &str = "<triangles count='1'><input semantic='VERTEX' source='#v' offset='0'/>\
                     <input semantic='NORMAL' source='#s' offset='1'/><p>0 0 1 0 3 0</p></triangles>";

#[test]
fn the_three_formats_are_read() {
    assert_eq!(facts("a.stl", ascii_stl().as_bytes()), ([0.0; 3], [1.0, 2.0, 3.0], 1));
    assert_eq!(facts("a.STL", &binary_stl(b"plain", 2)), ([0.0; 3], [1.0, 2.0, 4.0], 2));
    // Some writers begin a binary file as the other format begins.
    assert_eq!(facts("a.stl", &binary_stl(b"solid", 2)), ([0.0; 3], [1.0, 2.0, 4.0], 2));
    let mut longer = binary_stl(b"plain", 2);
    longer.extend([7; 13]);
    assert_eq!(facts("a.stl", &longer).2, 2);
    assert_eq!(facts("a.obj", OBJ.as_bytes()), ([0.0; 3], [1.0, 2.0, 3.0], 3));
    let plain = "<node><instance_geometry url='#g'/></node>";
    assert_eq!(facts("a.dae", dae("", FACES, plain).as_bytes()), ([0.0; 3], [1.0, 2.0, 3.0], 1));
}

#[test]
fn collada_places_geometry_by_its_unit_and_its_nodes() {
    // 2 mm to the right in a file of millimetres, which must not be taken for nothing.
    let nodes = "<node><translate>2 0 0</translate><node><rotate>0 0 1 90</rotate><scale>1 1 2</scale>\
                 <instance_geometry url='#g'/></node></node>";
    let (min, max, count) = facts("a.dae", dae("<unit meter='0.001'/>", FACES, nodes).as_bytes());
    assert_eq!(count, 1);
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15);
    assert!(near(min, [0.0, 0.0, 0.0]) && near(max, [0.002, 0.001, 0.006]), "{min:?} {max:?}");
    // One geometry at two places, one of them through another node.
    let twice = "<node><instance_geometry url='#g'/></node>\
                 <node><matrix>1 0 0 10 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_node url='#again'/></node>";
    assert_eq!(
        facts("a.dae", dae("<up_axis>Y_UP</up_axis>", FACES, twice).as_bytes()),
        ([0.0; 3], [11.0, 2.0, 3.0], 2)
    );
    let polygons = "<polylist count='1'><input semantic='VERTEX' source='#v' offset='0'/><vcount>4</vcount>\
                    <p>0 1 2 3</p></polylist><tristrips><input semantic='VERTEX' source='#v' offset='0'/>\
                    <p>0 1 2 3</p></tristrips>";
    assert_eq!(
        facts("a.dae", dae("", polygons, "<node><instance_geometry url='#g'/></node>").as_bytes()).2,
        4
    );
    // No scene: all geometries.
    let loose = dae("", FACES, "").replace("<visual_scene", "<x").replace("</visual_scene", "</x");
    assert_eq!(facts("a.dae", loose.replace("_scenes", "_lamps").replace("'#w'", "'#none'").as_bytes()).2, 1);
}

#[test]
fn broken_files_are_refused_with_a_reason() {
    let error = |file: &str, bytes: &[u8]| read(file, bytes).unwrap_err();
    assert!(error("a.ply", b"ply").contains(".stl, .obj and .dae"));
    assert!(error("a.stl", b"").contains("cannot be read"));
    assert!(error("a.stl", &binary_stl(b"plain", 5)[..200]).contains("states 5 triangles and holds 2"));
    let mut huge = binary_stl(b"plain", 1);
    huge[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(error("a.stl", &huge).contains("4294967295 triangles"));
    assert!(error("a.stl", b"solid a\nfacet normal 0 0").contains("cannot be read"));
    assert!(error("a.obj", b"v 0 0 0\nf 1 2 3\n").contains("cannot be read"));
    let many = "f 1 2 3\n".repeat(1_000_001);
    assert!(error("a.obj", many.as_bytes()).contains("1000001 triangles"));
    assert!(error("a.dae", b"<x/>").contains("not COLLADA"));
    assert!(error("a.dae", b"\xff").contains("UTF-8"));
    let node = "<node><instance_geometry url='#g'/></node>";
    for (file, words) in [
        (dae("<unit meter='inf'/>", FACES, node), "the unit"),
        (dae("", &FACES.replace("#v", "#u"), node), "vertices that are not there"),
        (dae("", FACES, "<node><instance_geometry url='#h'/></node>"), "no geometry `#h`"),
        (dae("", &FACES.replace("0 0 1", "0 x 1"), node), "`x` is no index"),
        (dae("", FACES, "<node><skew>1</skew></node>"), "skew"),
        (dae("", FACES, "<node><matrix>1 2</matrix></node>"), "2 numbers, not 16"),
        (dae("", FACES, "<node id='a'><instance_node url='#a'/></node>"), "use one another"),
        (dae("", FACES, node).replace("2 0 0 0 3", "nan 0 0 0 3"), "no finite number"),
        (format!("<COLLADA>{}", "<a>".repeat(100_000)), "not XML"),
    ] {
        let line = error("a.dae", file.as_bytes());
        assert!(line.contains(words) && line.len() < 300, "{line}: {words}");
    }
    let outside = dae("", &FACES.replace("3 0</p>", "9 0</p>"), node);
    assert!(covered("a.dae", outside.as_bytes(), &Vec3::repeat(1.0)).unwrap_err().contains("corner 9"));
}

#[test]
fn a_mesh_in_millimetres_is_noticed_and_scaled() {
    let large = OBJ.replace("v 1 2 0", "v 350 2 0");
    let line = covered("a.obj", large.as_bytes(), &Vec3::repeat(1.0)).unwrap_err();
    assert!(line.contains("350 m") && line.contains("millimetres"), "{line}");
    let (cover, facts) = covered("a.obj", large.as_bytes(), &Vec3::new(-1e-3, 1e-3, 1e-3)).unwrap();
    assert!((facts.size[0] - 0.35).abs() < 1e-6 && (cover.bounds.min.x + 0.35).abs() < 1e-6, "{facts:?}");
    assert_eq!((facts.triangles, facts.bytes), (3, large.len()));
}
