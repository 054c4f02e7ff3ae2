//! The committed layout for Foxglove.

use std::collections::BTreeSet;

use serde_json::Value;

/// The layout as Foxglove exports and imports it.
pub const LAYOUT: &str = include_str!("../assets/foxglove/orchardbench.json");

/// Topics that a layout names: whatever starts like one in its strings and keys. A path into a message counts by its topic.
pub fn topics_of(layout: &Value) -> BTreeSet<String> {
    let mut topics = BTreeSet::new();
    collect(layout, &mut topics);
    topics
}

fn collect(value: &Value, topics: &mut BTreeSet<String>) {
    match value {
        Value::String(text) => topics.extend(topic(text)),
        Value::Array(list) => list.iter().for_each(|item| collect(item, topics)),
        Value::Object(fields) => {
            for (key, value) in fields {
                topics.extend(topic(key));
                collect(value, topics);
            }
        }
        _ => {}
    }
}

fn topic(text: &str) -> Option<String> {
    let end = text.find(['.', '[', '{']).unwrap_or(text.len());
    text.starts_with('/').then(|| text[..end].to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::Channel;

    #[test]
    fn the_layout_names_what_is_recorded() {
        let layout: Value = serde_json::from_str(LAYOUT).unwrap();
        let topics = topics_of(&layout);
        for topic in &topics {
            assert!(Channel::of(topic).is_some(), "{topic} is in the layout and in no recording");
        }
        // The layout shows every topic that can be shown.
        for channel in Channel::ALL {
            let hidden = matches!(
                channel,
                Channel::Transforms
                    | Channel::StateHash
                    | Channel::Command
                    | Channel::Detections
                    | Channel::Events
            );
            assert!(hidden || topics.contains(channel.topic()), "{} is in no panel", channel.topic());
        }
    }

    /// Every panel that the arrangement shows has its settings, and the other way round.
    #[test]
    fn the_layout_is_whole() {
        let layout: Value = serde_json::from_str(LAYOUT).unwrap();
        let mut shown = BTreeSet::new();
        leaves(&layout["layout"], &mut shown);
        let configured: BTreeSet<String> =
            layout["configById"].as_object().unwrap().keys().cloned().collect();
        assert_eq!(shown, configured);
    }

    fn leaves(node: &Value, found: &mut BTreeSet<String>) {
        match node {
            Value::String(panel) => {
                found.insert(panel.clone());
            }
            node => {
                leaves(&node["first"], found);
                leaves(&node["second"], found);
            }
        }
    }
}
