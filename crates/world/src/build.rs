//! Builds the constant part of a world from spec, robot and seed.

use crate::ground::Ground;
use crate::groups;
use crate::scenery::{self, Strut};
use crate::sensing::Sensing;
use crate::terrain::TerrainError;
use crate::touch::{Part, parts};
use orchard_fruit::{Fruit, FruitSet, Shapes};
use orchard_geometry::{Aabb, Pose, Rotation, Vec3, math};
use orchard_multibody::{Collider, Groups, Model, ModelBuilder, ModelError, Owner, StepSettings};
use orchard_robot::{PartGroups, RobotHandle, RobotModel};
use orchard_spec::{Purpose, Spec, Stream};
use orchard_treegen::{Skeleton, TreegenError};
use orchard_treephys::wind::Weather;
use orchard_treephys::{Timber, TreeBody, TreeGroups, step_settings};

/// A world that cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    /// The tree does not grow.
    #[error("the tree does not grow: {0}")]
    Growth(#[from] TreegenError),
    /// The ground cannot be built.
    #[error(transparent)]
    Terrain(#[from] TerrainError),
    /// The parts form no valid model.
    #[error("the parts of the world form no valid model: {0}")]
    Model(#[from] ModelError),
    /// The loaded tree finds no rest.
    #[error("the tree finds no static equilibrium: {0}")]
    Equilibrium(#[from] orchard_multibody::StaticsError),
}

/// The constant part of a world.
#[derive(Debug, Clone)]
pub(crate) struct Parts {
    pub skeleton: Skeleton,
    pub ground: Ground,
    pub struts: Vec<Strut>,
    pub model: Model,
    pub tree: TreeBody,
    pub wind: Option<Weather>,
    pub sensing: Option<Sensing>,
    pub fruit: FruitSet,
    pub handle: RobotHandle,
    pub colliders: Vec<Part>,
    /// Colliders of the robot.
    pub robot_colliders: Vec<usize>,
    /// The colliders for loose fruit.
    pub shapes: Shapes,
    /// A ball about every collider, in its owner's frame.
    pub bounds: Vec<(Vec3, f64)>,
    pub x_world_odom: Pose,
    pub settings: StepSettings,
    /// Groups by which colliders meet in contacts that a graphics device does not know: those of the robot with uneven ground.
    pub unlent_groups: Vec<Groups>,
}

pub(crate) fn build(
    spec: &Spec,
    robot: &RobotModel,
    skeleton: Skeleton,
    fruit: Vec<Fruit>,
    seed: u64,
    world: u32,
    repeat: u32,
) -> Result<Parts, WorldError> {
    let gravity = spec.sim.gravity.si();
    let ground = Ground::new(spec, robot, seed, world)?;
    let mut builder = ModelBuilder::new();

    let ground_collider = builder.add_collider(Collider {
        owner: Owner::World,
        shape: ground.shape(),
        x_owner_shape: Pose::identity(),
        groups: groups::GROUND_GROUPS,
        friction: spec.sim.ground_friction.si(),
        stiffness: spec.sim.ground_stiffness.si(),
    });
    let struts = scenery::struts(spec.scenery.as_ref());
    let scenery = scenery::add_to(&mut builder, spec.scenery.as_ref(), &struts);
    let tree = TreeBody::of_timber(
        &mut builder,
        &skeleton,
        &spec.wood,
        &Timber::draw(&skeleton, &spec.wood, seed, world),
        TreeGroups { wood: groups::WOOD_GROUPS, debris: groups::DEBRIS_GROUPS },
    );
    let fruit = FruitSet::add_to(
        &mut builder,
        fruit,
        &tree.bodies,
        &skeleton,
        &spec.fruit,
        gravity,
        groups::fruit(spec.fruit.cluster.is_some()),
    );
    let mut x_world_odom =
        start_pose(spec, robot, &mut Stream::of_repeat(seed, world, repeat, Purpose::RobotStart));
    x_world_odom.translation.z = ground.ride_height(&x_world_odom);
    let handle = robot.add_to(
        &mut builder,
        &x_world_odom,
        &PartGroups {
            base: groups::BASE_GROUPS,
            arm: groups::ROBOT_GROUPS,
            finger: groups::ROBOT_GROUPS,
            bucket: groups::BASE_GROUPS,
            self_contact: Some(groups::ROBOT_LINKS),
        },
    );
    let model = builder.build()?;
    let colliders = parts(&model, &tree.colliders, &fruit.colliders, ground_collider, &scenery, &handle);
    let wind = Weather::new(spec, &skeleton, seed, world);
    let sensing = Sensing::new(spec, &handle, seed, world);
    let settings = step_settings(&spec.sim);
    let robot_colliders = (0..colliders.len()).filter(|&c| colliders[c].is_robot()).collect();
    let bounds = bounds(&model);
    let shapes = Shapes::new(model.colliders().iter().map(|c| &c.shape));
    let uneven = ground.field().map(|_| ground_collider);
    let unlent_groups = model.collider_ids().map(|id| match uneven {
        Some(ground) if id == ground => groups::GROUND_GROUPS,
        Some(_) if colliders[id.index()].is_robot() => groups::on_ground(model.collider(id).groups),
        _ => Groups::NONE,
    });
    let unlent_groups = unlent_groups.collect();
    Ok(Parts {
        skeleton,
        ground,
        struts,
        model,
        tree,
        wind,
        sensing,
        fruit,
        handle,
        colliders,
        robot_colliders,
        shapes,
        bounds,
        x_world_odom,
        settings,
        unlent_groups,
    })
}

/// A ball about every collider, in the frame of its owner: centre and radius \[m\]. Infinite about the ground.
fn bounds(model: &Model) -> Vec<(Vec3, f64)> {
    let ball = |collider: &Collider| {
        let Aabb { min, max } = collider.shape.aabb(&collider.x_owner_shape);
        let centre = 0.5 * (min + max);
        if centre.iter().all(|x| x.is_finite()) {
            (centre, 0.5 * (max - min).norm())
        } else {
            (Vec3::zeros(), f64::INFINITY)
        }
    };
    model.colliders().iter().map(ball).collect()
}

/// Start pose of the robot's base, at the place that its config asks for, else where the world's config lets robots start; the ground sets its
/// height.
fn start_pose(spec: &Spec, robot: &RobotModel, stream: &mut Stream) -> Pose {
    let placement = robot.config().placement.as_ref();
    let start = &spec.episode.start;
    let (distances, headings) =
        placement.map_or((&start.distance, &start.heading), |place| (&place.distance, &place.heading));
    let bearing = scenery::start_bearing(spec.scenery.as_ref(), stream);
    let distance = stream.within(distances.si());
    let heading = stream.within(headings.si());
    let (sin, cos) = math::sin_cos(bearing);
    Pose::from_parts(
        Vec3::new(distance * cos, distance * sin, 0.0).into(),
        Rotation::from_axis_angle(&Vec3::z_axis(), bearing + std::f64::consts::PI + heading),
    )
}

#[cfg(test)]
#[path = "cluster_tests.rs"]
mod cluster_tests;
