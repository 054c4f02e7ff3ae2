//! Figures of a scenario, each with its origin.

use orchard_quantity::parse;
use orchard_spec::{Preset, Spec};
use serde::Serialize;
use serde_json::Value;

use crate::Scenario;

/// One constant of a scenario.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// Path of its field, such as `world.wood.density`.
    pub path: String,
    /// Value, or interval, in its own unit.
    pub value: Value,
    /// Unit.
    pub unit: String,
    /// Key of its source in `docs/references.bib`.
    pub source: String,
    /// The preset, file or option that set it.
    pub from: String,
}

/// The configs of a world, from the base preset to the last override, and the options that replaced whole parts.
#[derive(Debug, Clone, Default)]
pub(crate) struct Layers {
    worlds: Vec<(String, Value)>,
    parts: Vec<(&'static str, String)>,
}

impl Layers {
    /// A config and the presets that it is based on.
    pub fn of_config(name: &str, text: &str, spec: &Spec) -> Self {
        let mut layers = Self::default();
        let mut base = base_of(name, text);
        while let Some(preset) = base {
            layers.worlds.insert(0, (format!("preset {preset}"), json(&Spec::preset(preset))));
            base = base_of(preset.name(), preset.toml());
        }
        let own =
            name.parse::<Preset>().map_or_else(|_| name.to_owned(), |preset| format!("preset {preset}"));
        layers.worlds.push((own, json(spec)));
        layers
    }

    /// The layers of a world with unknown presets and options.
    pub fn of_one(by: &str, spec: &Spec) -> Self {
        Self { worlds: vec![(by.to_owned(), json(spec))], parts: Vec::new() }
    }

    /// Records the option that gave a part.
    pub fn part(&mut self, path: &'static str, by: &str) {
        self.parts.push((path, by.to_owned()));
    }

    /// Returns the last layer that changed a constant of the world, or the option that gave its part.
    fn origin(&self, path: &str) -> String {
        let within = |part: &str| path.strip_prefix(part).is_some_and(|rest| rest.starts_with(['.', '[']));
        if let Some((_, by)) = self.parts.iter().find(|(part, _)| within(part)) {
            return by.clone();
        }
        let Some(field) = path.strip_prefix("world.") else { return String::new() };
        let (mut from, mut before) = (String::new(), None);
        for (name, world) in &self.worlds {
            let here = at(world, field);
            if here != before || from.is_empty() {
                from.clone_from(name);
            }
            before = here;
        }
        from
    }
}

impl Scenario {
    /// All constants of world, robot, detector and controller, in the order of their configs.
    pub fn figures(&self) -> Vec<Figure> {
        let mut figures = Vec::new();
        let mut add = |path: &str, value: &Value| walk(path, value, &self.layers, &mut figures);
        add("world", &json(&*self.spec));
        add("robot", &json(self.robot.config()));
        add("detector", &json(&self.detector));
        for (name, text) in self.controller.configs() {
            if let Some(table) =
                Some(&*name).filter(|name| name.ends_with(".toml")).and_then(|_| parse(&name, &text).ok())
            {
                let stem = name.trim_end_matches(".toml").replace('/', ".");
                add(&format!("controller.{stem}"), &json(&table));
            }
        }
        add("rules", &json(&self.rules));
        figures
    }
}

fn walk(path: &str, value: &Value, layers: &Layers, figures: &mut Vec<Figure>) {
    match value {
        Value::Object(fields) => match (fields.get("unit"), fields.get("source")) {
            (Some(Value::String(unit)), Some(Value::String(source))) => {
                let of = |name: &str| fields.get(name).cloned();
                let ends = || match (of("mean"), of("sd"), of("low"), of("high")) {
                    (Some(mean), Some(sd), Some(low), Some(high)) => {
                        serde_json::json!({ "mean": mean, "sd": sd, "low": low, "high": high })
                    }
                    (_, _, Some(low), Some(high)) => serde_json::json!([low, high]),
                    _ => Value::Null,
                };
                figures.push(Figure {
                    path: path.to_owned(),
                    value: of("value").unwrap_or_else(ends),
                    unit: unit.clone(),
                    source: source.clone(),
                    from: layers.origin(path),
                });
            }
            _ => {
                for (name, value) in fields {
                    walk(&format!("{path}.{name}"), value, layers, figures);
                }
            }
        },
        Value::Array(values) => {
            for (i, value) in values.iter().enumerate() {
                walk(&format!("{path}[{i}]"), value, layers, figures);
            }
        }
        _ => {}
    }
}

/// A value by its path of names and indices.
fn at<'a>(value: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('.').try_fold(value, |value, step| {
        let mut parts = step.split(['[', ']']).filter(|part| !part.is_empty());
        let named = value.get(parts.next()?)?;
        parts.try_fold(named, |value, place| value.get(place.parse::<usize>().ok()?))
    })
}

fn base_of(name: &str, text: &str) -> Option<Preset> {
    parse(name, text).ok()?.get("base")?.as_str()?.parse().ok()
}

fn json(value: &impl Serialize) -> Value {
    serde_json::to_value(value).unwrap_or_else(|e| unreachable!("config from TOML is also JSON: {e}"))
}
