//! Writes wood as URDF: a tree of links, each with two bending joints.
//!
//! Link `linkI` is segment I. Its joint is a chain of two: `linkI.x` turns the empty link `linkI.bend`, `linkI.y` the
//! link itself. URDF has no springs: the stiffness is lost, the damping is kept.

use orchard_geometry::Pose;
use quick_xml::Writer;
use quick_xml::events::{BytesEnd, BytesStart, Event};

use crate::wood::{Link, Wood, numbers};

/// Writes the wood. Its links have cylinders as visual and collision shapes, and the inertia of the simulated capsules.
///
/// # Errors
/// The XML writer fails.
pub fn write(name: &str, wood: &Wood) -> std::io::Result<String> {
    let mut file = File(Writer::new_with_indent(Vec::new(), b' ', 1));
    file.element("robot", &[("name", name)], |file| {
        file.element("link", &[("name", "ground")], |_| Ok(()))?;
        wood.links().try_for_each(|link| file.link(&link))
    })?;
    String::from_utf8(file.0.into_inner()).map_err(std::io::Error::other)
}

struct File(Writer<Vec<u8>>);

type Attributes<'a> = [(&'a str, &'a str)];

impl File {
    fn element(
        &mut self,
        tag: &str,
        attributes: &Attributes,
        inside: impl FnOnce(&mut Self) -> std::io::Result<()>,
    ) -> std::io::Result<()> {
        let start = BytesStart::new(tag).with_attributes(attributes.iter().copied());
        self.0.write_event(Event::Start(start))?;
        inside(self)?;
        self.0.write_event(Event::End(BytesEnd::new(tag)))
    }

    fn empty(&mut self, tag: &str, attributes: &Attributes) -> std::io::Result<()> {
        self.element(tag, attributes, |_| Ok(()))
    }

    fn link(&mut self, link: &Link) -> std::io::Result<()> {
        let name = format!("link{}", link.index);
        let bend = format!("{name}.bend");
        let parent = link.segment.parent.map_or("ground".to_owned(), |p| format!("link{p}"));
        self.empty("link", &[("name", &bend)])?;
        self.joint(&format!("{name}.x"), [&parent, &bend], "1 0 0", link.x_parent_joint(), link.damping)?;
        self.joint(&format!("{name}.y"), [&bend, &name], "0 1 0", &Pose::identity(), link.damping)?;

        let middle = numbers(&[0.0, 0.0, 0.5 * link.segment.length], " ");
        let (radius, length) = (numbers(&[link.segment.radius], ""), numbers(&[link.segment.length], ""));
        self.element("link", &[("name", &name)], |file| {
            let [ixx, iyy, izz] = link.moments().map(|moment| numbers(&[moment], ""));
            file.element("inertial", &[], |file| {
                file.empty("origin", &[("xyz", &middle)])?;
                file.empty("mass", &[("value", &numbers(&[link.body.inertia.mass], ""))])?;
                let moments: &Attributes =
                    &[("ixx", &ixx), ("iyy", &iyy), ("izz", &izz), ("ixy", "0"), ("ixz", "0"), ("iyz", "0")];
                file.empty("inertia", moments)
            })?;
            ["visual", "collision"].into_iter().try_for_each(|tag| {
                file.element(tag, &[], |file| {
                    file.empty("origin", &[("xyz", &middle)])?;
                    file.element("geometry", &[], |file| {
                        file.empty("cylinder", &[("radius", &radius), ("length", &length)])
                    })
                })
            })
        })
    }

    fn joint(
        &mut self,
        name: &str,
        [parent, child]: [&str; 2],
        axis: &str,
        pose: &Pose,
        damping: f64,
    ) -> std::io::Result<()> {
        let (roll, pitch, yaw) = pose.rotation.euler_angles();
        self.element("joint", &[("name", name), ("type", "continuous")], |file| {
            file.empty("parent", &[("link", parent)])?;
            file.empty("child", &[("link", child)])?;
            let xyz = numbers(pose.translation.vector.as_slice(), " ");
            file.empty("origin", &[("xyz", &xyz), ("rpy", &numbers(&[roll, pitch, yaw], " "))])?;
            file.empty("axis", &[("xyz", axis)])?;
            file.empty("dynamics", &[("damping", &numbers(&[damping], "")), ("friction", "0")])
        })
    }
}
