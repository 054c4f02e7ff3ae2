//! Spec, robot and seed -> the constant part of a world.

use crate::groups;
use crate::touch::{Part, parts};
use orchard_fruit::{Fruit, FruitGroups, FruitSet};
use orchard_geometry::{Pose, Rotation, Shape, Vec3, math};
use orchard_multibody::{Collider, Model, ModelBuilder, ModelError, Owner, StepSettings};
use orchard_robot::{PartGroups, RobotHandle, RobotModel};
use orchard_spec::{Purpose, Spec, Stream};
use orchard_treegen::{Skeleton, TreegenError};
use orchard_treephys::{TreeBody, TreeGroups, step_settings};

/// A world that cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    /// The tree does not grow.
    #[error("the tree does not grow: {0}")]
    Growth(#[from] TreegenError),
    /// The parts make no valid model.
    #[error("the world makes no valid model: {0}")]
    Model(#[from] ModelError),
    /// The loaded tree finds no rest.
    #[error("the tree finds no static equilibrium: {0}")]
    Equilibrium(#[from] orchard_multibody::StaticsError),
}

/// The constant part of a world.
#[derive(Debug, Clone)]
pub(crate) struct Parts {
    pub skeleton: Skeleton,
    pub model: Model,
    pub tree: TreeBody,
    pub fruit: FruitSet,
    pub handle: RobotHandle,
    pub colliders: Vec<Part>,
    pub x_world_odom: Pose,
    pub settings: StepSettings,
}

pub(crate) fn build(
    spec: &Spec,
    robot: &RobotModel,
    skeleton: Skeleton,
    fruit: Vec<Fruit>,
    seed: u64,
    world: u32,
) -> Result<Parts, WorldError> {
    let gravity = spec.sim.gravity.si();
    let mut builder = ModelBuilder::new();

    let ground = builder.add_collider(Collider {
        owner: Owner::World,
        shape: Shape::HalfSpace,
        x_owner_shape: Pose::identity(),
        groups: groups::GROUND_GROUPS,
        friction: spec.sim.ground_friction.si(),
        stiffness: spec.sim.ground_stiffness.si(),
    });
    let tree = TreeBody::add_to(
        &mut builder,
        &skeleton,
        &spec.wood,
        TreeGroups { wood: groups::WOOD_GROUPS, debris: groups::DEBRIS_GROUPS },
    );
    let fruit = FruitSet::add_to(
        &mut builder,
        fruit,
        &tree.bodies,
        &spec.fruit,
        gravity,
        FruitGroups {
            hanging: groups::HANGING_GROUPS,
            loose: groups::LOOSE_GROUPS,
            asleep: groups::ASLEEP_GROUPS,
        },
    );
    let x_world_odom = start_pose(robot.config().start.distance.si(), seed, world);
    let handle = robot.add_to(
        &mut builder,
        &x_world_odom,
        &PartGroups {
            base: groups::BASE_GROUPS,
            arm: groups::ROBOT_GROUPS,
            finger: groups::ROBOT_GROUPS,
            bucket: groups::BASE_GROUPS,
        },
    );
    let model = builder.build()?;
    let colliders = parts(&model, &tree.colliders, &fruit.colliders, ground, &handle);
    let settings = step_settings(&spec.sim);
    Ok(Parts { skeleton, model, tree, fruit, handle, colliders, x_world_odom, settings })
}

/// The robot starts at its distance from the trunk, at a random bearing, and faces it.
fn start_pose(distance: f64, seed: u64, world: u32) -> Pose {
    let bearing = Stream::new(seed, world, Purpose::RobotStart).uniform(0.0, std::f64::consts::TAU);
    let (sin, cos) = math::sin_cos(bearing);
    Pose::from_parts(
        Vec3::new(distance * cos, distance * sin, 0.0).into(),
        Rotation::from_axis_angle(&Vec3::z_axis(), bearing + std::f64::consts::PI),
    )
}
