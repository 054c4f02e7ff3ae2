//! Loose fruit in a world: hand-over to the rigid-body engine, sleep and waking, impacts.
//!
//! Off its stem a fruit is moved by the coupled solve of the model while the hand is at it, then by the rigid-body engine
//! of the `fruit` crate, until it sleeps; [`orchard_fruit::life`] has the rules. The engine lasts one frame: [`Loose`] is no
//! part of a world's state.

mod mover;

use super::State;
use crate::build::Parts;
use crate::touch::{FruitTouch, Part};
pub(super) use mover::Within;
use mover::{Before, Mover};
use orchard_fruit::{
    Engine, FruitLives, Island, Obstacle, Partner, Phase, Pressing, RestRule, Resting, Shapes, Support,
    Touch, WakeRule, impact_energy,
};
use orchard_geometry::{Aabb, Pose, Shape, Vec3, inverse_transform, transform};
use orchard_multibody::{BodyId, Data, Owner};
use orchard_robot::RobotHandle;
use orchard_spec::Spec;

/// Scratch of a frame.
#[derive(Debug, Default)]
pub(crate) struct Loose {
    engine: Option<Engine>,
    /// Mover of each obstacle of the engine.
    movers: Vec<Mover>,
    /// Motion before the substep, or before the frame if it was lent.
    before: Before,
    /// Contacts of loose fruit in the latest substep.
    last: Vec<Pressing>,
    /// Island of each fruit, and the normal force of the fingers on it.
    island: Vec<usize>,
    squeeze: Vec<[f64; 2]>,
}

impl Clone for Loose {
    /// Scratch: worlds are cloned between frames.
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// True if the surface of a robot's collider is nearer to a point than `reach` \[m\].
fn is_near(parts: &Parts, data: &Data, collider: usize, p_world: &Vec3, reach: f64) -> bool {
    let Some(body) = owner_body(parts, collider) else { return false };
    let (centre, radius) = &parts.bounds[collider];
    let p_owner = inverse_transform(data.x_world_body(body), p_world);
    let far = radius + reach;
    if (p_owner - centre).norm_squared() > far * far {
        return false;
    }
    let collider = &parts.model.colliders()[collider];
    collider.shape.signed_distance(&inverse_transform(&collider.x_owner_shape, &p_owner)) < reach
}

/// Body that owns a collider.
fn owner_body(parts: &Parts, collider: usize) -> Option<BodyId> {
    match parts.model.colliders()[collider].owner {
        Owner::Body(body) => Some(body),
        Owner::World | Owner::Point(_) => None,
    }
}

/// Collision partner of a fruit that a part is; `None` for wood, which loose fruit does not meet.
fn partner(part: Part) -> Option<Partner> {
    match part {
        Part::Ground => Some(Partner::Ground),
        Part::Scenery => Some(Partner::Scenery),
        Part::Bucket => Some(Partner::Bucket),
        Part::Chassis => Some(Partner::Chassis),
        Part::Arm => Some(Partner::Arm),
        Part::Hand | Part::Finger(_) | Part::Cup(_) => Some(Partner::Hand),
        Part::Fruit(i) => Some(Partner::Fruit(i)),
        Part::Wood => None,
    }
}

fn is_awake(phase: Phase) -> bool {
    matches!(phase, Phase::InHand | Phase::Free)
}

/// Velocity of the base's points \[m/s\].
fn base_velocity(data: &Data, handle: &RobotHandle, p_world: &Vec3) -> Vec3 {
    data.point_velocity_world(handle.base, p_world)
}

impl State {
    /// Begins a frame: wakes fruit that are about to be moved, and fills an engine with the free ones.
    pub(crate) fn begin_loose(&mut self, spec: &Spec, parts: &Parts) {
        self.loose.engine = None;
        self.loose.last.clear();
        if !self.fruit.any_off_stem() {
            return;
        }
        let frame_time = spec.sim.frame();
        self.wake(spec, parts, frame_time);
        if self.fruit.any_free() {
            self.fill_engine(spec, parts, frame_time);
        }
    }

    /// Wakes sleeping fruit whose base drives, that an awake fruit or the moving arm can reach within this frame, or that
    /// touches such a one.
    fn wake(&mut self, spec: &Spec, parts: &Parts, frame_time: f64) {
        let State { data, fruit: lives, .. } = self;
        let set = &parts.fruit;
        let rule = WakeRule {
            speed: spec.sim.sleep_speed.si(),
            touching_gap: spec.sim.loose.touching_gap.si(),
            frame_time,
            fall: 0.5 * spec.sim.gravity.si() * frame_time * frame_time,
        };
        let p_world = |data: &Data, i: usize| data.point_p_world[set.points[i].index()];
        let v_world = |data: &Data, i: usize| data.point_v_world[set.points[i].index()];
        let mut woken = Vec::new();
        for i in 0..set.len() {
            let Phase::Asleep(resting) = lives.phase(i) else { continue };
            let (p, radius) = (p_world(data, i), set.fruit[i].radius);
            let on_base = matches!(resting, Resting::Base(_));
            let v_base = base_velocity(data, &parts.handle, &p);
            let v_carrier = if on_base { v_base } else { Vec3::zeros() };
            // Distance within which something that moves with a velocity wakes it.
            let reach = |v: &Vec3| rule.reach(radius, (v - v_carrier).norm());
            let shaken = on_base && rule.is_shaken(v_base.norm());
            let by_fruit = || {
                (0..set.len()).filter(|&k| is_awake(lives.phase(k))).any(|k| {
                    let distance = (p_world(data, k) - p).norm() - set.fruit[k].radius;
                    reach(&v_world(data, k)).is_some_and(|reach| distance < reach)
                })
            };
            let by_robot = || {
                parts.robot_colliders.iter().any(|&c| {
                    let Some(body) = owner_body(parts, c) else { return false };
                    let reach = reach(&data.point_velocity_world(body, &p));
                    reach.is_some_and(|reach| is_near(parts, data, c, &p, reach))
                })
            };
            if shaken || by_fruit() || by_robot() {
                woken.push(i);
            }
        }
        while let Some(i) = woken.pop() {
            if !matches!(lives.phase(i), Phase::Asleep(_)) {
                continue;
            }
            lives.wake(i);
            let p = p_world(data, i);
            woken.extend((0..set.len()).filter(|&k| {
                matches!(lives.phase(k), Phase::Asleep(_))
                    && rule.touches(set.fruit[i].radius, set.fruit[k].radius, (p_world(data, k) - p).norm())
            }));
        }
    }

    /// Builds an engine with the free fruit and all bodies that they can reach within this frame.
    fn fill_engine(&mut self, spec: &Spec, parts: &Parts, frame_time: f64) {
        let State { data, fruit: lives, loose, .. } = self;
        let (set, model) = (&parts.fruit, &parts.model);
        let mut engine = Engine::new(parts.settings.h, &parts.settings.gravity, &spec.sim.loose);
        let fall = spec.sim.gravity.si() * frame_time;
        let margin = spec.sim.contact_margin.si();
        let mut reaches: Vec<(Vec3, f64)> = Vec::new();
        for i in (0..set.len()).filter(|&i| lives.phase(i) == Phase::Free) {
            let mut ball = set.ball(data, i);
            if let Some(field) = parts.ground.field() {
                // The engine's terrain is a surface without inside: a fruit that was pressed through it is lifted back.
                let depth = field.signed_distance(&ball.p_world).min(0.0);
                ball.p_world.z -= depth;
            }
            let travel = (ball.v_world.norm() + fall) * frame_time;
            reaches.push((ball.p_world, ball.radius + travel + margin));
            engine.add_ball(ball);
        }
        loose.movers.clear();
        let mut add = |engine: &mut Engine, obstacle: Option<Obstacle>, mover: Mover| {
            if let Some(obstacle) = obstacle {
                engine.add_obstacle(obstacle);
                loose.movers.push(mover);
            }
        };
        for (c, collider) in model.colliders().iter().enumerate() {
            let part = parts.colliders[c];
            let Some(partner) = partner(part) else { continue };
            let body = owner_body(parts, c);
            let fruit = if let Part::Fruit(i) = part { Some(i) } else { None };
            if fruit.is_some_and(|i| matches!(lives.phase(i), Phase::Hanging | Phase::Free)) {
                continue;
            }
            let (centre_owner, radius) = &parts.bounds[c];
            let (p_centre, speed) = match (body, fruit) {
                (Some(body), _) => {
                    let twist = data.velocity(body);
                    let turning = twist.angular.norm() * (centre_owner.norm() + radius);
                    (transform(data.x_world_body(body), centre_owner), twist.linear.norm() + turning)
                }
                (None, Some(i)) => {
                    let point = set.points[i].index();
                    (data.point_p_world[point], data.point_v_world[point].norm() + fall)
                }
                (None, None) => (*centre_owner, 0.0),
            };
            let extent = radius + speed * frame_time;
            let is_met = |(p, reach): &(Vec3, f64)| (p - p_centre).norm() < reach + extent;
            if !reaches.iter().any(is_met) {
                continue;
            }
            let friction = collider.friction;
            match (fruit, body, &collider.shape) {
                (Some(i), ..) => {
                    let p = data.point_p_world[set.points[i].index()];
                    let ball = Obstacle::ball(i, set.fruit[i].radius, friction, &p);
                    add(&mut engine, Some(ball), Mover::Fruit(i));
                }
                (None, None, Shape::HeightField(field)) => {
                    let under = |(p, reach): &(Vec3, f64)| Aabb { min: *p, max: *p }.grown(*reach);
                    let under: Vec<Aabb> = reaches.iter().map(under).collect();
                    add(&mut engine, Shapes::terrain(field, &under, friction), Mover::Still);
                }
                (None, body, _) => {
                    let moves = body.is_some();
                    let x_world = Mover::Collider(c).x_world(parts, data);
                    let obstacle = parts.shapes.obstacle(c, partner, friction, x_world, moves);
                    add(&mut engine, obstacle, if moves { Mover::Collider(c) } else { Mover::Still });
                }
            }
        }
        loose.engine = Some(engine);
    }

    /// Keeps the motion before a substep of the model, or a frame that is lent: for the energies of impacts, and for what
    /// moves free fruit within the frame.
    pub(crate) fn keep_velocities(&mut self, parts: &Parts) {
        self.loose.before.keep(parts, &self.data);
    }

    /// Stores the velocities of hanging fruit before a frame, where those of the state are of an earlier one.
    pub(crate) fn keep_fruit_velocities(&mut self, v_world: Vec<Vec3>) {
        for (i, ((before, _), v)) in self.loose.before.fruit.iter_mut().zip(v_world).enumerate() {
            if self.fruit.phase(i) == Phase::Hanging {
                *before = v;
            }
        }
    }

    /// True if a part of the robot that goes a `way` by its speed \[m\] may come so near to a fruit off its stem that it wakes it or can grasp it.
    pub(crate) fn comes_near_fruit(&self, spec: &Spec, parts: &Parts, way: impl Fn(f64) -> f64) -> bool {
        let (set, data) = (&parts.fruit, &self.data);
        let gap = spec.fruit.grasp_range.si().max(spec.sim.loose.touching_gap.si());
        let off_stem = (0..set.len()).filter(|&i| self.fruit.phase(i) != Phase::Hanging);
        off_stem.map(|i| (set.fruit[i].radius, data.point_p_world[set.points[i].index()])).any(
            |(radius, p)| {
                parts.robot_colliders.iter().any(|&c| {
                    let Some(body) = owner_body(parts, c) else { return false };
                    let speed = data.point_velocity_world(body, &p).norm();
                    is_near(parts, data, c, &p, radius + gap + way(speed))
                })
            },
        )
    }

    /// Moves free fruit after a substep of the model, and notes the contacts of every fruit.
    pub(crate) fn step_loose(&mut self, parts: &Parts) {
        let State { data, fruit: lives, loose, .. } = self;
        loose.last.clear();
        note_model_contacts(parts, &self.report.contacts, data, lives, loose);
        self.step_engine(parts, |mover, data, _| mover.x_world(parts, data));
    }

    /// Moves free fruit to the end of a substep within a frame that was lent.
    pub(crate) fn step_loose_within(&mut self, parts: &Parts, within: Within) {
        self.loose.last.clear();
        self.step_engine(parts, |mover, data, before| mover.x_world_within(parts, data, before, within));
    }

    /// Moves free fruit beside obstacles that have moved to some poses, and notes what fruit touch.
    fn step_engine(&mut self, parts: &Parts, x_world: impl Fn(Mover, &Data, &Before) -> Pose) {
        let State { data, fruit: lives, loose, touched, .. } = self;
        if let Some(engine) = &mut loose.engine {
            engine.step(|k| x_world(loose.movers[k], data, &loose.before));
            for (i, p_world, v_world, w_world) in engine.motions() {
                let point = parts.fruit.points[i].index();
                data.point_p_world[point] = p_world;
                data.point_v_world[point] = v_world;
                data.point_w_world[point] = w_world;
            }
            for &Pressing { impact, z_world } in engine.pressing() {
                lives.strike(impact.fruit, impact.partner, impact.energy, z_world);
                loose.last.push(Pressing { impact, z_world });
            }
        }
        for t in touched.iter_mut() {
            t.on_base = false;
        }
        for pressing in &loose.last {
            let t = &mut touched[pressing.impact.fruit];
            t.ground |= pressing.impact.partner == Partner::Ground;
            t.on_base |= matches!(pressing.impact.partner, Partner::Bucket | Partner::Chassis);
        }
    }

    /// Collects the contacts of each fruit at the end of a frame, for its rules.
    pub(crate) fn end_touches(&mut self, spec: &Spec, parts: &Parts, x_world_base: &Pose) {
        let State { data, fruit: lives, touches, touched, .. } = self;
        for (i, FruitTouch { ground, fingers, hand, cup, .. }) in touches.iter().copied().enumerate() {
            let p_world = data.point_p_world[parts.fruit.points[i].index()];
            let in_bucket = parts.handle.bucket.contains(&inverse_transform(x_world_base, &p_world));
            let finger = fingers[0] || fingers[1] || cup;
            let off_stem = lives.phase(i) != Phase::Hanging;
            touched[i] = Touch {
                ground: ground || touched[i].ground,
                finger,
                hand: finger || hand,
                graspable: off_stem && is_graspable(spec, parts, data, i, &p_world),
                in_bucket,
                on_base: in_bucket || touched[i].on_base,
            };
        }
    }

    /// Puts islands of quiet fruit to sleep after the rules, and drops the engine.
    pub(crate) fn end_loose(&mut self, spec: &Spec, parts: &Parts, rest: RestRule, x_world_base: &Pose) {
        self.touched.fill(Touch::default());
        if self.loose.engine.take().is_none() {
            return;
        }
        self.stop_at_border(parts, spec.sim.plausible_extent.si());
        let State { data, fruit: lives, loose, .. } = self;
        let (set, speed) = (&parts.fruit, spec.sim.sleep_speed.si());
        let Loose { island, last, .. } = loose;
        island.clear();
        island.extend(0..set.len());
        let mut changed = true;
        while std::mem::take(&mut changed) {
            for pressing in last.iter() {
                if let Partner::Fruit(other) = pressing.impact.partner {
                    let (a, b) = (island[pressing.impact.fruit], island[other]);
                    (island[pressing.impact.fruit], island[other]) = (a.min(b), a.min(b));
                    changed |= a != b;
                }
            }
        }
        for first in 0..set.len() {
            let members = || (0..set.len()).filter(|&i| island[i] == first);
            if !members().any(|i| lives.phase(i) == Phase::Free) {
                continue;
            }
            let p_world = |i: usize| data.point_p_world[set.points[i].index()];
            let touches = |wanted: &[Partner]| {
                last.iter().any(|p| island[p.impact.fruit] == first && wanted.contains(&p.impact.partner))
            };
            let in_bucket = |i| parts.handle.bucket.contains(&inverse_transform(x_world_base, &p_world(i)));
            let on_base = touches(&[Partner::Bucket, Partner::Chassis])
                || members().any(in_bucket)
                || members().any(|i| matches!(lives.phase(i), Phase::Asleep(Resting::Base(_))));
            let still = members().all(|i| match lives.phase(i) {
                Phase::Free => lives.is_quiet(i, rest),
                Phase::Asleep(_) => true,
                Phase::Hanging | Phase::InHand => false,
            });
            let base_drives = members().any(|i| {
                let v = base_velocity(data, &parts.handle, &p_world(i)).norm();
                v > speed
            });
            let support = Island {
                is_still: still,
                touches_arm: touches(&[Partner::Arm, Partner::Hand]),
                is_on_base: on_base,
                is_on_ground: touches(&[Partner::Ground, Partner::Scenery]),
                base_drives,
            }
            .support();
            let Some(support) = support else { continue };
            for i in (0..set.len()).filter(|&i| island[i] == first) {
                if lives.phase(i) == Phase::Free {
                    let p = p_world(i);
                    lives.sleep(
                        i,
                        match support {
                            Support::Base => Resting::Base(inverse_transform(x_world_base, &p)),
                            Support::Ground => Resting::Ground(p),
                        },
                    );
                    let point = set.points[i].index();
                    data.point_v_world[point] = Vec3::zeros();
                    data.point_w_world[point] = Vec3::zeros();
                }
            }
        }
    }

    /// Puts free fruit to rest that roll out of the plausible box by its sides, where the ground ends.
    fn stop_at_border(&mut self, parts: &Parts, extent: f64) {
        let State { data, fruit: lives, .. } = self;
        for (i, point) in parts.fruit.points.iter().map(|point| point.index()).enumerate() {
            let p = data.point_p_world[point];
            // One whose motion is not finite stops the world.
            if lives.phase(i) == Phase::Free && p.xy().amax() >= extent && data.is_finite() {
                let p = Vec3::new(p.x.clamp(-extent, extent), p.y.clamp(-extent, extent), p.z);
                lives.sleep(i, Resting::Ground(p));
                data.point_p_world[point] = p;
                data.point_v_world[point] = Vec3::zeros();
                data.point_w_world[point] = Vec3::zeros();
            }
        }
    }
}

/// True if both fingers, or one of them and the hand, or the lip of the cup are near enough to a fruit to hold it.
fn is_graspable(spec: &Spec, parts: &Parts, data: &Data, fruit: usize, p_world: &Vec3) -> bool {
    let reach = parts.fruit.fruit[fruit].radius + spec.fruit.grasp_range.si();
    let near = |wanted: &dyn Fn(Part) -> bool| {
        let colliders = parts.robot_colliders.iter().filter(|&&c| wanted(parts.colliders[c]));
        colliders.into_iter().any(|&c| is_near(parts, data, c, p_world, reach))
    };
    let fingers = [near(&|part| part == Part::Finger(0)), near(&|part| part == Part::Finger(1))];
    match fingers {
        [true, true] => true,
        [false, false] => near(&|part| matches!(part, Part::Cup(_))),
        _ => near(&|part| part == Part::Hand),
    }
}

/// Impacts and squeezes among the contacts of the model.
fn note_model_contacts(
    parts: &Parts,
    contacts: &[orchard_multibody::ContactReport],
    data: &Data,
    lives: &mut FruitLives,
    loose: &mut Loose,
) {
    let set = &parts.fruit;
    loose.squeeze.clear();
    for contact in contacts {
        let force = contact.force_world.dot(&contact.n_world);
        let (a, b) = (parts.colliders[contact.a.index()], parts.colliders[contact.b.index()]);
        if force == 0.0 || !matches!((a, b), (Part::Fruit(_), _) | (_, Part::Fruit(_))) {
            continue;
        }
        let velocity = |part: Part, collider: usize| match part {
            Part::Fruit(i) => loose.before.fruit[i].0,
            _ => loose.before.v_world(parts, owner_body(parts, collider), &contact.p_world),
        };
        let approach =
            (velocity(b, contact.b.index()) - velocity(a, contact.a.index())).dot(&contact.n_world);
        for (one, other) in [(a, b), (b, a)] {
            let (Part::Fruit(i), Some(partner)) = (one, partner(other)) else { continue };
            if lives.phase(i) == Phase::Free {
                // The engine reports its contacts.
                continue;
            }
            let other_mass = if let Part::Fruit(k) = other { Some(set.fruit[k].mass) } else { None };
            let energy = impact_energy(set.fruit[i].mass, other_mass, approach);
            let z_world = data.point_p_world[set.points[i].index()].z;
            lives.strike(i, partner, energy, z_world);
            let impact = orchard_fruit::Impact { fruit: i, partner, energy };
            loose.last.push(Pressing { impact, z_world });
            if let Part::Finger(_) | Part::Cup(_) = other {
                let side = if let Part::Finger(side) = other { side } else { 0 };
                if loose.squeeze.is_empty() {
                    loose.squeeze.resize(set.len(), [0.0; 2]);
                }
                loose.squeeze[i][side] += force;
            }
        }
    }
    for (i, forces) in loose.squeeze.iter().enumerate() {
        lives.squeeze(i, forces[0].max(forces[1]));
    }
}
