//! Writes wood as USD text (`.usda`) with the physics schemas: rigid bodies, and joints with bending springs.
//!
//! The text is written directly, since no maintained library writes USD from Rust. Poses are in the world, in double precision;
//! masses, joint frames and springs are floats, as the schema demands. USD measures angles in degrees: springs are in N m per degree.

use std::f64::consts::PI;
use std::fmt::{self, Write};

use orchard_geometry::{Pose, Rotation};

use crate::wood::{Link, Wood, numbers};

/// Writes the wood. Prim `/Tree/linkI` is segment I, `/Tree/jointI` the joint at its base.
pub fn write(wood: &Wood) -> String {
    let mut text = String::from(HEAD);
    for link in wood.links() {
        body(&mut text, &link).unwrap_or_else(|e| unreachable!("a string takes all text: {e}"));
        joint(&mut text, &link).unwrap_or_else(|e| unreachable!("a string takes all text: {e}"));
    }
    text + "}\n"
}

const HEAD: &str = r#"#usda 1.0
(
    defaultPrim = "Tree"
    kilogramsPerUnit = 1
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "Tree" (
    prepend apiSchemas = ["PhysicsArticulationRootAPI"]
)
{
"#;

fn body(text: &mut String, link: &Link) -> fmt::Result {
    let (i, segment) = (link.index, link.segment);
    let half = numbers(&[0.5 * segment.length], "");
    let p = numbers(segment.p_base_world.as_slice(), ", ");
    write!(
        text,
        r#"    def Xform "link{i}" (
        prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]
    )
    {{
        point3f physics:centerOfMass = (0, 0, {half})
        float3 physics:diagonalInertia = ({})
        float physics:mass = {:?}
        custom int order = {}
        double3 xformOp:translate = ({p})
        quatd xformOp:orient = ({})
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]

        def Capsule "wood" (
            prepend apiSchemas = ["PhysicsCollisionAPI"]
        )
        {{
            uniform token axis = "Z"
            double height = {:?}
            double radius = {:?}
            float3[] extent = [({}), ({})]
            double3 xformOp:translate = (0, 0, {half})
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }}
    }}
"#,
        numbers(&link.moments(), ", "),
        link.body.inertia.mass,
        segment.order,
        quaternion(&segment.r_world_segment),
        segment.length,
        segment.radius,
        corner(link, -1.0),
        corner(link, 1.0),
    )
}

/// Writes a joint. Its first frame is the parent's or the world's, its second the segment's; they coincide in the unloaded tree.
fn joint(text: &mut String, link: &Link) -> fmt::Result {
    let i = link.index;
    let Pose { rotation, translation } = link.x_parent_joint();
    let parent = link
        .segment
        .parent
        .map_or(String::new(), |p| format!("        rel physics:body0 = </Tree/link{p}>\n"));
    // A low limit above the high one locks an axis.
    let locked: String = ["transX", "transY", "transZ", "rotZ"]
        .iter()
        .map(|axis| {
            format!(
                "        float limit:{axis}:physics:low = 1\n        float limit:{axis}:physics:high = -1\n"
            )
        })
        .collect();
    let (stiffness, damping) = (link.stiffness * PI / 180.0, link.damping * PI / 180.0);
    let springs: String = ["rotX", "rotY"]
        .iter()
        .map(|axis| {
            format!(
                "        uniform token drive:{axis}:physics:type = \"force\"\n        \
                 float drive:{axis}:physics:stiffness = {stiffness:?}\n        \
                 float drive:{axis}:physics:damping = {damping:?}\n        \
                 float drive:{axis}:physics:targetPosition = 0\n"
            )
        })
        .collect();
    write!(
        text,
        r#"    def PhysicsJoint "joint{i}" (
        prepend apiSchemas = ["PhysicsLimitAPI:transX", "PhysicsLimitAPI:transY", "PhysicsLimitAPI:transZ", "PhysicsLimitAPI:rotZ", "PhysicsDriveAPI:rotX", "PhysicsDriveAPI:rotY"]
    )
    {{
{parent}        rel physics:body1 = </Tree/link{i}>
        point3f physics:localPos0 = ({})
        quatf physics:localRot0 = ({})
        point3f physics:localPos1 = (0, 0, 0)
        quatf physics:localRot1 = (1, 0, 0, 0)
{locked}{springs}    }}
"#,
        numbers(translation.vector.as_slice(), ", "),
        quaternion(rotation),
    )
}

/// Corner of the capsule's bounding box relative to its centre.
fn corner(link: &Link, sign: f64) -> String {
    let r = link.segment.radius;
    numbers(&[sign * r, sign * r, sign * (0.5 * link.segment.length + r)], ", ")
}

/// USD writes the real part first.
fn quaternion(r: &Rotation) -> String {
    numbers(&[r.w, r.i, r.j, r.k], ", ")
}
