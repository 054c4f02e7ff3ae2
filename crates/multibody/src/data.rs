//! State, inputs and scratch of one world.

use orchard_geometry::{Pose, Vec3};
use serde::{Deserialize, Serialize};

use crate::aba::factors::Factor;
use crate::aba::vectors::{Change, Impulse};
use crate::contact::scratch::ContactScratch;
use crate::kinematics::Kinematics;
use crate::model::{BodyId, Groups, JointKind, Model, PointId};
use crate::rod::Deflection;
use crate::solver::scratch::LinearScratch;
use crate::spatial::Twist;
use crate::velocity_products::{VelocityProducts, fastest_turn};

/// State, the inputs of the next step, and scratch of one world. A step from a clone gives the same bits;
/// [`Data::state`] keeps only what that needs.
///
/// Per-joint arrays are indexed by [`Model::dofs`] (`q` by [`Model::qs`]), the others by id.
#[derive(Debug, Clone)]
pub struct Data {
    // State.
    /// Joint coordinates [rad, m]; see [`JointKind`] for the layout.
    pub q: Vec<f64>,
    /// Joint velocities [rad/s, m/s].
    pub v: Vec<f64>,
    /// Positions of the point bodies \[m\], world.
    pub point_p_world: Vec<Vec3>,
    /// Velocities of the point bodies [m/s], world.
    pub point_v_world: Vec<Vec3>,
    /// Angular velocities of the point bodies [rad/s], world; while tethered zero, or that of the link with which they turn.
    pub point_w_world: Vec<Vec3>,
    /// True for point bodies on their tethers. Without effect on point bodies that have none in the model.
    pub tethered: Vec<bool>,

    // Inputs of the next step; they keep their values until changed.
    /// Spring stiffness of each degree of freedom [N m/rad, N/m]. Ignored on free joints.
    pub stiffness: Vec<f64>,
    /// Damping of each degree of freedom [N m s/rad, N s/m].
    pub damping: Vec<f64>,
    /// Rest coordinate of each spring [rad, m]. Ignored on free joints.
    pub rest: Vec<f64>,
    /// Torque or force fed forward on each degree of freedom [N m, N].
    pub torque: Vec<f64>,
    /// Drag of each link in translation [1/s]: the force `-linear_drag * mass * v_com` at its centre of mass.
    pub linear_drag: Vec<f64>,
    /// Drag of each link in rotation [1/s]: the torque `-angular_drag * I_com * omega`.
    pub angular_drag: Vec<f64>,
    /// External force on each link \[N\], at its centre of mass, world axes.
    pub body_force_world: Vec<Vec3>,
    /// External torque on each link [N m], about its centre of mass, world axes.
    pub body_torque_world: Vec<Vec3>,
    /// External force on each point body \[N\], world.
    pub point_force_world: Vec<Vec3>,
    /// Force on each point body that a body at it bears in turn, as of a suction cup \[N\], besides the external force. It acts like the contacts between them: the predicted reaction of a capped tether leaves it out. For the next step; not a part of the state.
    pub point_paired_force_world: Vec<Vec3>,
    /// Quadratic drag of each point body [N s^2/m^2]: the force `-coefficient * |v| v`.
    pub point_quadratic_drag: Vec<f64>,
    /// Loss of each point body's spin [1/s]: the torque `-spin_damping * spin_inertia * omega`.
    pub point_spin_damping: Vec<f64>,
    /// Constant force on the anchor of each point body while it is tethered \[N\], world.
    pub anchor_bias_world: Vec<Vec3>,
    /// Largest net reaction of each point body on its anchor \[N\]. Infinite: no cap.
    pub reaction_cap: Vec<f64>,
    /// Point bodies moved from outside the model: they keep the velocity they are given, whatever
    /// pushes them.
    pub point_carried: Vec<bool>,
    /// Collision groups of each collider.
    pub groups: Vec<Groups>,

    // Derived and scratch.
    /// True for tethers whose reaction was capped in the last step.
    pub(crate) capped: Vec<bool>,
    pub(crate) kinematics: Kinematics,
    pub(crate) velocity_products: VelocityProducts,
    pub(crate) factor: Factor,
    pub(crate) impulse: Impulse,
    pub(crate) change: Change,
    pub(crate) correction: Change,
    pub(crate) linear: LinearScratch,
    pub(crate) contact: ContactScratch,
}

impl Data {
    /// The zero pose at rest, every spring at rest there with no stiffness, every tether holding its point
    /// body at its hang point; kinematics are valid.
    pub fn new(model: &Model) -> Data {
        let (nv, bodies, points) = (model.nv(), model.bodies.len(), model.points.len());
        let mut q = vec![0.0; model.nq()];
        for id in model.body_ids() {
            if model.body(id).joint.has_quaternion() {
                q[model.qs(id).end - 1] = 1.0;
            }
        }
        let mut data = Data {
            q,
            v: vec![0.0; nv],
            point_p_world: vec![Vec3::zeros(); points],
            point_v_world: vec![Vec3::zeros(); points],
            point_w_world: vec![Vec3::zeros(); points],
            tethered: model.points.iter().map(|point| point.tether.is_some()).collect(),
            stiffness: vec![0.0; nv],
            damping: vec![0.0; nv],
            rest: vec![0.0; nv],
            torque: vec![0.0; nv],
            linear_drag: vec![0.0; bodies],
            angular_drag: vec![0.0; bodies],
            body_force_world: vec![Vec3::zeros(); bodies],
            body_torque_world: vec![Vec3::zeros(); bodies],
            point_force_world: vec![Vec3::zeros(); points],
            point_paired_force_world: vec![Vec3::zeros(); points],
            point_quadratic_drag: vec![0.0; points],
            point_spin_damping: vec![0.0; points],
            anchor_bias_world: model
                .points
                .iter()
                .map(|point| point.tether.as_ref().map_or_else(Vec3::zeros, |t| t.anchor_bias_world))
                .collect(),
            reaction_cap: model
                .points
                .iter()
                .map(|point| point.tether.as_ref().map_or(f64::INFINITY, |t| t.reaction_cap))
                .collect(),
            point_carried: vec![false; points],
            groups: model.colliders.iter().map(|collider| collider.groups).collect(),
            capped: vec![false; points],
            kinematics: Kinematics::new(model),
            velocity_products: VelocityProducts::new(model),
            factor: Factor::new(model),
            impulse: Impulse::new(model),
            change: Change::new(model),
            correction: Change::new(model),
            linear: LinearScratch::default(),
            contact: ContactScratch::default(),
        };
        forward_kinematics(model, &mut data);
        for index in 0..points {
            if let Some(p_world) = data.hang_p_world(model, PointId(index as u32)) {
                data.point_p_world[index] = p_world;
            }
        }
        data
    }

    /// Pose of a link in the world, as of the last [`forward_kinematics`] or [`step()`](crate::step()).
    pub fn x_world_body(&self, id: BodyId) -> &Pose {
        &self.kinematics.links[id.index()].x_world_body
    }

    /// Velocity of a link at its origin, world axes, as of the last kinematics.
    pub fn velocity(&self, id: BodyId) -> Twist {
        self.kinematics.links[id.index()].velocity
    }

    /// Largest rate at which a link turns [rad/s]. Where it turns by more than [`SLOW_TURN`](crate::SLOW_TURN) in a substep, velocity products are not explicit any more.
    pub fn fastest_turn(&self) -> f64 {
        fastest_turn(&self.kinematics)
    }

    /// Velocity of the material point of a link that is now at `p_world` [m/s].
    pub fn point_velocity_world(&self, id: BodyId, p_world: &Vec3) -> Vec3 {
        let link = &self.kinematics.links[id.index()];
        link.velocity.linear_at(&(p_world - link.origin()))
    }

    /// Centre of mass of a link \[m\].
    pub fn com_p_world(&self, id: BodyId) -> Vec3 {
        let link = &self.kinematics.links[id.index()];
        link.origin() + link.r_com
    }

    /// Axis of a degree of freedom, world, unit: the direction in which it slides or about which it turns.
    pub fn dof_axis_world(&self, dof: usize) -> Vec3 {
        self.kinematics.axes[dof]
    }

    /// Anchor of a point body's tether \[m\], world; `None` without a tether in the model.
    pub fn anchor_p_world(&self, model: &Model, id: PointId) -> Option<Vec3> {
        let tether = model.point(id).tether.as_ref()?;
        Some(orchard_geometry::transform(self.x_world_body(tether.body), &tether.p_body))
    }

    /// Velocity of the anchor [m/s].
    pub fn anchor_v_world(&self, model: &Model, id: PointId) -> Option<Vec3> {
        let tether = model.point(id).tether.as_ref()?;
        Some(self.point_velocity_world(tether.body, &self.anchor_p_world(model, id)?))
    }

    /// Rest position of a tethered point body \[m\], world.
    pub fn hang_p_world(&self, model: &Model, id: PointId) -> Option<Vec3> {
        let tether = model.point(id).tether.as_ref()?;
        Some(self.anchor_p_world(model, id)? + tether.offset_world)
    }

    /// Elastic force of its tether on a point body \[N\]; zero while untethered.
    pub fn tether_spring_force(&self, model: &Model, id: PointId) -> Vec3 {
        match (&model.point(id).tether, self.hang_p_world(model, id)) {
            (Some(tether), Some(hang)) if self.tethered[id.index()] => {
                (hang - self.point_p_world[id.index()]) * tether.stiffness
            }
            _ => Vec3::zeros(),
        }
    }

    /// Deflection of the rod of a link's ball joint; `None` of other joints.
    pub fn deflection(&self, model: &Model, id: BodyId) -> Option<Deflection> {
        let is_ball = model.body(id).joint == JointKind::Ball;
        is_ball.then(|| Deflection::of(&self.q[model.qs(id)]))
    }

    /// The link with which a point body turns while it is tethered.
    pub(crate) fn turns_with(&self, model: &Model, point: usize) -> Option<BodyId> {
        let tether = model.points[point].tether.as_ref()?;
        (tether.turns && self.tethered[point] && !self.point_carried[point]).then_some(tether.body)
    }

    /// True if a point body takes part in rotation: off its tether, with a finite inertia.
    pub(crate) fn spins(&self, model: &Model, point: usize) -> bool {
        !self.tethered[point] && !self.point_carried[point] && model.points[point].spin_inertia.is_finite()
    }

    /// True if every coordinate and velocity is a finite number.
    pub fn is_finite(&self) -> bool {
        let vectors = [&self.point_p_world, &self.point_v_world, &self.point_w_world];
        self.q.iter().chain(&self.v).all(|x| x.is_finite())
            && vectors.into_iter().flatten().all(|p| p.iter().all(|x| x.is_finite()))
    }

    /// Copies positions and velocities out, to go back to them with [`Data::restore_motion`].
    pub fn save_motion(&self, motion: &mut Motion) {
        motion.q.clone_from(&self.q);
        motion.v.clone_from(&self.v);
        motion.points.clear();
        let points = self.point_p_world.iter().zip(&self.point_v_world).zip(&self.point_w_world);
        motion.points.extend(points.map(|((p, v), w)| [*p, *v, *w]));
    }

    /// Restores saved positions and velocities; inputs do not change.
    pub fn restore_motion(&mut self, motion: &Motion) {
        self.q.clone_from(&motion.q);
        self.v.clone_from(&motion.v);
        for (index, [p, v, w]) in motion.points.iter().enumerate() {
            self.point_p_world[index] = *p;
            self.point_v_world[index] = *v;
            self.point_w_world[index] = *w;
        }
    }
}

/// Brings poses, axes, velocities and bias accelerations up to `Data::q` and `Data::v`.
///
/// Does nothing if they are already. Afterwards the accessors of [`Data`] that name kinematics hold.
pub fn forward_kinematics(model: &Model, data: &mut Data) {
    data.kinematics.update(model, &data.q, &data.v);
}

/// As [`forward_kinematics`], if no coordinates have changed since then but those of some bodies, listed with all that they bear, parents first.
pub fn forward_kinematics_of(model: &Model, data: &mut Data, bodies: &[BodyId]) {
    data.kinematics.update_only(model, &data.q, &data.v, bodies);
}

/// Positions and velocities of a world at one moment.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    q: Vec<f64>,
    v: Vec<f64>,
    /// Position, velocity and angular velocity of each point body.
    points: Vec<[Vec3; 3]>,
}

impl Motion {
    /// True if this is the motion of a world of this model.
    pub fn fits(&self, model: &Model) -> bool {
        self.q.len() == model.nq() && self.v.len() == model.nv() && self.points.len() == model.points.len()
    }
}
