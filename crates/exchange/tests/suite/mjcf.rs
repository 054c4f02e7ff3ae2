//! Tests the MJCF export: exact parts are written, others are refused. `cargo xtask judge` compares the motion in MuJoCo
//! with ours.

use std::sync::Arc;

use nalgebra::Vector3;
use orchard_exchange::mjcf::{self, MjcfError};
use orchard_geometry::{ConvexHull, HeightField, Mat3, Pose, Shape, Vec3};
use orchard_multibody::*;

const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// Two links in a row and a fruit on the second, the second link given before its sibling.
fn tree(reaction_cap: f64) -> Model {
    let mut builder = ModelBuilder::new();
    let mut link = |parent| {
        builder.add_body(Body {
            parent,
            joint: JointKind::Universal,
            x_parent_joint: Pose::translation(0.0, 0.0, 0.1),
            inertia: SpatialInertia {
                mass: 0.1,
                p_com: Vector3::z() * 0.05,
                i_com: Mat3::from_diagonal(&Vector3::new(1e-4, 1e-4, 1e-5)),
            },
        })
    };
    let trunk = link(None);
    let branch = link(Some(trunk));
    link(Some(trunk));
    builder.add_point(PointBody {
        mass: 0.16,
        spin_inertia: f64::INFINITY,
        tether: Some(Tether {
            body: branch,
            p_body: Vector3::z() * 0.1,
            offset_world: Vector3::new(0.0, 0.0, -0.05),
            stiffness: 550.0,
            damping: 17.0,
            anchor_bias_world: Vector3::new(0.0, 0.0, 1.5),
            reaction_cap,
            turns: false,
        }),
    });
    builder.build().unwrap()
}

#[test]
fn links_nest_and_tethers_are_affine_in_their_length() {
    let model = tree(f64::INFINITY);
    let mut data = Data::new(&model);
    data.stiffness.fill(2.5);
    let text = mjcf::write("t", &model, &data, &GRAVITY, 1e-3).unwrap();

    // link1 closes before its sibling link2 opens, both inside link0.
    let at = |needle: &str| text.find(needle).unwrap_or_else(|| panic!("no {needle} in\n{text}"));
    assert!(at("\"link0\"") < at("\"link1\"") && at("\"link1\"") < at("\"link2\""));
    assert!(text[at("\"link1\"")..at("\"link2\"")].contains("</body>"));
    assert!(!text[at("\"link0\"")..at("\"link1\"")].contains("</body>"));
    assert_eq!(text.matches("<body ").count(), text.matches("</body>").count());

    assert_eq!(text.matches("type=\"hinge\"").count(), model.nv());
    assert_eq!(text.matches("stiffness=\"2.5\"").count(), model.nv());
    assert!(text.contains("fullinertia=\"0.0001 0.0001 1e-5 0.0 0.0 0.0\""), "{text}");
    // Force on the anchor: -k o - k l - c dl/dt along each axis, and the constant bias.
    assert!(text.contains("biasprm=\"27.5 -550.0 -17.0\""), "{text}");
    assert_eq!(text.matches("refsite=\"point0\"").count(), 3);
    assert_eq!(text.matches("refsite=\"world\"").count(), 1);
}

#[test]
fn for_timing_fruit_slide_in_their_link_and_the_state_is_a_keyframe() {
    let model = tree(10.0);
    let mut data = Data::new(&model);
    data.q[0] = 0.3;
    data.v[2] = -0.7;
    data.linear_drag.fill(1.0);
    forward_kinematics(&model, &mut data);
    // The fruit is 1 cm along the second link's x from its hang point, at rest in the world.
    let (branch, fruit) = (BodyId(1), PointId(0));
    let hang_at_zero = Vector3::new(0.0, 0.0, 0.1 - 0.05);
    let x_world_link = *data.x_world_body(branch);
    let slid = hang_at_zero + Vector3::x() * 0.01;
    data.point_p_world[fruit.index()] = orchard_geometry::transform(&x_world_link, &slid);
    let text = mjcf::write_for_timing("t", &model, &data, &GRAVITY, 1e-3).unwrap();

    let at = |needle: &str| text.find(needle).unwrap_or_else(|| panic!("no {needle} in\n{text}"));
    // point0 opens inside link1, before its sibling, and has its own springs; nothing else holds it.
    assert!(at("\"link1\"") < at("\"point0\"") && at("\"point0\"") < at("\"link2\""));
    assert_eq!(text.matches("stiffness=\"550.0\" damping=\"17.0\"").count(), 3);
    assert!(!text.contains("actuator") && !text.contains("site"), "{text}");

    let numbers = |attribute: &str| -> Vec<f64> {
        let start = at(&format!("{attribute}=\"")) + attribute.len() + 2;
        text[start..].split('"').next().unwrap().split(' ').map(|x| x.parse().unwrap()).collect()
    };
    // In the order of the file: link0, link1, point0, link2.
    let (qpos, qvel) = (numbers("qpos"), numbers("qvel"));
    assert_eq!((qpos.len(), qvel.len()), (model.nv() + 3, model.nv() + 3));
    assert_eq!((qpos[0], qvel[2]), (0.3, -0.7));
    let gap = Vector3::new(qpos[4], qpos[5], qpos[6]) - Vector3::x() * 0.01;
    assert!(gap.norm() < 1e-15, "{gap}");
    // The link turns about its x axis at -0.7 rad/s below the fruit, which is at rest.
    let (slide_y, expected) = (qvel[5], -0.7 * slid.z);
    assert!((slide_y - expected).abs() < 1e-15, "{slide_y} {expected}");
}

#[test]
fn parts_without_counterpart_are_refused() {
    let refused = |model: &Model, data: &Data| {
        let error = mjcf::write("t", model, data, &GRAVITY, 1e-3).expect_err("was exported");
        assert!(matches!(error, MjcfError::Unsupported { .. }), "{error}");
    };
    let model = tree(f64::INFINITY);
    let data = Data::new(&model);
    refused(&tree(10.0), &Data::new(&tree(10.0)));
    let mut spoilt = data.clone();
    spoilt.linear_drag[1] = 1.0;
    refused(&model, &spoilt);
    spoilt = data.clone();
    spoilt.torque[0] = 1.0;
    refused(&model, &spoilt);
    spoilt = data;
    spoilt.tethered[0] = false;
    refused(&model, &spoilt);
    // Shapes that would be missing from the picture.
    let corners: Vec<Vec3> =
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vec3::from).to_vec();
    let field = HeightField::new(2, 2, [1.0; 2], vec![0.0; 4]).unwrap();
    let hull = ConvexHull::new(&corners).unwrap();
    for shape in [Shape::ConvexHull(Arc::new(hull)), Shape::HeightField(Arc::new(field))] {
        let mut builder = ModelBuilder::new();
        let groups = Groups { member: 1, filter: 1 };
        let x_owner_shape = Pose::identity();
        let (owner, friction, stiffness) = (Owner::World, 0.5, 1e6);
        builder.add_collider(Collider { owner, shape, x_owner_shape, groups, friction, stiffness });
        let model = builder.build().unwrap();
        refused(&model, &Data::new(&model));
    }
}
