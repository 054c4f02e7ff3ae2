//! Wood alone in a world, without a robot.

use orchard_geometry::{Vec3, rotation_from_z, transform};
use orchard_multibody::{Data, Groups, Model, ModelBuilder, StepReport, StepSettings, equilibrium, step};
use orchard_spec::Spec;
use orchard_spec::wood::{JointLaw, WoodSpec};
use orchard_treegen::{Segment, Skeleton};
use orchard_treephys::{TreeBody, TreeGroups, section};

/// Gravity \[m/s^2\].
pub const GRAVITY: f64 = 9.81;

/// Wood without drag, so that springs and dampers are all that acts.
pub fn bare_wood(law: JointLaw, damping_time: f64) -> WoodSpec {
    let mut wood = Spec::paper().wood;
    wood.joint_law = law;
    wood.linear_drag = wood.linear_drag.with_value(0.0).unwrap();
    wood.angular_drag = wood.angular_drag.with_value(0.0).unwrap();
    wood.damping_time = wood.damping_time.with_value(damping_time).unwrap();
    wood
}

/// A straight branch of segments of given (length, radius), from the origin.
pub fn branch(direction: Vec3, segments: &[(f64, f64)]) -> Skeleton {
    let mut skeleton =
        Skeleton { segments: Vec::new(), fruit_sites: Vec::new(), leaves: Vec::new(), spurs: Vec::new() };
    let mut at = 0.0;
    for (index, &(length, radius)) in segments.iter().enumerate() {
        skeleton.segments.push(Segment {
            parent: index.checked_sub(1),
            p_base_world: direction * at,
            r_world_segment: rotation_from_z(&direction),
            length,
            radius,
            order: 0,
        });
        at += length;
    }
    skeleton
}

/// A tree alone in a world.
pub struct Wood {
    pub spec: WoodSpec,
    pub skeleton: Skeleton,
    pub model: Model,
    pub data: Data,
    pub tree: TreeBody,
    pub settings: StepSettings,
}

impl Wood {
    /// Unloaded, at rest, without gravity.
    pub fn new(skeleton: Skeleton, spec: WoodSpec) -> Self {
        let mut builder = ModelBuilder::new();
        let groups = TreeGroups { wood: Groups::NONE, debris: Groups::NONE };
        let tree = TreeBody::add_to(&mut builder, &skeleton, &spec, groups);
        let model = builder.build().unwrap();
        let mut data = Data::new(&model);
        tree.reset(&model, &mut data, &spec);
        let sim = Spec::paper().sim;
        let settings = StepSettings { gravity: Vec3::zeros(), ..orchard_treephys::step_settings(&sim) };
        Self { spec, skeleton, model, data, tree, settings }
    }

    /// A uniform cantilever along x of length 1 m and radius 3 mm.
    pub fn cantilever(n: usize, spec: WoodSpec) -> Self {
        Self::new(branch(Vec3::x(), &vec![(1.0 / n as f64, 0.003); n]), spec)
    }

    /// Bending stiffness E I of a segment \[N m^2\].
    pub fn bending_stiffness(&self, segment: usize) -> f64 {
        self.spec.youngs_modulus.si() * section::second_moment(self.skeleton.segments[segment].radius)
    }

    /// Mass of the wood \[kg\].
    pub fn mass(&self) -> f64 {
        self.model.bodies().iter().map(|b| b.inertia.mass).sum()
    }

    pub fn step(&mut self) {
        step(&self.model, &mut self.data, &self.settings, &mut StepReport::default());
    }

    pub fn settle(&mut self) {
        equilibrium(&self.model, &mut self.data, &self.settings.gravity, 1e-14).unwrap();
    }

    /// Loads the tip of a segment with a force; the arm is the present one.
    pub fn load_tip(&mut self, segment: usize, force_world: Vec3) {
        let body = self.tree.bodies[segment];
        let arm = self.p_tip(segment) - self.data.com_p_world(body);
        self.data.body_force_world[body.index()] = force_world;
        self.data.body_torque_world[body.index()] = arm.cross(&force_world);
    }

    /// Tip of a segment, world.
    pub fn p_tip(&self, segment: usize) -> Vec3 {
        let tip = Vec3::new(0.0, 0.0, self.skeleton.segments[segment].length);
        transform(self.data.x_world_body(self.tree.bodies[segment]), &tip)
    }

    /// Mechanical energy \[J\].
    pub fn energy(&self) -> f64 {
        orchard_multibody::energy(&self.model, &self.data, &self.settings.gravity).total()
    }
}
