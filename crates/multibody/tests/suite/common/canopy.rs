//! A tree with a fruit on every fifth link before a wall, and a heavy base that is driven into it.
#![allow(dead_code)] // each user takes a part of it

use nalgebra::Translation3;
use orchard_geometry::{Mat3, Pose, Rotation, Shape, Vec3};
use orchard_multibody::*;
use orchard_spec::{Purpose, Stream};

/// Links of a branch.
const CHAIN: usize = 10;
/// Links for each fruit.
const LINKS_PER_FRUIT: usize = 5;
/// Speed at which the base drives [m/s].
const SPEED: f64 = 1.1;

/// From the trunk to the wall [m].
const WALL: f64 = 0.2;

const TREE: Groups = Groups { member: 2, filter: 1 };

/// The model, and the state in which the base starts `distance` metres from the trunk.
pub fn canopy(link_count: usize, distance: f64) -> (Model, Data) {
    let mut rng = Stream::new(7, 0, Purpose::Test);
    let mut builder = ModelBuilder::new();
    let base = builder.add_body(Body {
        parent: None,
        joint: JointKind::Planar,
        x_parent_joint: Pose::identity(),
        inertia: SpatialInertia { mass: 130.0, p_com: Vec3::zeros(), i_com: Mat3::identity() * 8.0 },
    });
    builder.add_collider(Collider {
        owner: Owner::Body(base),
        shape: Shape::Box { half: Vec3::new(0.3, 0.6, 1.0) },
        x_owner_shape: Translation3::new(-0.3, 0.0, 1.0).into(),
        groups: Groups { member: 1, filter: 2 },
        friction: 0.5,
        stiffness: 1e5,
    });
    builder.add_collider(Collider {
        owner: Owner::World,
        shape: Shape::Box { half: Vec3::new(0.3, 3.0, 3.0) },
        x_owner_shape: Translation3::new(WALL + 0.3, 0.0, 0.0).into(),
        groups: Groups { member: 1, filter: 2 },
        friction: 0.5,
        stiffness: 1e5,
    });
    // A trunk, then chains that leave earlier links sideways and get thinner.
    let (mut links, mut stiffness) = (Vec::new(), Vec::new());
    for index in 0..link_count {
        let starts = index % CHAIN == 0;
        let radius = if index < CHAIN { 0.03 } else { 0.012 - 0.0009 * (index % CHAIN) as f64 };
        let parent: Option<BodyId> = match index {
            0 => None,
            _ if starts && index < 6 * CHAIN => Some(links[3 + (rng.unit() * 7.0) as usize]),
            _ if starts => Some(links[CHAIN + (rng.unit() * (index - CHAIN) as f64) as usize]),
            _ => Some(links[index - 1]),
        };
        let angle = |rng: &mut Stream, size: f64| rng.uniform(-size, size);
        let lean = match (index < CHAIN, starts) {
            (true, _) => Vec3::zeros(),
            (false, true) => Vec3::new(angle(&mut rng, 1.0), angle(&mut rng, 1.0), 0.0),
            (false, false) => Vec3::new(angle(&mut rng, 0.1), angle(&mut rng, 0.1), 0.0),
        };
        let (length, mass) = (0.1, 800.0 * std::f64::consts::PI * radius * radius * 0.1);
        let across = mass * (radius * radius / 4.0 + length * length / 12.0);
        let link = builder.add_body(Body {
            parent,
            joint: JointKind::Universal,
            x_parent_joint: Pose::from_parts(
                Translation3::new(0.0, 0.0, if index == 0 { 0.0 } else { length }),
                Rotation::from_scaled_axis(lean),
            ),
            inertia: SpatialInertia {
                mass,
                p_com: Vec3::z() * (0.5 * length),
                i_com: Mat3::from_diagonal(&Vec3::new(across, across, 0.5 * mass * radius * radius)),
            },
        });
        let square = radius * radius;
        stiffness.push(6e9 * std::f64::consts::PI / 4.0 * square * square / length);
        links.push(link);
        builder.add_collider(Collider {
            owner: Owner::Body(link),
            shape: Shape::Capsule { radius, length },
            x_owner_shape: Pose::identity(),
            groups: TREE,
            friction: 0.5,
            stiffness: 1e5,
        });
    }
    let fruit = link_count / LINKS_PER_FRUIT;
    for index in 0..fruit {
        let point = builder.add_point(PointBody {
            mass: 0.16,
            spin_inertia: 1e-4,
            tether: Some(Tether {
                body: links[CHAIN + index * (link_count - CHAIN) / fruit],
                p_body: Vec3::z() * 0.1,
                offset_world: Vec3::new(0.0, 0.0, -0.06),
                stiffness: 60.0,
                damping: 0.3,
                anchor_bias_world: Vec3::z() * (0.16 * 9.81),
                reaction_cap: f64::INFINITY,
                turns: false,
            }),
        });
        builder.add_collider(Collider {
            owner: Owner::Point(point),
            shape: Shape::Sphere { radius: 0.0375 },
            x_owner_shape: Pose::identity(),
            groups: TREE,
            friction: 0.5,
            stiffness: 1e5,
        });
    }
    let model = builder.build().expect("a valid world");
    let mut data = Data::new(&model);
    for (link, k) in links.iter().zip(stiffness) {
        for dof in model.dofs(*link) {
            data.stiffness[dof] = k;
            data.damping[dof] = 0.02 * k;
        }
    }
    data.q[0] = -distance;
    data.v[0] = SPEED;
    forward_kinematics(&model, &mut data);
    for index in 0..fruit {
        let hang = data.hang_p_world(&model, PointId(index as u32));
        data.point_p_world[index] = hang.unwrap_or_default();
    }
    (model, data)
}
