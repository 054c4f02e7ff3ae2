//! Frames whose motion is computed elsewhere, on a graphics device.
//!
//! The world is lent for some frames under commands that are known before ([`World::coming`]). [`World::take_back`] takes a frame with the motion that came of it: all rules of a frame, sensors, ruptures, stems, events,
//! loads, are applied here, as in [`World::step`]. What a device does not know is computed here: then [`World::outlook`] tells why.
//! After a calm frame ([`World::take_back_calm`]) only the robot is brought here; wood and fruit follow when they are needed. After one that is not calm all of them are brought here, so that what follows can be computed here instead.

use crate::World;
use crate::build::Parts;
use crate::event::Status;
use crate::groups;
use crate::state::State;
use crate::suction;
use orchard_geometry::{Pose, Rotation, Shape, Vec3, transform};
use orchard_multibody::{
    BodyId, ColliderId, ContactReport, Data, Model, Owner, SLOW_TURN, forward_kinematics,
    forward_kinematics_of,
};
use orchard_robot::{Climb, Command, RobotHandle, SetPoints, Suction, UnderLip};
use orchard_spec::Spec;
use orchard_spec::fault::FaultKind;
use orchard_treephys::wind::Weather;

/// Largest way by which two things come nearer to each other in a frame: this many times what their speed at the frame's start makes, and a way that they accelerate over \[m\]. Our own choice: an arm that
/// accelerates by 10 rad/s2 at a reach of 0.85 m comes 1.2 mm farther in a sixtieth of a second.
const FASTER: f64 = 1.2;
const SLACK: f64 = 0.002;

/// Reason for which a frame is computed here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stay {
    /// It stands still in quarantine.
    Stopped,
    /// Broken wood may touch the ground; or wood has broken beside posts or wires.
    Broken,
    /// The robot may touch uneven ground; or a fruit in its hand may touch uneven ground or another fruit off its stem.
    Near,
    /// A weight hangs on the arm.
    Weight,
    /// Wood or a stem turns so fast that its velocity products are not explicit (`docs/decisions/0010-fast-turns.md`).
    Fast,
}

impl Stay {
    /// All reasons.
    pub const ALL: [Self; 5] = [Self::Stopped, Self::Broken, Self::Near, Self::Weight, Self::Fast];

    /// Name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stopped => "stopped",
            Self::Broken => "broken_wood",
            Self::Near => "near_uneven_ground_or_fruit",
            Self::Weight => "weight_on_arm",
            Self::Fast => "fast_turns",
        }
    }
}

/// All that came of a frame besides the motion.
#[derive(Debug, Clone)]
pub struct Moved {
    /// Set points of the servos.
    pub set_points: SetPoints,
    /// Vacuum of the suction cup; the default without a cup.
    pub suction: Suction,
    /// Contacts of the last substep.
    pub contacts: Vec<ContactReport>,
    /// Impulse of the robot on live wood in the frame [N s].
    pub impulse: f64,
    /// Largest sum of its forces on live wood in a substep so far \[N\].
    pub peak_force: f64,
    /// Velocity of each fruit before the frame [m/s, world], if the world was behind then.
    pub v_fruit_before: Vec<Vec3>,
    /// Wear of each stem that bends, of zone and spur, after it; none on tethers.
    pub stem_wear: Vec<[f64; 2]>,
}

/// All that came of a calm frame besides the robot's motion.
#[derive(Debug, Clone, Copy)]
pub struct Calm {
    /// Set points of the servos.
    pub set_points: SetPoints,
    /// Impulse of the robot on live wood in the frame [N s].
    pub impulse: f64,
    /// Largest sum of its forces on live wood in a substep so far \[N\].
    pub peak_force: f64,
    /// Excess of the wood's load at its end ([`WoodLoad::excess`](crate::WoodLoad::excess)).
    pub excess: f64,
    /// Largest tension of a stem then \[N\].
    pub tension: f64,
}

/// Outlook on the next frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outlook {
    /// Reason for which the next frame is computed here; `None` if it may be lent.
    pub stays: Option<Stay>,
    /// Number of frames for which the world may be lent at once; at least 1.
    pub frames: usize,
    /// True if wood and fruit are needed after every one of the frames, so that it can be told where the next one is computed; else only after those in which something happens to them, and those that follow.
    pub is_watched: bool,
}

impl World {
    /// The commands that act in the next frames, after the delay of the world's commands, if it is given some now.
    pub fn coming<'a>(&'a self, commands: &'a [Command]) -> impl Iterator<Item = &'a Command> {
        self.state.commands.iter().chain(commands).take(commands.len())
    }

    /// Tells where the next frame under some commands, at least one, can be computed, and if all of them may be calm.
    ///
    /// # Panics
    /// There is no command.
    pub fn outlook(&mut self, commands: &[Command]) -> Outlook {
        let stays = self.stays();
        let sucks = self.sucks(commands);
        // Over uneven ground the chassis' height is foreseen for one frame, and what lies under a suction cup is seen for one.
        let most = if self.parts.ground.field().is_some() || sucks { 1 } else { commands.len() };
        // All of them, or the half; each time with the frame after them, for which the motion would be needed at their end. Fewer would be a round of their own each, in which few worlds take as long as many.
        let half = (most > 1).then_some(most.div_ceil(2));
        let far = [Some(most), half].into_iter().flatten().find(|frames| !self.may_meet(frames + 1));
        let (is_far, frames) = (far.is_some(), far.unwrap_or(most));
        let stays = stays.or((!is_far && self.may_meet(1)).then_some(Stay::Near));
        let (spec, parts, state) = (&*self.spec, &*self.parts, &self.state);
        let mut coming = (1..).map(|k| state.frame + k).zip(self.coming(&commands[..frames]));
        let is_calm = is_far
            && !sucks
            && spec.fault.is_none()
            && state.is_calm()
            && !state.fruit_may_be_met(spec, parts, frames + 1)
            && !coming.any(|(frame, _)| self.shutter.keeps(frame));
        Outlook { stays, frames, is_watched: !is_calm }
    }

    /// Set point of the chassis' height in the next frame, if the base goes on as now; zeros on level ground.
    pub fn climb(&self) -> Climb {
        let (spec, parts, data) = (&*self.spec, &*self.parts, &self.state.data);
        if parts.ground.field().is_none() {
            return Climb::default();
        }
        let twist = data.velocity(parts.handle.base);
        let x_world_base = parts.handle.x_world_base(data);
        // From the start of the first substep to that of the last one.
        let time = spec.sim.frame() - parts.settings.h;
        let heights = [0.0, time].map(|time| {
            let p_world = x_world_base.translation.vector + twist.linear * time;
            let turn = Rotation::from_scaled_axis(twist.angular * time);
            let place = Pose::from_parts(p_world.into(), turn * x_world_base.rotation);
            parts.ground.ride_height_ahead(&place, &twist.linear, twist.angular.z)
                - parts.x_world_odom.translation.z
        });
        let rate = if time > 0.0 { (heights[1] - heights[0]) / time } else { 0.0 };
        Climb { height: heights[1], rate }
    }

    /// True if in the next frames under some commands a suction cup may have a vacuum.
    fn sucks(&self, commands: &[Command]) -> bool {
        let is_open = || self.coming(commands).any(|command| command.vacuum > 0.0);
        self.parts.handle.cup.is_some() && (self.state.suction.vacuum != 0.0 || is_open())
    }

    /// Vacuum of the suction cup; the default without a cup.
    pub fn suction(&self) -> &Suction {
        &self.state.suction
    }

    /// Points of the suction cup's lip over leaves or pressed on; none if the cup has no vacuum and the commands ask for none. In a world that is behind ([`Self::is_behind`]) wood and fruit lie where they lay before the calm frames.
    pub fn under_lip(&self, commands: &[Command]) -> UnderLip {
        let State { suction, data, fruit, report, .. } = &self.state;
        if self.sucks(commands) {
            suction::under_lip(suction, &self.parts, data, fruit, report)
        } else {
            UnderLip::default()
        }
    }

    fn stays(&mut self) -> Option<Stay> {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        if state.status != Status::Running {
            return Some(Stay::Stopped);
        }
        if !state.rupture.breaks().is_empty()
            && (!parts.struts.is_empty() || state.debris_may_land(spec, parts, 1))
        {
            return Some(Stay::Broken);
        }
        if spec.fault.as_ref().is_some_and(|fault| fault.kind == FaultKind::WeightOnArm) {
            return Some(Stay::Weight);
        }
        // After calm frames nothing turned fast.
        (!state.is_behind && state.data.fastest_turn() * parts.settings.h > SLOW_TURN).then_some(Stay::Fast)
    }

    /// True if within some frames there may be a contact that a device does not know: of the robot with uneven ground, of a fruit in its hand with uneven ground or other fruit off their stems, or of broken wood with the ground, by the speeds of robot, fruit and wood.
    fn may_meet(&mut self, frames: usize) -> bool {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        if state.debris_may_land(spec, parts, frames) {
            return true;
        }
        let State { data, vicinity, speeds, groups_beside, fruit, .. } = state;
        if parts.ground.field().is_none() && !fruit.any_off_stem() {
            return false;
        }
        let data = &*data;
        let colliders = parts.model.colliders();
        let twist_at = |body: BodyId, p_world: &Vec3| {
            (data.point_velocity_world(body, p_world), data.velocity(body).angular)
        };
        let at_rest = (Vec3::zeros(), Vec3::zeros());
        let twist = |c: usize, p_world: &Vec3| match colliders[c].owner {
            Owner::World => at_rest,
            Owner::Body(body) => twist_at(body, p_world),
            Owner::Point(point) => (data.point_v_world[point.index()], Vec3::zeros()),
        };
        // Largest speed of a point of the ball about a collider, as it is seen where a place has a twist; none on the ground.
        let speed = |c: usize, seen: &dyn Fn(&Vec3) -> (Vec3, Vec3)| {
            let (centre, radius) = &parts.bounds[c];
            let p_world = match colliders[c].owner {
                Owner::World => return None,
                Owner::Body(body) => transform(data.x_world_body(body), centre),
                Owner::Point(point) => data.point_p_world[point.index()],
            };
            let ((v, w), (v_seen, w_seen)) = (twist(c, &p_world), seen(&p_world));
            Some((v - v_seen).norm() + (w - w_seen).norm() * radius)
        };
        speeds.clear();
        speeds.resize(colliders.len(), 0.0);
        for &c in &parts.robot_colliders {
            speeds[c] = speed(c, &|_| at_rest).unwrap_or(0.0);
        }
        let mut groups = &parts.unlent_groups;
        if fruit.any_off_stem() {
            groups_beside.clone_from(groups);
            for (point, id) in parts.fruit.points.iter().zip(&parts.fruit.colliders) {
                groups_beside[id.index()] = groups::beside_robot(data.groups[id.index()]);
                speeds[id.index()] = data.point_v_world[point.index()].norm();
            }
            groups = groups_beside;
        }
        // There is no force at a distance: what counts is the way. What the robot gains in speed grows with the square of the time.
        let time = spec.sim.frame() * frames as f64;
        let slack = SLACK * (frames * frames) as f64;
        let alone = |id: ColliderId| FASTER * speeds[id.index()] * time + slack;
        let together = |a: ColliderId, b: ColliderId| {
            let pairs = [(a.index(), b.index()), (b.index(), a.index())];
            let seen = pairs.into_iter().filter_map(|(c, from)| speed(c, &|p_world| twist(from, p_world)));
            (FASTER * seen.fold(f64::INFINITY, f64::min) * time + slack).min(alone(a) + alone(b))
        };
        vicinity.any(&parts.model, data, groups, alone, together)
    }

    /// Takes a frame that was lent, under a command that was given to the world. `write` writes coordinates, velocities, the motion of fruit that hang or are in the hand, and the servos' inputs of the last substep into the state. Returns true if at its end a fruit came off or came
    /// into the hand, or wood broke: then it moves in another way from now on.
    pub fn take_back(
        &mut self,
        command: &Command,
        write: impl FnOnce(&Model, &RobotHandle, &mut Data) -> Moved,
    ) -> bool {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        let command = state.begin(spec, parts, command);
        state.keep_velocities(parts);
        let bonds = |state: &State| {
            let count = |flags: &[bool]| flags.iter().filter(|flag| **flag).count();
            [count(&state.data.tethered), count(&state.data.point_carried), state.rupture.breaks().len()]
        };
        let before = bonds(state);
        let Moved { set_points, suction, contacts, impulse, peak_force, v_fruit_before, stem_wear } =
            write(&parts.model, &parts.handle, &mut state.data);
        if std::mem::take(&mut state.is_behind) {
            state.keep_fruit_velocities(v_fruit_before);
        }
        state.servos.restore(&set_points);
        state.suction = suction;
        state.fruit.set_wear(&stem_wear);
        state.report.contacts = contacts;
        if state.data.is_finite() {
            forward_kinematics(&parts.model, &mut state.data);
            state.load.add_frame(impulse, peak_force);
            state.rupture.pass(&parts.tree, &parts.model, &state.data, spec.sim.frame());
            state.end_lent_motion(spec, parts);
        }
        state.finish(spec, parts, &self.start, command.vacuum);
        self.end_of_frame();
        bonds(&self.state) != before
    }

    /// Takes a frame that was lent, under a command that was given to the world, and was calm: nothing broke or came off, no contact bore load at its end, no joint bore more than before. Wood and fruit stay behind ([`Self::is_behind`]). `write` writes coordinates and velocities of the robot
    /// and the servos' inputs of the last substep into the state. The report of contacts is empty then, without the open ones.
    pub fn take_back_calm(
        &mut self,
        command: &Command,
        write: impl FnOnce(&Model, &RobotHandle, &mut Data) -> Calm,
    ) {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        state.begin(spec, parts, command);
        let Calm { set_points, impulse, peak_force, excess, tension } =
            write(&parts.model, &parts.handle, &mut state.data);
        state.is_behind = true;
        state.servos.restore(&set_points);
        state.report.contacts.clear();
        forward_kinematics_of(&parts.model, &mut state.data, &parts.handle.bodies);
        state.load.add_frame(impulse, peak_force);
        state.count_frame(parts);
        state.load.end_calm_frame(excess, spec.sim.frame());
        state.fruit.end_calm_frame(tension);
        state.flight.end_frame(self.shutter, state.frame, &state.data);
        if !state.is_robot_plausible(parts, spec.sim.plausible_extent.si()) {
            self.judge_extent();
        }
    }

    /// True while wood and fruit are those of an earlier frame than the robot, after calm frames ([`Self::take_back_calm`]). Until [`Self::catch_up`] the world cannot be stepped or saved, and tells no truth about them.
    pub fn is_behind(&self) -> bool {
        self.state.is_behind
    }

    /// Brings wood and fruit up to the robot: `write` writes their motion into the state, and returns the wear of the stems ([`Moved::stem_wear`]).
    pub fn catch_up(&mut self, write: impl FnOnce(&Model, &mut Data) -> Vec<[f64; 2]>) {
        let (parts, state) = (&*self.parts, &mut self.state);
        let stem_wear = write(&parts.model, &mut state.data);
        state.fruit.set_wear(&stem_wear);
        forward_kinematics(&parts.model, &mut state.data);
        state.is_behind = false;
    }

    /// The wind of the world; `None` in still air.
    pub fn weather(&self) -> Option<&Weather> {
        self.parts.wind.as_ref()
    }

    /// Set points of the robot's servos.
    pub fn set_points(&self) -> &SetPoints {
        self.state.servos.set_points()
    }
}

#[cfg(test)]
#[path = "lent_tests.rs"]
mod tests;

impl State {
    /// True if within some frames the robot may come near to a fruit off its stem.
    fn fruit_may_be_met(&self, spec: &Spec, parts: &Parts, frames: usize) -> bool {
        let time = spec.sim.frame() * frames as f64;
        let way = |speed: f64| FASTER * speed * time + SLACK * (frames * frames) as f64;
        self.fruit.any_off_stem() && self.comes_near_fruit(spec, parts, way)
    }

    /// True if broken wood may touch the ground within some frames, by its height and speed.
    fn debris_may_land(&self, spec: &Spec, parts: &Parts, frames: usize) -> bool {
        if self.rupture.breaks().is_empty() {
            return false;
        }
        let time = spec.sim.frame() * frames as f64;
        let way = |speed: f64| FASTER * speed * time + SLACK * (frames * frames) as f64;
        let limbs = parts.tree.bodies.iter().zip(&parts.tree.colliders).enumerate();
        limbs.filter(|(segment, _)| self.rupture.is_debris(*segment)).any(|(_, (&body, collider))| {
            let link = parts.model.body(body);
            let p_tip = link.inertia.p_com * 2.0;
            let radius = match parts.model.collider(*collider).shape {
                Shape::Capsule { radius, .. } => radius,
                _ => 0.0,
            };
            [Vec3::zeros(), p_tip].into_iter().any(|p_body| {
                let p_world = transform(self.data.x_world_body(body), &p_body);
                let speed = self.data.point_velocity_world(body, &p_world).norm();
                let way = way(speed) + radius + parts.settings.contact_margin;
                p_world.z - parts.ground.highest_near(&p_world, way) <= way
            })
        })
    }
}
