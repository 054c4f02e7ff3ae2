//! Loose fruit in a rigid-body engine (rapier), for one frame at a time.
//!
//! A new engine is built at the start of every frame from the positions, velocities and spins of the fruit, always in the
//! same order, and dropped at its end. So the engine's own state (pairs, islands, first guesses of
//! impulses) does not outlive a frame, and a snapshot needs none of it. Between frames a fruit is three vectors: position,
//! velocity and spin; the orientation of a ball does not matter.

use crate::bruise::{Partner, impact_energy};
use crate::obstacle::{Obstacle, engine_pose, vec3, vector};
use orchard_geometry::{Pose, Vec3, inverse_transform, transform};
use orchard_spec::sim::LooseSpec;
use rapier3d_f64::prelude::*;
use std::fmt;

/// A loose fruit at the start of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Index of the fruit.
    pub fruit: usize,
    /// Radius \[m\].
    pub radius: f64,
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre \[m\], world.
    pub p_world: Vec3,
    /// Velocity [m/s], world.
    pub v_world: Vec3,
    /// Spin [rad/s], world.
    pub w_world: Vec3,
    /// External force \[N\], world.
    pub force_world: Vec3,
    /// Air drag [N s^2/m^2]: the force `-coefficient * |v| v`.
    pub quadratic_drag: f64,
    /// Rate at which it loses its spin [1/s].
    pub rolling_loss: f64,
    /// Restitution.
    pub restitution: f64,
    /// Friction of its skin.
    pub friction: f64,
}

/// An impact of a fruit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    /// Index of the fruit.
    pub fruit: usize,
    /// Body that it collided with.
    pub partner: Partner,
    /// Energy of the approach \[J\].
    pub energy: f64,
}

/// A contact that pressed in the last step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pressing {
    /// The fruit, its partner, and the energy of their approach before the step.
    pub impact: Impact,
    /// Height of the fruit's centre before the step \[m\].
    pub z_world: f64,
}

/// A frame of loose fruit.
pub struct Engine {
    world: PhysicsWorld,
    balls: Vec<(Ball, RigidBodyHandle)>,
    obstacles: Vec<(Obstacle, Option<RigidBodyHandle>, Pose)>,
    pressing: Vec<Pressing>,
}

impl fmt::Debug for Engine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Engine").field("balls", &self.balls).field("pressing", &self.pressing).finish()
    }
}

impl Engine {
    /// An empty engine with substeps of `h` \[s\] under gravity [m/s^2].
    pub fn new(h: f64, gravity_world: &Vec3, spec: &LooseSpec) -> Self {
        let contacts = SpringCoefficients::new(spec.contact_frequency.si(), spec.contact_damping_ratio.si());
        let integration_parameters = IntegrationParameters {
            dt: h,
            contact_softness: contacts,
            static_contact_softness: contacts,
            normalized_max_corrective_velocity: spec.recovery_speed.si(),
            num_internal_pgs_iterations: spec.sweeps.get() as usize,
            friction_model: FrictionModel::Coulomb,
            // Both save time in large, long-lasting piles, and are inexact.
            contact_clustering: false,
            contact_recycling: false,
            ..IntegrationParameters::default()
        };
        let world =
            PhysicsWorld { gravity: vector(gravity_world), integration_parameters, ..PhysicsWorld::new() };
        Self { world, balls: Vec::new(), obstacles: Vec::new(), pressing: Vec::new() }
    }

    /// Adds a fruit, with its momentum unchanged.
    pub fn add_ball(&mut self, ball: Ball) {
        let body = RigidBodyBuilder::dynamic()
            .translation(vector(&ball.p_world))
            .linvel(vector(&ball.v_world))
            .angvel(vector(&ball.w_world))
            .angular_damping(ball.rolling_loss)
            .can_sleep(false);
        let collider = ColliderBuilder::ball(ball.radius)
            .mass(ball.mass)
            .friction(ball.friction)
            .friction_combine_rule(CoefficientCombineRule::GeometricMean)
            .restitution(ball.restitution)
            .restitution_combine_rule(CoefficientCombineRule::Max)
            .user_data(self.balls.len() as u128);
        let (handle, _) = self.world.insert(body, collider);
        self.balls.push((ball, handle));
    }

    /// Adds an obstacle; returns its number.
    pub fn add_obstacle(&mut self, obstacle: Obstacle) -> usize {
        let number = self.obstacles.len();
        let collider = ColliderBuilder::new(obstacle.shape.clone())
            .friction(obstacle.friction)
            .restitution(0.0)
            .user_data(OBSTACLE | number as u128);
        let body = if obstacle.moves {
            let body = RigidBodyBuilder::kinematic_position_based().can_sleep(false);
            let (handle, _) = self.world.insert(body.pose(engine_pose(&obstacle.x_world)), collider);
            Some(handle)
        } else {
            let collider = collider.position(engine_pose(&obstacle.x_world));
            self.world.insert_collider(collider, None);
            None
        };
        let x_world = obstacle.x_world;
        self.obstacles.push((obstacle, body, x_world));
        number
    }

    /// Steps by a substep, in which moving obstacle `k` moves to the pose `x_world(k)`.
    pub fn step(&mut self, x_world: impl Fn(usize) -> Pose) {
        for (k, (obstacle, body, next)) in self.obstacles.iter_mut().enumerate() {
            if let Some(body) = body.and_then(|handle| self.world.bodies.get_mut(handle)) {
                obstacle.x_world = *next;
                *next = x_world(k);
                body.set_next_kinematic_position(engine_pose(next));
            }
        }
        for (ball, handle) in &mut self.balls {
            let Some(body) = self.world.bodies.get_mut(*handle) else { continue };
            (ball.p_world, ball.v_world) = (vec3(body.translation()), vec3(body.linvel()));
            // F = -c |v| v, with the speed at the start of the substep.
            body.set_linear_damping(ball.quadratic_drag * ball.v_world.norm() / ball.mass);
            body.reset_forces(false);
            if ball.force_world != Vec3::zeros() {
                body.add_force(vector(&ball.force_world), false);
            }
        }
        self.world.step();
        self.note_contacts();
    }

    /// Present motion of each fruit: index, position, velocity, spin.
    pub fn motions(&self) -> impl Iterator<Item = (usize, Vec3, Vec3, Vec3)> {
        self.balls.iter().filter_map(|(ball, handle)| {
            let body = self.world.bodies.get(*handle)?;
            Some((ball.fruit, vec3(body.translation()), vec3(body.linvel()), vec3(body.angvel())))
        })
    }

    /// Contacts that pressed in the last step, once for each fruit that takes part.
    pub fn pressing(&self) -> &[Pressing] {
        &self.pressing
    }

    fn note_contacts(&mut self) {
        self.pressing.clear();
        let dt = self.world.integration_parameters.dt;
        let who = |handle| self.world.colliders.get(handle).map(|c| c.user_data);
        for pair in self.world.narrow_phase.contact_pairs() {
            let (Some(one), Some(two)) = (who(pair.collider1), who(pair.collider2)) else { continue };
            for manifold in pair.manifolds() {
                if manifold.points.iter().all(|point| point.data.impulse <= 0.0) {
                    continue;
                }
                let n = vec3(manifold.data.normal);
                match (one & OBSTACLE == 0, two & OBSTACLE == 0) {
                    (true, true) => {
                        let (a, b) = (&self.balls[one as usize].0, &self.balls[two as usize].0);
                        let approach = (a.v_world - b.v_world).dot(&n);
                        let energy = impact_energy(a.mass, Some(b.mass), approach);
                        self.pressing.push(pressing(a, Partner::Fruit(b.fruit), energy));
                        self.pressing.push(pressing(b, Partner::Fruit(a.fruit), energy));
                    }
                    (true, false) => {
                        let (ball, other) = (&self.balls[one as usize].0, number(two));
                        self.pressing.push(self.against(ball, other, &n, dt));
                    }
                    (false, true) => {
                        let (ball, other) = (&self.balls[two as usize].0, number(one));
                        self.pressing.push(self.against(ball, other, &-n, dt));
                    }
                    (false, false) => {}
                }
            }
        }
    }

    /// A ball on an obstacle; the normal points from the ball to it.
    fn against(&self, ball: &Ball, number: usize, n_world: &Vec3, dt: f64) -> Pressing {
        let (obstacle, _, next) = &self.obstacles[number];
        let p_world = ball.p_world + n_world * ball.radius;
        let moved = transform(next, &inverse_transform(&obstacle.x_world, &p_world));
        let approach = (ball.v_world - (moved - p_world) / dt).dot(n_world);
        pressing(ball, obstacle.partner, impact_energy(ball.mass, None, approach))
    }
}

/// Marks colliders of obstacles in their user data, whose other bits are their number.
const OBSTACLE: u128 = 1 << 64;

fn number(user_data: u128) -> usize {
    (user_data & !OBSTACLE) as usize
}

fn pressing(ball: &Ball, partner: Partner, energy: f64) -> Pressing {
    Pressing { impact: Impact { fruit: ball.fruit, partner, energy }, z_world: ball.p_world.z }
}
