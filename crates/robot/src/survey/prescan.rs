//! Checks before the URDF reader, whose errors lack the name of the joint.

use crate::RobotError;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// The joint types of URDF.
const JOINT_TYPES: [&str; 6] = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar"];

/// Refuses joint types that URDF does not have and limits that lack required attributes; the error names the joint. Text that is not XML is
/// left to the reader.
pub(super) fn prescan(text: &str) -> Result<(), RobotError> {
    let mut reader = Reader::from_str(text);
    // Name and type of the open joint, and true once its limits have been seen.
    let mut joint: Option<(String, String, bool)> = None;
    // Number of open elements: joints of transmissions are nested deeper.
    let mut depth = 0;
    loop {
        let (element, is_empty) = match reader.read_event() {
            Ok(Event::Start(element)) => (element, false),
            Ok(Event::Empty(element)) => (element, true),
            Ok(Event::End(_)) => {
                depth -= 1;
                if depth == 1
                    && let Some(joint) = joint.take()
                {
                    finish(&joint)?;
                }
                continue;
            }
            Ok(Event::Eof) | Err(_) => return Ok(()),
            Ok(_) => continue,
        };
        let tag = element.local_name();
        if depth == 1 && tag.as_ref() == b"joint" {
            let open = begin(&element)?;
            if is_empty {
                finish(&open)?;
            } else {
                joint = Some(open);
            }
        } else if depth == 2
            && tag.as_ref() == b"limit"
            && let Some((name, kind, has_limit)) = &mut joint
        {
            check_limit(name, kind, &element)?;
            *has_limit = true;
        }
        if !is_empty {
            depth += 1;
        }
    }
}

fn begin(element: &BytesStart) -> Result<(String, String, bool), RobotError> {
    let name = attribute(element, "name").unwrap_or_default();
    let kind = attribute(element, "type").unwrap_or_default();
    if !JOINT_TYPES.contains(&kind.as_str()) {
        let kind = if kind.is_empty() { "(none)".to_owned() } else { kind };
        return Err(RobotError::JointType { joint: name, kind });
    }
    Ok((name, kind, false))
}

fn check_limit(name: &str, kind: &str, element: &BytesStart) -> Result<(), RobotError> {
    let error = |problem| Err(RobotError::Limit { joint: name.to_owned(), problem });
    let lacks = |key: &str| attribute(element, key).is_none();
    if lacks("velocity") {
        return error("its limit gives no velocity, which URDF requires");
    }
    if matches!(kind, "revolute" | "prismatic") && lacks("effort") {
        return error("its limit gives no effort, which URDF requires");
    }
    Ok(())
}

fn finish((name, kind, has_limit): &(String, String, bool)) -> Result<(), RobotError> {
    if matches!(kind.as_str(), "revolute" | "prismatic") && !has_limit {
        let problem = "has no limit element: lower, upper, effort and velocity are required";
        return Err(RobotError::Limit { joint: name.clone(), problem });
    }
    Ok(())
}

fn attribute(element: &BytesStart, key: &str) -> Option<String> {
    let found = element.try_get_attribute(key).ok().flatten()?;
    String::from_utf8(found.value.into_owned()).ok()
}
