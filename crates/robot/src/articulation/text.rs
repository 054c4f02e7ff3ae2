//! URDF text, freed of what this crate does not use and completed by what public files leave out, for the URDF reader.
//!
//! The reader refuses a whole file for a limit without a velocity or a material without a colour, and its errors lack the name of the
//! place. Here only links and joints pass, with defaults where they lack attributes.

use crate::RobotError;
use crate::warning::Warning;
use quick_xml::events::{BytesEnd, BytesStart, Event};
use quick_xml::{Reader, Writer};
use std::collections::BTreeMap;

/// The joint types of URDF.
const JOINT_TYPES: [&str; 6] = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar"];

/// Entries of an inertia matrix.
const MOMENTS: [&str; 6] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];

/// Geometry that stands for an empty element; a shape of no size is left out later.
const NO_GEOMETRY: [(&str, &str); 1] = [("size", "0 0 0")];

/// Text for the URDF reader, and what it can no longer tell.
#[derive(Debug, Default)]
pub(crate) struct Text {
    /// URDF of links and joints.
    pub urdf: String,
    /// Limits that a joint states: lower, upper, velocity, effort.
    pub stated: BTreeMap<String, [bool; 4]>,
    /// Visual meshes: link and file.
    pub visuals: Vec<(String, String)>,
    /// Faults found on the way.
    pub warnings: Vec<Warning>,
}

/// Names of the stated limits, in the order of [`Text::stated`].
const LIMITS: [&str; 4] = ["lower", "upper", "velocity", "effort"];

/// Treatment of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pass {
    /// It passes.
    Copied,
    /// It is read and does not pass.
    Read,
    /// It does not pass, and neither does what it holds.
    Dropped,
}

/// An open element.
struct Open {
    tag: String,
    pass: Pass,
    /// Tags of the elements in it that passed.
    inside: Vec<String>,
}

/// Frees and completes a text.
///
/// # Errors
/// The text is not XML, not URDF but xacro, MJCF or SDF, or has a joint type that URDF does not have.
pub(crate) fn tidy(text: &str) -> Result<Text, RobotError> {
    let mut pass = Passage {
        out: Text::default(),
        writer: Writer::new(Vec::new()),
        open: Vec::new(),
        place: String::new(),
    };
    let mut reader = Reader::from_str(text);
    loop {
        match reader.read_event().map_err(|e| RobotError::Parse(e.to_string()))? {
            Event::Start(element) => pass.begin(&element)?,
            Event::Empty(element) => {
                pass.begin(&element)?;
                pass.end()?;
            }
            Event::End(_) => pass.end()?,
            Event::Eof => break,
            _ => {}
        }
    }
    if !pass.open.is_empty() {
        return Err(RobotError::Parse(format!("the element `{}` has no end", pass.open[0].tag)));
    }
    pass.out.urdf =
        String::from_utf8(pass.writer.into_inner()).map_err(|e| RobotError::Parse(e.to_string()))?;
    Ok(pass.out)
}

/// A text on its way through.
struct Passage {
    out: Text,
    writer: Writer<Vec<u8>>,
    open: Vec<Open>,
    /// Name of the open link or joint.
    place: String,
}

impl Passage {
    fn begin(&mut self, element: &BytesStart) -> Result<(), RobotError> {
        let tag = String::from_utf8_lossy(element.name().as_ref()).into_owned();
        let mut open = Open { pass: self.treatment(&tag, element)?, tag, inside: Vec::new() };
        if open.pass == Pass::Dropped {
            self.open.push(open);
            return Ok(());
        }
        refuse_leftovers(&self.place, element)?;
        if self.open.len() == 1 {
            self.place = attribute(element, "name").unwrap_or_default();
            if open.tag == "joint" {
                check_type(&self.place, attribute(element, "type"))?;
            }
        }
        if open.pass == Pass::Copied {
            let element = self.completed(&open.tag, element);
            self.write(Event::Start(element))?;
            if let Some(parent) = self.open.last_mut() {
                parent.inside.push(open.tag.clone());
            }
        } else if open.tag == "mesh" {
            let file = attribute(element, "filename").unwrap_or_default();
            self.out.visuals.push((self.place.clone(), file));
            open.pass = Pass::Dropped;
        }
        self.open.push(open);
        Ok(())
    }

    /// Treatment of an element inside the open ones.
    fn treatment(&self, tag: &str, element: &BytesStart) -> Result<Pass, RobotError> {
        let Some(parent) = self.open.last() else { return check_root(tag).map(|()| Pass::Copied) };
        if parent.pass == Pass::Dropped {
            return Ok(Pass::Dropped);
        }
        if tag.starts_with("xacro:") {
            return Err(RobotError::Xacro { found: format!("the element `{tag}`") });
        }
        if parent.pass == Pass::Read {
            return Ok(if matches!(tag, "geometry" | "mesh") { Pass::Read } else { Pass::Dropped });
        }
        let known: &[&str] = match (self.open.len(), parent.tag.as_str()) {
            (1, _) => &["link", "joint"],
            (2, "link") if tag == "visual" => return Ok(Pass::Read),
            (2, "link") => &["inertial", "collision"],
            (2, "joint") => &["origin", "parent", "child", "axis", "limit", "mimic", "dynamics"],
            (3, "inertial") => &["origin", "mass", "inertia"],
            (3, "collision") => &["origin", "geometry"],
            (4, "geometry") => &["box", "cylinder", "capsule", "sphere", "mesh"],
            _ => &[],
        };
        // A gazebo element of an expanded file may hold the link `<link name='x'/>` of another language; it stands deeper.
        let passes = known.contains(&tag) && element.name().prefix().is_none();
        Ok(if passes { Pass::Copied } else { Pass::Dropped })
    }

    /// An element with the attributes that the reader needs.
    fn completed(&mut self, tag: &str, element: &BytesStart) -> BytesStart<'static> {
        let mut made = element.to_owned();
        match tag {
            "limit" => {
                let stated = LIMITS.map(|key| attribute(element, key).is_some());
                self.out.stated.insert(self.place.clone(), stated);
                if !stated[2] {
                    made.push_attribute(("velocity", "0"));
                }
            }
            "inertia" => {
                let lacks = MOMENTS.into_iter().filter(|key| attribute(element, key).is_none());
                let lacks: Vec<&str> = lacks.collect();
                if !lacks.is_empty() {
                    self.warn_incomplete();
                }
                lacks.into_iter().for_each(|key| made.push_attribute((key, "0")));
            }
            "mass" if attribute(element, "value").is_none() => {
                self.warn_incomplete();
                made.push_attribute(("value", "0"));
            }
            _ => {}
        }
        made
    }

    fn warn_incomplete(&mut self) {
        self.out.warnings.push(Warning::IncompleteInertial { link: self.place.clone() });
    }

    fn end(&mut self) -> Result<(), RobotError> {
        let Some(open) = self.open.pop() else { return Ok(()) };
        if open.pass != Pass::Copied {
            return Ok(());
        }
        let has = |tag: &str| open.inside.iter().any(|inside| inside == tag);
        match open.tag.as_str() {
            "inertial" => {
                if !has("mass") || !has("inertia") {
                    self.warn_incomplete();
                }
                if !has("mass") {
                    self.write_empty("mass", &[("value", "0")])?;
                }
                if !has("inertia") {
                    self.write_empty("inertia", &MOMENTS.map(|key| (key, "0")))?;
                }
            }
            "collision" if !has("geometry") => {
                self.write(Event::Start(BytesStart::new("geometry")))?;
                self.write_empty("box", &NO_GEOMETRY)?;
                self.write(Event::End(BytesEnd::new("geometry")))?;
            }
            "geometry" if open.inside.is_empty() => self.write_empty("box", &NO_GEOMETRY)?,
            _ => {}
        }
        self.write(Event::End(BytesEnd::new(open.tag)))
    }

    fn write_empty(&mut self, tag: &str, attributes: &[(&str, &str)]) -> Result<(), RobotError> {
        let element = BytesStart::new(tag).with_attributes(attributes.iter().copied());
        self.write(Event::Empty(element))
    }

    fn write(&mut self, event: Event) -> Result<(), RobotError> {
        self.writer.write_event(event).map_err(|e| RobotError::Parse(e.to_string()))
    }
}

/// Refuses other languages of robots by the name of the first element.
fn check_root(tag: &str) -> Result<(), RobotError> {
    match tag {
        "robot" => Ok(()),
        "mujoco" => Err(RobotError::Language("a MuJoCo model (MJCF)")),
        "sdf" => Err(RobotError::Language("an SDF model")),
        _ if tag.starts_with("xacro:") => Err(RobotError::Xacro { found: format!("the element `{tag}`") }),
        _ => Err(RobotError::Parse(format!("the first element is `{tag}`, not `robot`"))),
    }
}

fn check_type(joint: &str, kind: Option<String>) -> Result<(), RobotError> {
    let kind = kind.unwrap_or_else(|| "(none)".to_owned());
    match JOINT_TYPES.contains(&kind.as_str()) {
        true => Ok(()),
        false => Err(RobotError::JointType { joint: joint.to_owned(), kind }),
    }
}

/// Refuses attributes that xacro would have replaced.
fn refuse_leftovers(place: &str, element: &BytesStart) -> Result<(), RobotError> {
    for attribute in element.attributes() {
        let attribute = attribute.map_err(|e| RobotError::Parse(e.to_string()))?;
        let value = String::from_utf8_lossy(&attribute.value);
        let Some(at) = value.find("${").into_iter().chain(value.find("$(")).min() else { continue };
        let what: String = value[at..].chars().take(60).collect();
        let place = if place.is_empty() { String::new() } else { format!(" in `{place}`") };
        return Err(RobotError::Xacro { found: format!("`{what}`{place}") });
    }
    Ok(())
}

fn attribute(element: &BytesStart, key: &str) -> Option<String> {
    let found = element.try_get_attribute(key).ok().flatten()?;
    let raw = String::from_utf8(found.value.into_owned()).ok()?;
    quick_xml::escape::unescape(&raw).map(|text| text.into_owned()).ok()
}
