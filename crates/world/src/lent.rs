//! Frames whose motion is computed elsewhere, on a graphics device.
//!
//! The world is lent for some frames under commands that are known before ([`World::coming`]). [`World::take_back`] takes a frame with the motion that came of it: all rules of a frame, sensors, ruptures, stems, events,
//! loads, are applied here, as in [`World::step`]. What a device does not know is computed here: then [`World::outlook`] tells why.
//! After a calm frame ([`World::take_back_calm`]) only the robot is brought here; wood and fruit follow when they are needed. A frame that is not calm is the last one that is lent.

use crate::World;
use crate::event::Status;
use crate::groups;
use crate::state::State;
use orchard_fruit::Phase;
use orchard_geometry::{Vec3, transform};
use orchard_multibody::{
    ColliderId, ContactReport, Data, Model, Owner, forward_kinematics, forward_kinematics_of,
};
use orchard_robot::{Command, RobotHandle, SetPoints};
use orchard_spec::fault::FaultKind;
use orchard_treephys::wind::Weather;

/// Largest way of a point of the robot in a frame: this many times what its speed at the frame's start makes, and a way that it accelerates over \[m\]. Our own choice: an arm that
/// accelerates by 10 rad/s2 at a reach of 0.85 m comes 1.2 mm farther in a sixtieth of a second.
const FASTER: f64 = 1.2;
const SLACK: f64 = 0.002;

/// Reason for which a frame is computed here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stay {
    /// It stands still in quarantine.
    Stopped,
    /// Wood has broken.
    Broken,
    /// A fruit off its stem moves, or may be moved, and is not in the hand.
    Loose,
    /// The valve of the suction cup is open, or its vacuum is not gone.
    Cup,
    /// The robot may touch the ground, posts or wires, or itself; or a fruit in its hand may touch one of the former, or other fruit.
    Near,
    /// A weight hangs on the arm.
    Weight,
}

impl Stay {
    /// All reasons.
    pub const ALL: [Self; 6] =
        [Self::Stopped, Self::Broken, Self::Loose, Self::Cup, Self::Near, Self::Weight];

    /// Name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stopped => "stopped",
            Self::Broken => "broken_wood",
            Self::Loose => "loose_fruit",
            Self::Cup => "suction",
            Self::Near => "near_ground_or_itself",
            Self::Weight => "weight_on_arm",
        }
    }
}

/// Time until the robot may touch itself, the ground, posts or wires, or a fruit in its hand all but the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Nearness {
    /// In the next frame.
    Now,
    /// In the one after it.
    Soon,
    /// Later than that, or never: not in so many frames and the one after them.
    Far(usize),
}

/// All that came of a frame besides the motion.
#[derive(Debug, Clone)]
pub struct Moved {
    /// Set points of the servos.
    pub set_points: SetPoints,
    /// Contacts of the last substep.
    pub contacts: Vec<ContactReport>,
    /// Impulse of the robot on live wood in the frame [N s].
    pub impulse: f64,
    /// Largest sum of its forces on live wood in a substep so far \[N\].
    pub peak_force: f64,
    /// Velocity of each fruit before the frame [m/s, world], if the world was behind then.
    pub v_fruit_before: Vec<Vec3>,
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
    /// Number of frames for which the world may be lent if all but the last are calm; at least 1.
    pub frames: usize,
    /// True if the motion of wood and fruit is needed at their end, whatever happens in them.
    pub is_whole: bool,
}

impl World {
    /// The commands that act in the next frames, after the delay of the world's commands, if it is given some now.
    pub fn coming<'a>(&'a self, commands: &'a [Command]) -> impl Iterator<Item = &'a Command> {
        self.state.commands.iter().chain(commands).take(commands.len())
    }

    /// Tells where the next frames under some commands, at least one, can be computed, and if they may be calm.
    ///
    /// # Panics
    /// There is no command.
    pub fn outlook(&mut self, commands: &[Command]) -> Outlook {
        let nearness = self.nearness(commands.len());
        let stays = self.stays(&commands[0]).or((nearness == Nearness::Now).then_some(Stay::Near));
        let (spec, state) = (&*self.spec, &self.state);
        let most = match nearness {
            Nearness::Far(frames) if spec.fault.is_none() && state.is_calm() => frames,
            _ => return Outlook { stays, frames: 1, is_whole: true },
        };
        let has_cup = self.parts.handle.cup.is_some();
        let opens = self.coming(commands).skip(1).position(|command| has_cup && opens_valve(command));
        let most = opens.map_or(most, |calm| calm + 1);
        let kept = (1..=most).find(|&frame| self.shutter.keeps(state.frame + frame as u32));
        Outlook { stays, frames: kept.unwrap_or(most), is_whole: kept.is_some() }
    }

    fn stays(&mut self, command: &Command) -> Option<Stay> {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        if state.status != Status::Running {
            return Some(Stay::Stopped);
        }
        if !state.rupture.breaks().is_empty() {
            return Some(Stay::Broken);
        }
        if spec.fault.as_ref().is_some_and(|fault| fault.kind == FaultKind::WeightOnArm) {
            return Some(Stay::Weight);
        }
        if state.fruit.any_off_stem() {
            state.wake(spec, parts, spec.sim.frame());
            if (0..parts.fruit.len()).any(|i| state.fruit.phase(i) == Phase::Free) {
                return Some(Stay::Loose);
            }
        }
        let is_open = opens_valve(state.commands.front().unwrap_or(command)) || state.suction.vacuum != 0.0;
        (parts.handle.cup.is_some() && is_open).then_some(Stay::Cup)
    }

    /// Finds when, looking some frames ahead, the robot may touch itself, the ground, posts or wires, and a fruit in its hand these or other fruit, from the speeds of robot and fruit.
    fn nearness(&mut self, most: usize) -> Nearness {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        let State { data, vicinity, speeds, groups_beside, fruit, .. } = state;
        let (data, base) = (&*data, parts.handle.base);
        let is_alone = parts.struts.is_empty();
        speeds.clear();
        speeds.resize(parts.model.colliders().len(), 0.0);
        for &c in &parts.robot_colliders {
            let Owner::Body(body) = parts.model.colliders()[c].owner else { continue };
            let (centre, radius) = &parts.bounds[c];
            let p_world = transform(data.x_world_body(body), centre);
            let mut v_world = data.point_velocity_world(body, &p_world);
            let mut w_world = data.velocity(body).angular;
            if is_alone {
                // The base carries all of the robot along, and drives over level ground.
                v_world -= data.point_velocity_world(base, &p_world);
                w_world -= data.velocity(base).angular;
            }
            speeds[c] = v_world.norm() + w_world.norm() * radius;
        }
        let mut groups = &parts.groups_alone;
        if fruit.any_off_stem() {
            groups_beside.clone_from(groups);
            for (point, id) in parts.fruit.points.iter().zip(&parts.fruit.colliders) {
                groups_beside[id.index()] = groups::beside_robot(data.groups[id.index()]);
                speeds[id.index()] = data.point_v_world[point.index()].norm();
            }
            groups = groups_beside;
        }
        // Two links may approach each other, and there is no force at a distance. What the robot gains in speed grows with the square of the time.
        let mut is_near = |frames: f64| {
            let way = |id: ColliderId| {
                FASTER * speeds[id.index()] * spec.sim.frame() * frames + SLACK * frames * frames
            };
            vicinity.any(&parts.model, data, groups, way)
        };
        if !is_near(most as f64 + 1.0) {
            Nearness::Far(most)
        } else if !is_near(2.0) {
            Nearness::Far(1)
        } else if is_near(1.0) {
            Nearness::Now
        } else {
            Nearness::Soon
        }
    }

    /// Takes a frame that was lent, under a command that was given to the world. `write` writes coordinates, velocities, the motion of fruit that hang or are in the hand, and the servos' inputs of the last substep into the state. Returns true if a fruit came off or came
    /// into the hand at its end: then it moves in another way from now on.
    pub fn take_back(
        &mut self,
        command: &Command,
        write: impl FnOnce(&Model, &RobotHandle, &mut Data) -> Moved,
    ) -> bool {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        let command = state.begin(spec, parts, command);
        state.keep_velocities(parts);
        let off_stem = |data: &Data| {
            let count = |flags: &[bool]| flags.iter().filter(|flag| **flag).count();
            [count(&data.tethered), count(&data.point_carried)]
        };
        let before = off_stem(&state.data);
        let Moved { set_points, contacts, impulse, peak_force, v_fruit_before } =
            write(&parts.model, &parts.handle, &mut state.data);
        if std::mem::take(&mut state.is_behind) {
            state.keep_fruit_velocities(v_fruit_before);
        }
        state.servos.restore(&set_points);
        state.report.contacts = contacts;
        if state.data.is_finite() {
            forward_kinematics(&parts.model, &mut state.data);
            state.load.add_frame(impulse, peak_force);
            state.end_substep(parts);
        }
        state.finish(spec, parts, &self.start, command.vacuum);
        self.end_of_frame();
        off_stem(&self.state.data) != before
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

    /// Brings wood and fruit up to the robot: `write` writes their motion into the state.
    pub fn catch_up(&mut self, write: impl FnOnce(&Model, &mut Data)) {
        let (parts, state) = (&*self.parts, &mut self.state);
        write(&parts.model, &mut state.data);
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

/// True if a command lets air out of a suction cup; one that is not a number may.
fn opens_valve(command: &Command) -> bool {
    command.vacuum > 0.0 || command.vacuum.is_nan()
}

#[cfg(test)]
#[path = "lent_tests.rs"]
mod tests;
