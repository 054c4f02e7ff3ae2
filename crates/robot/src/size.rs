//! Bounds on the size of a robot description, checked before it is read.
//!
//! The reader of URDF takes stack for each level of nesting and memory for each element.

use crate::RobotError;
use quick_xml::Reader;
use quick_xml::events::Event;

/// Most links, joints and shapes together, our own choice: a humanoid with hands has 500, and a survey of so many takes a second.
const ELEMENTS_MAX: usize = 20_000;

/// Deepest nesting of elements, our own choice: URDF itself has 6 levels, the extensions of simulators have a few more.
const DEPTH_MAX: usize = 64;

/// Longest text \[bytes\], our own choice: 10,000 links with their joints, of 400 bytes each.
const TEXT_MAX: usize = 4 << 20;

/// Elements that are counted.
const COUNTED: [&[u8]; 4] = [b"link", b"joint", b"collision", b"visual"];

/// Checks the size of a description.
pub(crate) fn check(text: &str) -> Result<(), RobotError> {
    let too_many = |what, most| Err(RobotError::TooMany { what, most });
    if text.len() > TEXT_MAX {
        return too_many("bytes of text", TEXT_MAX);
    }
    let mut reader = Reader::from_str(text);
    // Names and pairs of tags are checked by the reader of URDF.
    reader.config_mut().check_end_names = false;
    reader.config_mut().allow_unmatched_ends = true;
    let (mut depth, mut elements) = (0_usize, 0_usize);
    loop {
        let (element, inside) = match reader.read_event() {
            Ok(Event::Start(element)) => (element, 1),
            Ok(Event::Empty(element)) => (element, 0),
            Ok(Event::End(_)) => {
                depth = depth.saturating_sub(1);
                continue;
            }
            // Its entities could hold elements.
            Ok(Event::DocType(_)) => {
                return Err(RobotError::Parse("a document type, which URDF does not have".to_owned()));
            }
            Ok(Event::Eof) => return Ok(()),
            Err(e) => return Err(RobotError::Parse(e.to_string())),
            Ok(_) => continue,
        };
        if depth + 1 > DEPTH_MAX {
            return too_many("elements inside one another", DEPTH_MAX);
        }
        depth += inside;
        elements += usize::from(COUNTED.contains(&element.local_name().as_ref()));
        if elements > ELEMENTS_MAX {
            return too_many("links, joints and shapes", ELEMENTS_MAX);
        }
    }
}
