//! The readers of input files: an error, or something that can be used.

use std::path::Path;
use std::sync::{Mutex, OnceLock, PoisonError};

use orchard_exchange::{colour_image, depth_image, json, mtg};
use orchard_leaderboard::Board;
use orchard_multibody::{Body, ModelBuilder};
use orchard_network::{Network, Port, Tensor};
use orchard_perception::DetectorConfig;
use orchard_recording::Recording;
use orchard_recording::bag::{Bag, BagMessage, Topics};
use orchard_robot::{Articulation, Draft, Limits, PAPER_URDF, Resources, RobotConfig, RobotModel, Survey};
use orchard_scenario::{Scenario, controllers};
use orchard_spec::camera::CameraSpec;
use orchard_spec::{Preset, Spec};
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::plan_file::PlanFile;
use orchard_tasks::protocol::{self, Protocol};
use orchard_tasks::seeds::SeedSetName;
use orchard_tasks::verify::Trajectory;
use orchard_world::{Snapshot, World};
use sha2::{Digest, Sha256};

use crate::edit::{case, edited};

/// A valid file that `cargo xtask fuzz` wrote; empty if there is none.
fn valid(name: &str) -> &'static [u8] {
    static FILE: OnceLock<Vec<u8>> = OnceLock::new();
    FILE.get_or_init(|| {
        let folder = std::env::var_os("ORCHARD_FUZZ_FILES").unwrap_or_default();
        std::fs::read(Path::new(&folder).join(name)).unwrap_or_default()
    })
}

fn text(valid: &[u8], bytes: &[u8]) -> String {
    String::from_utf8_lossy(&case(valid, bytes)).into_owned()
}

/// `plan.json`, with the scenarios that it holds.
pub fn plan(bytes: &[u8]) {
    let Ok(file) = PlanFile::from_bytes(&case(valid("plan.json"), bytes)) else { return };
    for (task, planned) in &file.tasks {
        let Some(stored) = file.scenario(task) else { continue };
        let _ = planned.plan.check(&Protocol::paper());
        if let Ok(scenario) = Scenario::from_stored(stored, &controllers(), "fuzz") {
            let _ = Protocol::of_scenario(&scenario).map(|protocol| planned.plan.check(&protocol));
        }
    }
}

/// The record of an episode.
pub fn record(bytes: &[u8]) {
    let bytes = case(valid("record.json"), bytes);
    let Ok(record) = serde_json::from_slice::<EpisodeRecord>(&bytes) else { return };
    let _ = (record.deposited().count(), record.dropped().count());
    let again = serde_json::to_vec(&record).unwrap();
    let read = serde_json::from_slice::<EpisodeRecord>(&again).unwrap();
    assert_eq!(serde_json::to_vec(&read).unwrap(), again);
}

/// A leaderboard.
pub fn board(bytes: &[u8]) {
    static VALID: OnceLock<Vec<u8>> = OnceLock::new();
    let valid = VALID.get_or_init(|| {
        let scenario = Scenario::of(&[]).unwrap();
        serde_json::to_vec_pretty(&Board::new(&Protocol::paper().version, SeedSetName::Tuning, &scenario))
            .unwrap()
    });
    let Ok(board) = Board::from_json(&text(valid, bytes)) else { return };
    let again = serde_json::to_string(&board).unwrap();
    assert!(Board::from_json(&again).is_ok());
}

/// A snapshot, under a checksum that is right, restored into a world.
pub fn snapshot(bytes: &[u8]) {
    static WORLD: OnceLock<(Mutex<World>, Vec<u8>)> = OnceLock::new();
    let (world, valid) = WORLD.get_or_init(|| {
        let world = Scenario::of(&[]).unwrap().world(1, 0, 0).unwrap();
        let file = world.snapshot().to_bytes();
        (Mutex::new(world), file[HEADER..file.len() - CHECKSUM].to_vec())
    });
    let mut world = world.lock().unwrap_or_else(PoisonError::into_inner);
    let _ = Snapshot::from_bytes(bytes);
    let whole = Snapshot::from_bytes(&sealed(&world.snapshot().to_bytes(), &edited(valid, bytes)));
    if let Ok(snapshot) = whole {
        let _ = world.restore(&snapshot);
    }
}

/// Magic, version and length of a snapshot \[bytes\].
const HEADER: usize = 20;
/// Length of a SHA-256 \[bytes\].
const CHECKSUM: usize = 32;

/// A body in the envelope of a snapshot.
fn sealed(whole: &[u8], body: &[u8]) -> Vec<u8> {
    let mut file = whole[..HEADER - size_of::<u64>()].to_vec();
    file.extend((body.len() as u64).to_le_bytes());
    file.extend(body);
    let checksum = Sha256::digest(&file);
    file.extend(checksum);
    file
}

/// A recording, and a bag of ROS 2.
pub fn mcap(bytes: &[u8]) {
    const BAG: &[u8] = include_bytes!("../../crates/program/src/commands/detect/tests/two_images.mcap");
    const PACKED: &[u8] = include_bytes!("../../crates/program/src/commands/detect/tests/colour_images.mcap");
    let path = Path::new("fuzz.mcap");
    let _ = Recording::from_bytes(path, &case(valid("episode.mcap"), bytes));
    let topics = Topics {
        depth: "/camera/depth/image_rect_raw".into(),
        info: "/camera/depth/camera_info".into(),
        colour: None,
    };
    read_bag(Bag::new(path, case(BAG, bytes).as_slice(), &topics));
    let topics = Topics {
        depth: "/camera/depth/image_inverse/compressedDepth".into(),
        info: "/camera/depth/camera_info".into(),
        colour: Some("/camera/color/image/jpeg/compressed".into()),
    };
    read_bag(Bag::new(path, case(PACKED, bytes).as_slice(), &topics));
}

fn read_bag(mut bag: Bag<&[u8]>) {
    let is_depth =
        |depth: &orchard_geometry::DepthImage| depth.pixels().iter().all(|z| z.is_finite() && *z >= 0.0);
    while let Ok(Some((_, message))) = bag.next_message() {
        match message {
            BagMessage::Image(image) => assert!(is_depth(&image.depth(image.usual_unit()))),
            BagMessage::PackedDepth(packed) => {
                if let Ok(raw) = depth_image::read_transported(&packed.format, &packed.data) {
                    let unit = raw.usual_unit();
                    assert!(raw.depth(unit).is_ok_and(|depth| is_depth(&depth)));
                }
            }
            BagMessage::Colour(image) => drop(image.rgb()),
            BagMessage::PackedColour(packed) => drop(colour_image::read(&packed.data)),
            BagMessage::Info(_) => {}
        }
    }
}

/// A trajectory as a table and as JSON lines.
pub fn trajectory(bytes: &[u8]) {
    const CSV: &str = "time,q1,q2,q3,q4,q5,q6,q7,vx,vy,wz,finger_q,finger_force\n\
                       0,0,-0.7,0,-2.3,0,1.5,0.7,0.1,0,0,0.04,20\n0.5,0,-0.7,0,-2.3,0,1.5,0.7,0.1,0,0,0.04,20\n";
    const LINES: &str = r#"{"time": 0, "arm_q": [0, -0.7, 0, -2.3, 0, 1.5, 0.7], "base_velocity": [0.1, 0, 0], "finger_q": 0.04, "finger_force": 20}"#;
    static ROBOT: OnceLock<RobotModel> = OnceLock::new();
    let robot = ROBOT.get_or_init(RobotModel::paper);
    if let Ok(trajectory) = Trajectory::from_csv("fuzz.csv", &text(CSV.as_bytes(), bytes), robot, 600.0) {
        assert!(Trajectory::from_csv("again.csv", &trajectory.to_csv(), robot, 600.0).is_ok());
    }
    let _ = Trajectory::from_json_lines("fuzz.jsonl", &text(LINES.as_bytes(), bytes), robot, 600.0);
}

/// A digitised tree as MTG and as JSON.
pub fn tree(bytes: &[u8]) {
    const MTG: &str = "CODE:\tFORM-A\n\nCLASSES:\nSYMBOL\tSCALE\tDECOMPOSITION\tINDEXATION\tDEFINITION\n$\t0\tFREE\tFREE\tIMPLICIT\n\
        P\t1\tFREE\tFREE\tEXPLICIT\nI\t2\tFREE\tFREE\tEXPLICIT\n\nDESCRIPTION:\nLEFT\tRIGHT\tRELTYPE\tMAX\nI\tI\t+\t?\nI\tI\t<\t?\n\n\
        FEATURES:\nNAME\tTYPE\nXX\tREAL\nYY\tREAL\nZZ\tREAL\nTopDia\tREAL\nOrder\tINT\n\nMTG:\nENTITY-CODE\t\tXX\tYY\tZZ\tTopDia\tOrder\n\
        /P1\n^/I1\t\t0\t0\t1\t0.05\t0\n\t+I2\t0.3\t0\t1.2\t0.02\t1\n^<I3\t\t0\t0\t1.5\t0.04\t0\n";
    static JSON: OnceLock<Vec<u8>> = OnceLock::new();
    let spec = || Spec::paper();
    let json_text = JSON.get_or_init(|| {
        let tree = mtg::read(MTG).unwrap_or_else(|e| panic!("{e}"));
        json::write(&tree.into_skeleton(&spec(), 1, 0)).into_bytes()
    });
    let trees = [mtg::read(&text(MTG.as_bytes(), bytes)), json::read(&text(json_text, bytes))];
    for tree in trees.into_iter().flatten() {
        let skeleton = tree.into_skeleton(&spec(), 1, 0);
        let _ = mtg::read(&mtg::write(&skeleton));
    }
}

/// Mesh files of one valid content for each format, edited.
struct Meshes<'a>(&'a [u8]);

impl Resources for Meshes<'_> {
    fn read(&mut self, name: &str) -> Result<Vec<u8>, String> {
        const STL: &str = "solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 1\nendloop\n\
                           endfacet\nendsolid t\n";
        const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
        const DAE: &str = "<COLLADA><asset><unit meter='0.1'/></asset><library_geometries><geometry id='g'><mesh>\
            <source id='s'><float_array>0 0 0 1 0 0 0 2 0 0 0 3</float_array></source><vertices id='v'>\
            <input semantic='POSITION' source='#s'/></vertices><triangles><input semantic='VERTEX' source='#v'/>\
            <p>0 1 2 0 1 3 0 2 3 1 2 3</p></triangles></mesh></geometry></library_geometries><library_visual_scenes>\
            <visual_scene><node id='n'><rotate>0 0 1 90</rotate><instance_geometry url='#g'/></node></visual_scene>\
            </library_visual_scenes></COLLADA>";
        let mut binary = vec![0; 80];
        binary.extend(1_u32.to_le_bytes());
        binary.extend([1, 2, 3, 64].repeat(12));
        binary.extend([0; 2]);
        let valid = match name {
            "a.obj" => OBJ.as_bytes(),
            "a.dae" => DAE.as_bytes(),
            "b.stl" => &binary,
            _ => STL.as_bytes(),
        };
        Ok(case(valid, self.0))
    }

    fn find(&mut self, name: &str) -> Result<(), String> {
        self.read(name).map(|_| ())
    }
}

/// A robot, its meshes and its limits file. What loads can be simulated.
pub fn urdf(bytes: &[u8]) {
    const ROBOT: &str = "<robot name='r'><link name='a'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial>\
        <collision><geometry><mesh filename='a.stl'/></geometry></collision></link><link name='b'><collision><geometry>\
        <mesh filename='a.obj' scale='1 -1 2'/></geometry></collision></link><link name='c'><inertial><mass value='2'/>\
        <inertia ixx='0' iyy='3' izz='1'/></inertial><collision><geometry><mesh filename='a.dae'/></geometry></collision>\
        <collision><geometry><mesh filename='b.stl'/></geometry></collision></link><joint name='j' type='continuous'>\
        <parent link='a'/><child link='b'/><limit velocity='1'/></joint><joint name='k' type='revolute'><parent link='b'/>\
        <child link='c'/><limit lower='0' upper='1'/><mimic joint='j' multiplier='2' offset='1'/></joint></robot>";
    const LIMITS: &str = "[j]\nlower = -1.0\nupper = 2.0\n\n[k]\nvelocity = 1.0\neffort = 20.0\n";
    let config = RobotConfig::paper();
    let limits = Limits::from_toml("fuzz.toml", &text(LIMITS.as_bytes(), bytes)).unwrap_or_default();
    for valid in [PAPER_URDF, ROBOT] {
        for text in [valid.to_owned(), text(valid.as_bytes(), bytes)] {
            let Ok(loaded) = Articulation::load(&text, &mut Meshes(bytes), &limits) else { continue };
            let _ = (Survey::of(&text, &loaded, &config), Draft::of(&loaded));
            let mut builder = ModelBuilder::new();
            let mut bodies = Vec::new();
            for link in &loaded.articulation.links {
                bodies.push(builder.add_body(Body {
                    parent: link.parent.map(|p| bodies[p]),
                    joint: link.joint,
                    x_parent_joint: link.x_parent_joint,
                    inertia: link.inertia,
                }));
            }
            builder.build().unwrap();
        }
    }
}

/// A network in ONNX format. What reads can be computed.
pub fn onnx(bytes: &[u8]) {
    let Ok(network) = Network::from_bytes(&case(include_bytes!("../../tests/network/reach.onnx"), bytes))
    else {
        return;
    };
    let inputs: Result<Vec<Tensor>, _> = network.inputs().iter().map(Port::zeros).collect();
    let _ = inputs.and_then(|inputs| network.run(inputs));
}

/// Configs: world, camera, detector, robot, protocol.
pub fn toml(bytes: &[u8]) {
    let world = text(Preset::Paper.toml().as_bytes(), bytes);
    let _ = Spec::from_toml("fuzz.toml", &world);
    let _ = CameraSpec::from_toml("fuzz.toml", &text(CameraSpec::FILES[0].1.as_bytes(), bytes));
    let _ = DetectorConfig::from_toml("fuzz.toml", &text(DetectorConfig::FILES[0].1.as_bytes(), bytes));
    let _ = Protocol::from_toml("fuzz.toml", &text(protocol::PAPER_TOML.as_bytes(), bytes));
}
