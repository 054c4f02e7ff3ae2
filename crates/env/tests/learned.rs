//! Learned controllers: they act in the benchmark as in the environment in which they learned, a result keeps what it needs to run them again,
//! and what does not fit is refused.

use std::fs;
use std::path::{Path, PathBuf};

use orchard_env::{Settings, Task, TaskEnv};
use orchard_network::{Network, Tensor};
use orchard_picker::Goal;
use orchard_policy::{DepthReading, Encoding, Reading, Spaces, Values};
use orchard_scenario::{Scenario, StoredScenario, controllers};
use orchard_tasks::component::{Component, ReachAndGrasp};
use orchard_tasks::harvest::trial;
use orchard_tasks::protocol::Protocol;
use orchard_world::World;

const SEED: u64 = 20250704;

fn network_file(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/network");
    fs::read(folder.join(format!("{name}.onnx"))).unwrap()
}

fn settings(task: Task) -> Settings {
    let settings = Settings::of(task);
    let spaces = Spaces { depth: task == Task::Harvest, ..settings.spaces.clone() };
    Settings { spaces, ..settings }
}

fn env(task: Task) -> TaskEnv {
    let mut env = TaskEnv::new(&Scenario::of(&[]).unwrap(), &settings(task), 0..1).unwrap();
    env.reset(&[Some(SEED)], &[true]).unwrap();
    env
}

/// Writes a policy's files as a training script would: the spec is the environment's interface.
fn files(folder: &Path, name: &str, task: Task, change: impl Fn(String) -> String) -> PathBuf {
    let interface = TaskEnv::new(&Scenario::of(&[]).unwrap(), &settings(task), 0..1).unwrap();
    let spec = serde_json::to_string(interface.interface()).unwrap();
    fs::write(folder.join(format!("{name}.json")), change(spec)).unwrap();
    let path = folder.join(format!("{name}.onnx"));
    fs::write(&path, network_file(name)).unwrap();
    path
}

fn under(path: &Path) -> Scenario {
    Scenario::of(&[("controller", &format!("onnx:{}", path.display()))]).unwrap()
}

fn refusal(path: &Path) -> String {
    let refused =
        Scenario::of(&[("controller", &format!("onnx:{}", path.display()))]).unwrap_err().to_string();
    refused.replace(&format!("{}/", path.parent().unwrap().display()), "")
}

/// A network's inputs of an observation, by their names, and its states.
fn inputs(network: &Network, env: &TaskEnv, states: &[Tensor]) -> Vec<Tensor> {
    let fields = &env.interface().policy.observation;
    let mut states = states.iter();
    let input = |port: &orchard_network::Port| {
        let Some(i) = fields.iter().position(|field| field.key == port.name) else {
            return states.next().unwrap().clone();
        };
        let Values::F32(v) = &env.observation(0)[i] else { panic!("{}", port.name) };
        let shape: Vec<usize> = port.shape.iter().map(|d| d.unwrap_or(1)).collect();
        Tensor::f32(&shape, v.clone()).unwrap()
    };
    network.inputs().iter().map(input).collect()
}

#[test]
fn a_policy_acts_in_the_benchmark_as_in_the_environment_in_which_it_learned() {
    let folder = tempfile::tempdir().unwrap();
    for (name, task) in [("harvest", Task::Harvest), ("reach", Task::Reach)] {
        let scenario = under(&files(folder.path(), name, task, |spec| spec));
        assert_eq!(scenario.controller_kind().notes(), Vec::<String>::new());
        let mut env = env(task);
        let (seed, index) = env.world(0).unwrap();
        let mut world = scenario.world(seed, index, 0).unwrap();
        let target = ReachAndGrasp::targets(&world, &Protocol::paper().component, seed).into_iter().next();
        let goal = target.filter(|_| task == Task::Reach).map(|target| ReachAndGrasp::goal(&target));
        let mut controller = match &goal {
            Some(goal) => scenario.controller_with_goal(goal).unwrap(),
            None => scenario.controller(),
        };
        let encoding = encoding(&scenario, &settings(task).spaces, &world);
        let network = Network::from_bytes(&network_file(name)).unwrap();
        let (mut states, mut actions) = (vec![], Vec::new());
        if name == "harvest" {
            states.push(Tensor::f32(&[1, 8], vec![0.0; 8]).unwrap());
        }
        let size = env.interface().policy.action.len();
        for step in 0..8 {
            if actions.is_empty() {
                let mut outputs = network.run(inputs(&network, &env, &states)).unwrap();
                states = outputs.split_off(1);
                actions = outputs[0].as_f32().unwrap().to_vec();
            }
            let next: Vec<f32> = actions.drain(..size).collect();
            env.step(&next, &[true]).unwrap();
            for _ in 0..env.interface().policy.frames {
                let command = controller.act(&world.observe());
                world.step(&command);
            }
            assert!(next.iter().any(|x| x.abs() > 0.01), "a policy that does something");
            let seen = look(&encoding, &mut world.clone(), &goal);
            assert!(seen == env.observation(0), "{name}: step {step} differs");
        }
    }
}

fn encoding(scenario: &Scenario, spaces: &Spaces, world: &World) -> Encoding {
    let view = world.spec().camera.view();
    let size = [view.width.get() as usize, view.height.get() as usize];
    Encoding::new(scenario.robot(), spaces, size, world.spec().sim.frame_rate.si()).unwrap()
}

/// The observation of a world, with the latest image up to now.
fn look(encoding: &Encoding, world: &mut World, goal: &Option<Goal>) -> Vec<Values> {
    let sensed = world.observe();
    let depth = world.camera_truth().map(|truth| DepthReading {
        image: Some(truth.measured()),
        time: f64::from(truth.sight.frame) * world.spec().sim.frame(),
    });
    let target = goal.map(|goal| match goal {
        Goal::Grasp { p_odom: p, radius } => [p.x, p.y, p.z, radius],
        Goal::Reach { .. } => panic!("a point"),
    });
    encoding.read(&Reading { sensed: &sensed, depth, pictures: None, target, description: None })
}

#[test]
fn a_stored_policy_runs_again_and_its_hash_is_that_of_the_network_and_the_spec() {
    let folder = tempfile::tempdir().unwrap();
    let path = files(folder.path(), "harvest", Task::Harvest, |spec| spec);
    let scenario = under(&path);
    assert_eq!(scenario.names().controller, "onnx-harvest");
    let first = trial(&scenario, SEED, 0, 0.5).unwrap();
    let text = serde_json::to_string(&scenario.stored()).unwrap();
    let stored: StoredScenario = serde_json::from_str(&text).unwrap();
    let again = Scenario::from_stored(&stored, &controllers(), "plan.json").unwrap();
    assert_eq!(again.hash(), scenario.hash());
    let second = trial(&again, SEED, 0, 0.5).unwrap();
    assert_eq!(serde_json::to_string(&first).unwrap(), serde_json::to_string(&second).unwrap());

    let mut bytes = network_file("harvest");
    let last = bytes.len() - 300;
    bytes[last] ^= 1;
    fs::write(&path, bytes).unwrap();
    assert_ne!(under(&path).hash(), scenario.hash());
    assert_eq!(under(&path).scene_hash(), scenario.scene_hash());
    let mut forged = stored.clone();
    forged.controller_files.insert("policy.onnx".into(), "AAAA".into());
    let e = Scenario::from_stored(&forged, &controllers(), "plan.json").unwrap_err().to_string();
    assert!(e.starts_with("plan.json: controller onnx-harvest: the network: "), "{e}");
}

#[test]
fn a_policy_of_another_scene_is_stale_and_one_with_a_target_needs_a_goal() {
    let folder = tempfile::tempdir().unwrap();
    let reach = files(folder.path(), "reach", Task::Reach, |spec| spec);
    let option = format!("onnx:{}", reach.display());
    let other = Scenario::of(&[("controller", &option), ("preset", "tall-spindle")]).unwrap();
    let notes = other.controller_kind().notes();
    assert!(
        notes[0].starts_with("the policy learned Reach-v1 in another scene than this one (hash "),
        "{notes:?}"
    );
    assert!(notes[0].ends_with("and the policy is stale"), "{notes:?}");
    let kind = under(&reach);
    assert!(kind.controller_kind().takes_goals() && kind.controller_kind().needs_goal());
    let harvest = files(folder.path(), "harvest", Task::Harvest, |spec| spec);
    let kind = under(&harvest);
    assert!(!kind.controller_kind().takes_goals() && !kind.controller_kind().needs_goal());
}

#[test]
fn what_does_not_fit_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = |change: fn(String) -> String| files(folder.path(), "reach", Task::Reach, change);
    let says = |path: &Path, text: &str| {
        let refused = refusal(path);
        assert!(refused.starts_with("--controller onnx:") && refused.contains(text), "{refused}");
    };
    let good = path(|spec| spec);
    says(&folder.path().join("none.onnx"), "No such file");
    fs::write(&good, b"not a model").unwrap();
    says(&good, "the network: not a model in ONNX format");
    fs::write(&good, vec![0; 10_000_001]).unwrap();
    says(&good, "has more than 10000000 bytes");
    fs::write(&good, network_file("harvest")).unwrap();
    says(
        &good,
        "input `depth`: the policy's observations have no such array; they have agent_pos, agent_vel, forces, tool_pose, target",
    );
    says(&path(|_| "{}".into()), "the spec: missing field `robot`");
    says(
        &path(|spec| spec.replace("\"encoding\":\"v1\"", "\"encoding\":\"v0\"")),
        "encoding v0 instead of v1",
    );
    says(
        &path(|spec| spec.replacen("fr3_joint3", "elbow", 1)),
        "action elbow: name elbow instead of name fr3_joint3",
    );
    says(
        &path(|spec| spec.replace("\"control_hz\":10", "\"control_hz\":7")),
        "the spec: control_hz 7: it must divide",
    );
    says(
        &path(|spec| spec.replace("\"depth\":false", "\"depth\":true")),
        "5 entries of observation instead of 8",
    );
    fs::remove_file(good.with_extension("json")).unwrap();
    says(&good, "its spec reach.json: No such file");
    let other = path(|spec| spec);
    let option = format!("onnx:{}", other.display());
    let e =
        Scenario::of(&[("controller", &option), ("robot", "rail-xarm6-suction")]).unwrap_err().to_string();
    assert!(
        e.contains(
            "the policy was made for robot ridgeback-fr3, with another interface than this scenario's: "
        ),
        "{e}"
    );
    let e = Scenario::of(&[("controller", "onnx-reach")]).unwrap_err().to_string();
    assert!(e.ends_with("a policy is given by its file, as onnx:FILE.onnx"), "{e}");
}

#[test]
fn the_page_about_networks_lists_every_operator() {
    let page = include_str!("../../../docs/computation/networks.md");
    let (_, table) = page.split_once("## Operators").unwrap();
    let table = table.split_once("## Limits").unwrap().0;
    let missing: Vec<_> = orchard_network::operators()
        .into_iter()
        .filter(|name| !table.contains(&format!("`{name}`")))
        .collect();
    assert_eq!(missing, Vec::<&str>::new());
}
