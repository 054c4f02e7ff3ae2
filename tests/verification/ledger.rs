//! Compares a world's energy with the largest energy that can have been added to it.

use orchard_geometry::Vec3;
use orchard_multibody::{BodyId, PointId, energy};
use orchard_robot::RobotModel;
use orchard_world::World;

/// Round-off of the energy of a world, a sum of some thousand joules \[J\].
pub const ROUND_OFF: f64 = 1e-9;

/// The energy that a world had, and the most that motors, outside work and lost supports have added since.
///
/// Motors add their largest effort times the way of their joint. The fruit of live wood is held up by constant forces
/// on its anchors, which the energy holds as a potential; where such a force ends (a stem that gives way, a limb that breaks),
/// its potential is added. Every other force of the model is elastic, weight or a loss. The linearly
/// implicit step only ever takes more away than the forces do, so the energy must stay under the bound.
pub struct Ledger {
    gravity: Vec3,
    /// Joints with a motor and its largest effort \[N, N m\].
    motors: Vec<(BodyId, Vec<f64>)>,
    bound: f64,
    q: Vec<f64>,
    supports: Vec<f64>,
}

impl Ledger {
    /// Starts with the present state.
    pub fn open(world: &World, robot: &RobotModel) -> Self {
        let (config, handle) = (robot.config(), world.handle());
        let base = config.drive.as_ref().expect("it drives");
        let (push, turn) = (base.force_max.si(), base.torque_max.si());
        let mut motors = vec![(*handle.base_joint.moving().expect("it drives"), vec![push, push, turn])];
        let efforts = robot.kinematics().limits().iter().map(|limit| vec![limit.effort]);
        motors.extend(handle.arm.iter().copied().zip(efforts));
        let force = config.finger.as_ref().map_or(0.0, |drive| drive.force_max.si());
        motors.extend(handle.fingers.iter().map(|finger| (finger.drive, vec![force])));
        let mut ledger = Self {
            gravity: Vec3::new(0.0, 0.0, -world.spec().sim.gravity.si()),
            motors,
            bound: 0.0,
            q: Vec::new(),
            supports: Vec::new(),
        };
        ledger.bound = ledger.energy(world);
        ledger.remember(world);
        ledger
    }

    /// Enters one frame with the work of test forces in it \[J\]; returns the margin of the energy below its bound \[J\].
    pub fn enter(&mut self, world: &World, work: f64) -> f64 {
        let (model, data) = (world.model(), world.data());
        for (body, efforts) in &self.motors {
            let ways = model.qs(*body).map(|q| (data.q[q] - self.q[q]).abs());
            self.bound += ways.zip(efforts).map(|(way, effort)| way * effort).sum::<f64>();
        }
        let height = world.handle().height.expect("it has a height joint");
        let at = model.qs(height).start;
        self.bound += data.torque[model.dofs(height).start] * (data.q[at] - self.q[at]);
        self.bound += work;
        for (index, support) in self.supports.iter().enumerate() {
            if *support != 0.0 && (!data.tethered[index] || data.anchor_bias_world[index] == Vec3::zeros()) {
                self.bound += support;
            }
        }
        self.remember(world);
        self.bound - self.energy(world)
    }

    fn remember(&mut self, world: &World) {
        let (model, data) = (world.model(), world.data());
        self.q.clone_from(&data.q);
        self.supports.clear();
        self.supports.extend((0..data.tethered.len()).map(|index| {
            let anchor = data.anchor_p_world(model, PointId(index as u32));
            match anchor {
                Some(anchor) if data.tethered[index] => data.anchor_bias_world[index].dot(&anchor),
                _ => 0.0,
            }
        }));
    }

    /// All energy but that in the springs by which motors are modelled.
    fn energy(&self, world: &World) -> f64 {
        let (model, data) = (world.model(), world.data());
        let of_motors = self.motors.iter().flat_map(|(body, _)| model.qs(*body).zip(model.dofs(*body)));
        let spring = |(q, dof): (usize, usize)| {
            let stretch = data.q[q] - data.rest[dof];
            0.5 * data.stiffness[dof] * stretch * stretch
        };
        let springs: f64 = of_motors.map(spring).sum();
        energy(model, data, &self.gravity).total() - springs
    }
}
