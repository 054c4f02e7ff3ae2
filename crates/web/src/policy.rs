//! Policies that a visitor opens: a network in ONNX format and its spec, as `--controller onnx:FILE.onnx` takes them.

use std::sync::Arc;

use orchard_learned::{LearnedKind, NETWORK_MAX, Setting};
use orchard_picker::ControllerKind;

use crate::parts::{AskError, Parts, shown};

/// Beginning of a driver's name that names a network's file.
pub(crate) const POLICY: &str = "onnx:";

/// The files of a policy.
#[derive(Debug, Clone, Default)]
pub struct PolicyFiles {
    /// File name of the network.
    pub name: String,
    /// The network.
    pub network: Vec<u8>,
    /// The spec, JSON text.
    pub spec: String,
}

/// The kind of controller that a policy's files make for the parts of a session. `driver` names it, as `onnx:FILE.onnx`.
///
/// # Errors
/// The files of another name or none, a network that is too large or cannot be read, a spec that does not fit it or the parts, a policy that needs a goal.
pub(crate) fn kind(
    driver: &str,
    files: Option<&PolicyFiles>,
    parts: &Parts,
) -> Result<Arc<dyn ControllerKind>, AskError> {
    let refuse = |problem: String| AskError(format!("driver {}: {problem}", shown(driver)));
    let name = driver.strip_prefix(POLICY).unwrap_or(driver);
    let Some(files) = files.filter(|files| files.name == name) else {
        let name = shown(name);
        return Err(refuse(format!(
            "its two files are not here: open {name} and its spec, the file of the same name that ends in .json"
        )));
    };
    if files.network.len() as u64 > NETWORK_MAX {
        return Err(refuse(format!("has more than {NETWORK_MAX} bytes, the largest size that is read")));
    }
    let view = parts.spec.camera.view();
    let setting = Setting {
        robot: &parts.robot,
        depth_size: [view.width.get() as usize, view.height.get() as usize],
        frame_rate: parts.spec.sim.frame_rate.si(),
        // The hash of the scene is the scenario's; without it the page cannot tell a stale policy, and its notes are not shown.
        scene: "",
    };
    let kind = LearnedKind::new(name, &files.network, &files.spec, &setting);
    let kind = kind.map_err(|e| refuse(e.to_string()))?;
    if kind.needs_goal() {
        return Err(refuse(
            "it needs a goal, which only the tasks reach-and-grasp and gentle give".to_owned(),
        ));
    }
    Ok(Arc::new(kind))
}
