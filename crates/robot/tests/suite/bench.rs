//! A robot in a world of its own, alone or with bodies that a test adds.

use orchard_geometry::{Intrinsics, Pose, Shape, Vec3};
use orchard_multibody::{
    Collider, ContactPath, Data, Groups, Integrator, Model, ModelBuilder, Motion, Owner, Solver, StepReport,
    StepSettings, step,
};
use orchard_robot::{Command, Observation, PartGroups, RobotHandle, RobotModel, Servos, observe};

pub const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.81);
pub const NO_GRAVITY: Vec3 = Vec3::new(0.0, 0.0, 0.0);
pub const SUBSTEP: f64 = 1.0 / 180.0;

/// Group of the robot's parts; they touch what is of group [`OTHER`].
const ROBOT: Groups = Groups { member: 1, filter: 2 };

/// Group of what is not the robot.
pub const OTHER: Groups = Groups { member: 2, filter: 1 };

/// Groups of a robot whose parts all touch others.
pub const TOUCHING: PartGroups =
    PartGroups { base: ROBOT, arm: ROBOT, finger: ROBOT, bucket: ROBOT, self_contact: None };

/// Groups of a robot whose fingers alone touch others.
pub const FINGERS_TOUCH: PartGroups =
    PartGroups { base: Groups::NONE, arm: Groups::NONE, bucket: Groups::NONE, ..TOUCHING };

/// A robot in its start posture, with its world.
pub struct Bench {
    pub robot: RobotModel,
    pub model: Model,
    pub data: Data,
    pub handle: RobotHandle,
    pub servos: Servos,
    pub report: StepReport,
}

impl Bench {
    /// The robot alone.
    pub fn new(robot: &RobotModel) -> Self {
        Self::with(robot, &TOUCHING, |_| ()).0
    }

    /// The robot with what `add` puts into its world; returns the value of `add` too.
    pub fn with<T>(
        robot: &RobotModel,
        groups: &PartGroups,
        add: impl FnOnce(&mut ModelBuilder) -> T,
    ) -> (Self, T) {
        let mut builder = ModelBuilder::new();
        let handle = robot.add_to(&mut builder, &Pose::identity(), groups);
        let added = add(&mut builder);
        let model = builder.build().unwrap();
        let mut data = Data::new(&model);
        robot.set_start(&model, &mut data, &handle);
        let (robot, servos) = (robot.clone(), Servos::new(robot));
        (Self { robot, model, data, handle, servos, report: StepReport::default() }, added)
    }

    /// Steps once under a command. As in a world, servos that contact pushed over their limits exert the limit, and the substep is repeated.
    pub fn substep(&mut self, command: &Command, gravity: &Vec3) {
        let settings = StepSettings {
            h: SUBSTEP,
            gravity: *gravity,
            contact_dissipation_time: 0.01,
            contact_margin: 0.005,
            integrator: Integrator::default(),
            solver: Solver::default(),
            contact_path: ContactPath::default(),
        };
        let Self { model, data, handle, servos, report, .. } = self;
        servos.apply(model, data, handle, command, 0.0, gravity, SUBSTEP, 0.0);
        let mut before = Motion::default();
        data.save_motion(&mut before);
        step(model, data, &settings, report);
        while servos.cap_overshoot(model, data, handle) {
            data.restore_motion(&before);
            step(model, data, &settings, report);
        }
    }

    /// Reads the sensors.
    pub fn observe(&self) -> Observation {
        observe(&self.model, &self.data, &self.handle, 0.0, Intrinsics::from_vertical_fov(8, 6, 1.0))
    }
}

/// Number of substeps of a time \[s\].
pub fn substeps(seconds: f64) -> usize {
    (seconds / SUBSTEP).round() as usize
}

/// A fixed shape of the surroundings.
pub fn fixed(shape: Shape, p_world: Vec3) -> Collider {
    Collider {
        owner: Owner::World,
        shape,
        x_owner_shape: Pose::from_parts(p_world.into(), orchard_geometry::Rotation::identity()),
        groups: OTHER,
        friction: 0.5,
        stiffness: 1e5,
    }
}
