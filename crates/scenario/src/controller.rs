//! Controllers by name, and policies from files.

use std::path::Path;
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use orchard_learned::{LearnedKind, NETWORK_MAX, Setting};
use orchard_picker::ControllerKind;

use crate::names::{NAMED, POLICY, controller_name};
use crate::{OptionValue, Scenario, ScenarioError, StoredScenario};

impl Scenario {
    /// Returns the scenario under the controller of an option: one of a program's, or a policy, `onnx:FILE.onnx` with its spec in `FILE.json`.
    pub(crate) fn under_option(
        &self,
        controller: &OptionValue,
        controllers: &[Arc<dyn ControllerKind>],
    ) -> Result<Self, ScenarioError> {
        let Some(path) = controller.value.strip_prefix(POLICY) else {
            return self.under(controller, controllers);
        };
        let (path, spec) = (Path::new(path), Path::new(path).with_extension("json"));
        let onnx = orchard_input::bytes(path, NETWORK_MAX).map_err(|e| controller.refuse(e))?;
        let text = orchard_input::text(&spec, orchard_input::CONFIG)
            .map_err(|e| controller.refuse(format!("its spec {}: {e}", spec.display())))?;
        self.under_policy(controller, &controller_name(&controller.value), &onnx, &text)
    }

    /// Returns the scenario under the controller of a result: one of the program's, or the policy whose files the result stores. `by` names the
    /// result in errors.
    ///
    /// # Errors
    /// No controller has this name, or the stored files cannot be used.
    pub fn under_stored(
        &self,
        stored: &StoredScenario,
        controllers: &[Arc<dyn ControllerKind>],
        by: &str,
    ) -> Result<Self, ScenarioError> {
        let given = OptionValue::new(&stored.names.controller, format!("{by}: controller"));
        if stored.controller_files.is_empty() {
            return self.under(&given, controllers);
        }
        let file = |name: &str| {
            let text = stored.controller_files.get(name);
            let text =
                text.ok_or_else(|| given.refuse(format!("the result does not store its file {name}")))?;
            STANDARD.decode(text).map_err(|e| given.refuse(format!("its file {name} is not base64: {e}")))
        };
        let [onnx, spec] = LearnedKind::FILES;
        let (onnx, spec) = (file(onnx)?, String::from_utf8(file(spec)?));
        let spec = spec.map_err(|e| given.refuse(format!("its spec is not text: {e}")))?;
        if onnx.len() as u64 > NETWORK_MAX {
            return Err(given.refuse(format!("its network has more than {NETWORK_MAX} bytes")));
        }
        self.under_policy(&given, &given.value, &onnx, &spec)
    }

    /// Returns the scenario under one of a program's controllers.
    ///
    /// # Errors
    /// No controller has this name.
    pub fn under(
        &self,
        given: &OptionValue,
        controllers: &[Arc<dyn ControllerKind>],
    ) -> Result<Self, ScenarioError> {
        let found = controllers.iter().find(|kind| kind.name() == given.value);
        let kind = found.cloned().ok_or_else(|| {
            let names: Vec<&str> = controllers.iter().map(|kind| kind.name()).collect();
            let hint = match given.value.starts_with(NAMED) {
                true => "; a policy is given by its file, as onnx:FILE.onnx",
                false => "",
            };
            let value = &given.value;
            let problem = format!("no controller '{value}'; the controllers are: {}{hint}", names.join(", "));
            ScenarioError::new(&given.by, problem)
        })?;
        Ok(self.under_kind(kind))
    }

    fn under_policy(
        &self,
        given: &OptionValue,
        name: &str,
        onnx: &[u8],
        spec: &str,
    ) -> Result<Self, ScenarioError> {
        let view = self.spec().camera.view();
        let setting = Setting {
            robot: self.robot(),
            depth_size: [view.width.get() as usize, view.height.get() as usize],
            frame_rate: self.spec().sim.frame_rate.si(),
            scene: &self.scene_hash(),
        };
        let kind = LearnedKind::new(name, onnx, spec, &setting).map_err(|e| given.refuse(e))?;
        Ok(self.under_kind(Arc::new(kind)))
    }
}
