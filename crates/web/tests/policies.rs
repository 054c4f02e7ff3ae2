//! Policies that a visitor opens, against the command line's.

use orchard_learned::NETWORK_MAX;
use orchard_scenario::Scenario;
use orchard_web::{Ask, Files, PolicyFiles, grow};

const FILE: &str = "../../policies/harvest-clone.onnx";

fn files(stem: &str) -> PolicyFiles {
    let path = |ending: &str| format!("../../policies/{stem}.{ending}");
    PolicyFiles {
        name: format!("{stem}.onnx"),
        network: std::fs::read(path("onnx")).unwrap(),
        spec: std::fs::read_to_string(path("json")).unwrap(),
    }
}

fn opened(policy: &PolicyFiles) -> Files {
    Files { policy: Some(policy.clone()), ..Files::default() }
}

fn asked(policy: &PolicyFiles) -> Ask {
    Ask { driver: format!("onnx:{}", policy.name), ..Ask::default() }
}

/// The problem of a policy, without the option or the driver that named it.
fn refused(policy: &PolicyFiles) -> String {
    let e = grow(&asked(policy), &opened(policy)).map(|_| ()).unwrap_err().to_string();
    e.strip_prefix(&format!("driver onnx:{}: ", policy.name)).unwrap_or(&e).to_owned()
}

/// A policy moves the robot as it does under the scenario's option, bit for bit.
#[test]
fn a_policy_drives_as_on_the_command_line() {
    let scenario = Scenario::of(&[("controller", &format!("onnx:{FILE}"))]).unwrap();
    let (mut world, mut controller) = (scenario.world(20250704, 0, 0).unwrap(), scenario.controller());
    // A long name is a name like any other.
    let name = format!("{}.onnx", "harvest-".repeat(8));
    let policy = PolicyFiles { name, ..files("harvest-clone") };
    let mut tab = grow(&asked(&policy), &opened(&policy)).unwrap();
    for _ in 0..60 {
        let command = controller.act(&world.observe());
        world.step(&command);
        tab.step();
        assert_eq!(tab.session().world().state_digest(), world.state_digest());
    }
}

/// What the command line says of files that cannot be used, the page says too.
#[test]
fn bad_files_get_the_sentences_of_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let good = files("harvest-clone");
    let other = files("reach-ppo");
    let short = good.network[..1000].to_vec();
    let bad = [
        PolicyFiles { network: b"no network".to_vec(), ..good.clone() },
        PolicyFiles { network: short, ..good.clone() },
        PolicyFiles { network: other.network, ..good.clone() },
        PolicyFiles { spec: "{".into(), ..good.clone() },
        PolicyFiles { spec: good.spec.replace("\"encoding\"", "\"encodings\""), ..good.clone() },
    ];
    for (k, policy) in bad.iter().enumerate() {
        let path = folder.path().join(format!("{k}.onnx"));
        std::fs::write(&path, &policy.network).unwrap();
        std::fs::write(path.with_extension("json"), &policy.spec).unwrap();
        let option = format!("onnx:{}", path.display());
        let native = Scenario::of(&[("controller", &option)]).unwrap_err().to_string();
        let problem = refused(policy);
        assert!(native.ends_with(&problem) && problem.len() > 10, "{native}\n{problem}");
    }
}

#[test]
fn policies_that_are_not_here_or_need_a_goal_are_told() {
    let e = grow(&asked(&files("harvest-clone")), &Files::default()).map(|_| ()).unwrap_err().to_string();
    assert!(e.starts_with("driver onnx:harvest-clone.onnx: its two files are not here: open harvest"), "{e}");
    let reach = files("reach-ppo");
    assert!(refused(&reach).starts_with("it needs a goal, which only"), "{}", refused(&reach));
    let large = PolicyFiles { network: vec![0; NETWORK_MAX as usize + 1], ..files("harvest-clone") };
    assert_eq!(refused(&large), "has more than 10000000 bytes, the largest size that is read");
}
