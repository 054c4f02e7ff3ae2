//! Writes a multibody model as MJCF, MuJoCo's model format, so that MuJoCo steps the same equations.
//!
//! Every part is written exactly, or the export is refused. `docs/computation/judge.md` describes how each part is written and
//! how MuJoCo must step the file. Names: link `i` is the body `linkI`, its degrees of freedom are
//! the joints `linkI.0`, `linkI.1`, ...; point body `i` is the body `pointI` with the joints `pointI.x`, `.y`, `.z`.

mod parts;

use std::io::Write;

use nalgebra::Unit;
use orchard_geometry::{Pose, Shape, Vec3, transform};
use quick_xml::Writer;
use quick_xml::events::{BytesEnd, BytesStart, Event};

use orchard_multibody::{
    BodyId, Collider, Data, Groups, JointKind, Model, Owner, PointId, Tether, forward_kinematics,
};

use parts::{Parts, too_deep};

/// Reason why a model cannot be written as MJCF.
#[derive(Debug, thiserror::Error)]
pub enum MjcfError {
    /// The model has a part that MJCF cannot represent exactly.
    #[error("{what} {index}: {problem}")]
    Unsupported {
        /// Kind of part.
        what: &'static str,
        /// Index of the part.
        index: usize,
        /// Property that MJCF cannot represent.
        problem: &'static str,
    },
    /// The XML writer failed.
    #[error("cannot write XML: {0}")]
    Xml(#[from] std::io::Error),
}

/// Writes the model with the springs and dampers of `data`, at q = 0, every point body at its hang
/// point. `h` \[s\] is the time step and `gravity` [m/s^2] the gravity that the file states.
///
/// Capsules, spheres and boxes become geometry that is drawn and has no contacts; half-spaces are left out.
///
/// # Errors
/// [`MjcfError::Unsupported`] for drag, feed-forward and external forces, free joints, couplings, convex hulls and
/// height fields, point bodies off their tether and tethers with a finite reaction cap.
pub fn write(name: &str, model: &Model, data: &Data, gravity: &Vec3, h: f64) -> Result<String, MjcfError> {
    refuse_inexact(model, data)?;
    write_as(name, model, data, gravity, h, Style::Exact)
}

/// Writes the model at the state of `data` in the form that MuJoCo steps fastest, to time it on the same work.
///
/// Links, joints, springs and dampers are those of [`write()`]. A point body hangs inside its link on three slides along the
/// link's axes with the tether's spring and damper: the same degrees of freedom and nearly the same
/// motion, without the cost of actuators. Drag, reaction caps and the bias forces of tethers on their anchors are left
/// out, since each would slow MuJoCo down. Contacts follow the colliders' groups; colliders without groups are left out.
/// The state is the file's only keyframe.
///
/// # Errors
/// [`MjcfError::Unsupported`] for feed-forward and external forces, free joints, couplings and point bodies off
/// their tether.
pub fn write_for_timing(
    name: &str,
    model: &Model,
    data: &Data,
    gravity: &Vec3,
    h: f64,
) -> Result<String, MjcfError> {
    refuse_unrelated(model, data)?;
    let mut data = data.clone();
    forward_kinematics(model, &mut data);
    write_as(name, model, &data, gravity, h, Style::Timing)
}

fn write_as(
    name: &str,
    model: &Model,
    data: &Data,
    gravity: &Vec3,
    h: f64,
    style: Style,
) -> Result<String, MjcfError> {
    let mut file = File {
        writer: Writer::new_with_indent(Vec::new(), b' ', 1),
        model,
        data,
        at_zero: Data::new(model),
        parts: Parts::of(model),
        style,
        qpos: Vec::new(),
        qvel: Vec::new(),
    };
    file.open("mujoco", &[("model", name.to_owned())])?;
    file.empty(
        "compiler",
        &[("angle", "radian".into()), ("inertiafromgeom", "false".into()), ("autolimits", "false".into())],
    )?;
    file.empty(
        "option",
        &[
            ("timestep", number(h)),
            ("gravity", numbers(gravity.as_slice())),
            ("integrator", "implicitfast".into()),
        ],
    )?;
    file.open("worldbody", &[])?;
    file.links()?;
    match style {
        Style::Exact => {
            file.empty("site", &[("name", WORLD_SITE.into())])?;
            for point in 0..model.points().len() {
                file.point_in_world(point)?;
            }
            file.close("worldbody")?;
            file.tethers()?;
        }
        Style::Timing => {
            file.close("worldbody")?;
            file.keyframe()?;
        }
    }
    file.close("mujoco")?;
    let bytes = file.writer.into_inner();
    Ok(String::from_utf8(bytes).map_err(std::io::Error::other)?)
}

/// Name of the site at the world's origin, in world axes.
const WORLD_SITE: &str = "world";
/// Axes of a point body's three slides.
const AXES: [(&str, [f64; 3]); 3] = [("x", [1.0, 0.0, 0.0]), ("y", [0.0, 1.0, 0.0]), ("z", [0.0, 0.0, 1.0])];

/// Purpose of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    /// Exactly the same equations.
    Exact,
    /// About the same work in the form that MuJoCo steps fastest.
    Timing,
}

fn refuse<T>(what: &'static str, index: usize, problem: &'static str) -> Result<T, MjcfError> {
    Err(MjcfError::Unsupported { what, index, problem })
}

/// Refuses parts that neither style can write.
fn refuse_unrelated(model: &Model, data: &Data) -> Result<(), MjcfError> {
    if let Some(index) = too_deep(model) {
        return refuse("link", index, "more than 1000 links are below one another");
    }
    for id in model.body_ids() {
        let i = id.index();
        match model.body(id).joint {
            JointKind::Free => return refuse("link", i, "free joints are not exported"),
            JointKind::Ball => return refuse("link", i, "the rods of ball joints are not exported"),
            _ => {}
        }
        if data.body_force_world[i] != Vec3::zeros() || data.body_torque_world[i] != Vec3::zeros() {
            return refuse("link", i, "external forces are not exported; set them to zero");
        }
    }
    if let Some(dof) = data.torque.iter().position(|&torque| torque != 0.0) {
        return refuse("degree of freedom", dof, "feed-forward torques are not exported; set them to zero");
    }
    let is_unsupported = |c: &Collider| matches!(c.shape, Shape::ConvexHull(_) | Shape::HeightField(_));
    if let Some(index) = model.colliders().iter().position(is_unsupported) {
        return refuse("collider", index, "convex hulls and height fields are not exported");
    }
    if !model.couplings().is_empty() {
        return refuse("coupling", 0, "couplings are not exported");
    }
    for (i, point) in model.points().iter().enumerate() {
        if point.tether.is_none() || !data.tethered[i] {
            return refuse("point body", i, "point bodies off their tether are not exported");
        }
        if data.point_force_world[i] != Vec3::zeros() {
            return refuse("point body", i, "external forces are not exported; set them to zero");
        }
    }
    Ok(())
}

/// Refuses parts that [`Style::Exact`] cannot write.
fn refuse_inexact(model: &Model, data: &Data) -> Result<(), MjcfError> {
    refuse_unrelated(model, data)?;
    for i in 0..model.bodies().len() {
        if data.linear_drag[i] != 0.0 || data.angular_drag[i] != 0.0 {
            return refuse("link", i, "MJCF has no drag in proportion to mass; set it to zero");
        }
    }
    for (i, point) in model.points().iter().enumerate() {
        if point.tether.as_ref().is_some_and(|tether| tether.reaction_cap.is_finite()) {
            return refuse("point body", i, "MJCF has no reaction cap; make it infinite");
        }
        if data.point_quadratic_drag[i] != 0.0 {
            return refuse("point body", i, "quadratic drag is not exported; set it to zero");
        }
    }
    Ok(())
}

type Attributes<'a> = [(&'a str, String)];

struct File<'a, W: Write> {
    writer: Writer<W>,
    model: &'a Model,
    data: &'a Data,
    /// The model at q = 0.
    at_zero: Data,
    parts: Parts,
    style: Style,
    /// Coordinates in the order in which their joints are written.
    qpos: Vec<f64>,
    /// Their velocities.
    qvel: Vec<f64>,
}

impl<W: Write> File<'_, W> {
    /// Writes the links, each inside its parent.
    fn links(&mut self) -> Result<(), MjcfError> {
        let mut children = vec![Vec::new(); self.model.bodies().len()];
        let mut open = Vec::new();
        for id in self.model.body_ids().rev() {
            match self.model.body(id).parent {
                Some(parent) => children[parent.index()].push(Visit::Enter(id)),
                None => open.push(Visit::Enter(id)),
            }
        }
        while let Some(visit) = open.pop() {
            match visit {
                Visit::Enter(id) => {
                    self.link(id)?;
                    open.push(Visit::Leave);
                    open.append(&mut children[id.index()]);
                }
                Visit::Leave => self.close("body")?,
            }
        }
        Ok(())
    }

    /// Opens a link's body with its joints, inertia, shapes and anchors.
    fn link(&mut self, id: BodyId) -> Result<(), MjcfError> {
        let (name, body) = (link_name(id), self.model.body(id));
        self.open("body", &placed(&name, &body.x_parent_joint))?;
        let axes = joint_axes(&body.joint);
        for (k, (dof, (kind, axis))) in self.model.dofs(id).zip(axes).enumerate() {
            self.qpos.push(self.data.q[self.model.qs(id).start + k]);
            self.qvel.push(self.data.v[dof]);
            self.empty(
                "joint",
                &[
                    ("name", format!("{name}.{k}")),
                    ("type", kind.to_owned()),
                    ("axis", numbers(axis.as_slice())),
                    ("stiffness", number(self.data.stiffness[dof])),
                    ("springref", number(self.data.rest[dof])),
                    ("damping", number(self.data.damping[dof])),
                ],
            )?;
        }
        let i = body.inertia.i_com;
        self.empty(
            "inertial",
            &[
                ("pos", numbers(body.inertia.p_com.as_slice())),
                ("mass", number(body.inertia.mass)),
                ("fullinertia", numbers(&[i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]])),
            ],
        )?;
        self.shapes(Owner::Body(id))?;
        for i in self.parts.anchors(id).to_vec() {
            if let Some(tether) = &self.model.points()[i].tether {
                match self.style {
                    Style::Exact => self.empty(
                        "site",
                        &[("name", anchor_name(i)), ("pos", numbers(tether.p_body.as_slice()))],
                    )?,
                    Style::Timing => self.point_on_link(i, tether)?,
                }
            }
        }
        Ok(())
    }

    /// Writes a point body in the world: three slides in world axes from the hang point at q = 0.
    fn point_in_world(&mut self, point: usize) -> Result<(), MjcfError> {
        let p_hang = self.at_zero.point_p_world[point];
        self.qpos.extend_from_slice((self.data.point_p_world[point] - p_hang).as_slice());
        self.qvel.extend_from_slice(self.data.point_v_world[point].as_slice());
        self.point(point, &p_hang, &[])
    }

    /// Writes a point body in its tether's link: three slides in the link's axes from the hang point at q = 0.
    fn point_on_link(&mut self, point: usize, tether: &Tether) -> Result<(), MjcfError> {
        let in_link =
            |data: &Data| transform(&data.x_world_body(tether.body).inverse(), &data.point_p_world[point]);
        let p_hang = in_link(&self.at_zero);
        let p_world = self.data.point_p_world[point];
        let from_link =
            self.data.point_v_world[point] - self.data.point_velocity_world(tether.body, &p_world);
        let r_link_world = self.data.x_world_body(tether.body).rotation.inverse();
        self.qpos.extend_from_slice((in_link(self.data) - p_hang).as_slice());
        self.qvel.extend_from_slice((r_link_world * from_link).as_slice());
        let spring = [("stiffness", number(tether.stiffness)), ("damping", number(tether.damping))];
        self.point(point, &p_hang, &spring)
    }

    /// Writes a body with three slides along its axes.
    fn point(&mut self, point: usize, position: &Vec3, spring: &Attributes) -> Result<(), MjcfError> {
        let (name, body) = (point_name(point), &self.model.points()[point]);
        self.open("body", &placed(&name, &Pose::from_parts((*position).into(), nalgebra::one())))?;
        for (axis_name, axis) in AXES {
            let slide =
                [("name", format!("{name}.{axis_name}")), ("type", "slide".into()), ("axis", numbers(&axis))];
            self.empty("joint", &[&slide, spring].concat())?;
        }
        // A point body never turns, so any finite inertia serves where ours is infinite.
        let inertia = if body.spin_inertia.is_finite() { body.spin_inertia } else { body.mass };
        self.empty(
            "inertial",
            &[
                ("pos", numbers(&[0.0; 3])),
                ("mass", number(body.mass)),
                ("diaginertia", numbers(&[inertia; 3])),
            ],
        )?;
        self.shapes(Owner::Point(PointId(point as u32)))?;
        if self.style == Style::Exact {
            self.empty("site", &[("name", name)])?;
        }
        self.close("body")
    }

    /// Writes the state as a keyframe.
    fn keyframe(&mut self) -> Result<(), MjcfError> {
        self.open("keyframe", &[])?;
        let state = [("qpos", numbers(&self.qpos)), ("qvel", numbers(&self.qvel))];
        self.empty("key", &state)?;
        self.close("keyframe")
    }

    /// Writes the tethers as actuators without input, whose bias is affine in the separation and its rate.
    ///
    /// The transmission from `site` to `refsite` has the length e . R'(p_site - p_refsite), R the axes of
    /// `refsite`, and pushes both sites with opposite forces. The point body and the world never turn, so R = 1.
    fn tethers(&mut self) -> Result<(), MjcfError> {
        self.open("actuator", &[])?;
        for (i, point) in self.model.points().iter().enumerate() {
            let Some(tether) = &point.tether else { continue };
            for (k, (axis_name, axis)) in AXES.iter().enumerate() {
                let name = format!("{}.tether.{axis_name}", point_name(i));
                self.push(i, name, &point_name(i), axis, tether_bias(tether, k))?;
                if tether.anchor_bias_world[k] != 0.0 {
                    let name = format!("{}.bias.{axis_name}", point_name(i));
                    self.push(i, name, WORLD_SITE, axis, [tether.anchor_bias_world[k], 0.0, 0.0])?;
                }
            }
        }
        self.close("actuator")
    }

    /// Writes a force along a world axis on the anchor of a tether and its reaction on a site.
    fn push(
        &mut self,
        point: usize,
        name: String,
        against: &str,
        axis: &[f64; 3],
        bias: [f64; 3],
    ) -> Result<(), MjcfError> {
        let gear = [axis[0], axis[1], axis[2], 0.0, 0.0, 0.0];
        self.empty(
            "general",
            &[
                ("name", name),
                ("site", anchor_name(point)),
                ("refsite", against.to_owned()),
                ("gear", numbers(&gear)),
                ("gainprm", "0".into()),
                ("biastype", "affine".into()),
                ("biasprm", numbers(&bias)),
            ],
        )
    }

    /// Writes the shapes: drawn only, or with contacts by their groups.
    fn shapes(&mut self, owner: Owner) -> Result<(), MjcfError> {
        let (model, data) = (self.model, self.data);
        for index in self.parts.colliders(owner).to_vec() {
            let (collider, groups) = (&model.colliders()[index], data.groups[index]);
            if self.style == Style::Timing && groups == Groups::NONE {
                continue;
            }
            let groups = if self.style == Style::Timing { groups } else { Groups::NONE };
            let x = &collider.x_owner_shape;
            let (kind, size, centre) = match collider.shape {
                Shape::Sphere { radius } => ("sphere", vec![radius], Vec3::zeros()),
                Shape::Capsule { radius, length } => {
                    ("capsule", vec![radius, 0.5 * length], Vec3::new(0.0, 0.0, 0.5 * length))
                }
                Shape::Box { half } => ("box", half.as_slice().to_vec(), Vec3::zeros()),
                // A half-space is not drawn; `refuse_unrelated` has refused the others.
                Shape::HalfSpace | Shape::ConvexHull(_) | Shape::HeightField(_) => continue,
            };
            let pose = Pose::from_parts(transform(x, &centre).into(), x.rotation);
            let [pos, quat] = pose_attributes(&pose);
            self.empty(
                "geom",
                &[
                    ("type", kind.to_owned()),
                    ("size", numbers(&size)),
                    pos,
                    quat,
                    ("contype", groups.member.to_string()),
                    ("conaffinity", groups.filter.to_string()),
                    ("friction", numbers(&[collider.friction, 0.0, 0.0])),
                ],
            )?;
        }
        Ok(())
    }

    fn open(&mut self, tag: &str, attributes: &Attributes) -> Result<(), MjcfError> {
        Ok(self.writer.write_event(Event::Start(element(tag, attributes)))?)
    }

    fn empty(&mut self, tag: &str, attributes: &Attributes) -> Result<(), MjcfError> {
        Ok(self.writer.write_event(Event::Empty(element(tag, attributes)))?)
    }

    fn close(&mut self, tag: &str) -> Result<(), MjcfError> {
        Ok(self.writer.write_event(Event::End(BytesEnd::new(tag)))?)
    }
}

#[derive(Clone)]
enum Visit {
    Enter(BodyId),
    Leave,
}

/// Force on the anchor along world axis `k`, affine in the length l = a - x and its rate: with a the anchor, x the
/// point body and o the offset, k (x - a - o) + c (u - u_a) = -k o - k l - c dl/dt.
fn tether_bias(tether: &Tether, k: usize) -> [f64; 3] {
    [-tether.stiffness * tether.offset_world[k], -tether.stiffness, -tether.damping]
}

/// Joint type and axis in MuJoCo for each degree of freedom, in our order. MuJoCo too applies them one after the other.
fn joint_axes(joint: &JointKind) -> Vec<(&'static str, Vec3)> {
    let axis = |a: &Unit<Vec3>| a.into_inner();
    match joint {
        JointKind::Weld | JointKind::Ball | JointKind::Free => vec![],
        JointKind::Hinge(a) => vec![("hinge", axis(a))],
        JointKind::Slide(a) => vec![("slide", axis(a))],
        JointKind::Universal => vec![("hinge", Vec3::x()), ("hinge", Vec3::y())],
        JointKind::Planar => vec![("slide", Vec3::x()), ("slide", Vec3::y()), ("hinge", Vec3::z())],
    }
}

fn element<'a>(tag: &'a str, attributes: &'a Attributes) -> BytesStart<'a> {
    let mut start = BytesStart::new(tag);
    for (key, value) in attributes {
        start.push_attribute((*key, value.as_str()));
    }
    start
}

fn placed(name: &str, pose: &Pose) -> [(&'static str, String); 3] {
    let [pos, quat] = pose_attributes(pose);
    [("name", name.to_owned()), pos, quat]
}

/// Position and quaternion, which MuJoCo writes (w, x, y, z).
fn pose_attributes(pose: &Pose) -> [(&'static str, String); 2] {
    let r = &pose.rotation;
    [("pos", numbers(pose.translation.vector.as_slice())), ("quat", numbers(&[r.w, r.i, r.j, r.k]))]
}

fn link_name(id: BodyId) -> String {
    format!("link{}", id.0)
}

fn point_name(point: usize) -> String {
    format!("point{point}")
}

fn anchor_name(point: usize) -> String {
    format!("point{point}.anchor")
}

/// Shortest text that reads back as the same number.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn numbers(values: &[f64]) -> String {
    values.iter().map(|&value| number(value)).collect::<Vec<_>>().join(" ")
}
