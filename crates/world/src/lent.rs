//! Frames whose motion is computed elsewhere, on a graphics device.
//!
//! The world is lent for a frame: [`World::lend`] begins the frame, [`World::take_back`] ends it with the motion that came of it. All rules of a frame, sensors, ruptures, stems, events,
//! loads, are applied here, as in [`World::step`]. What a device does not know is computed here: then [`World::stays`] tells why.

use crate::World;
use crate::event::Status;
use orchard_fruit::Phase;
use orchard_geometry::transform;
use orchard_multibody::{ContactReport, Data, Groups, Model, Owner, forward_kinematics};
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
    /// A fruit off its stem moves, or may be moved.
    Loose,
    /// The valve of the suction cup is open, or its vacuum is not gone.
    Cup,
    /// The robot may touch the ground, posts or wires, or itself.
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

/// A frame under way elsewhere.
#[derive(Debug, Clone, Copy)]
pub struct Lent {
    /// The command that acts in it, after the delay of the world's commands.
    pub command: Command,
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
}

impl World {
    /// Tells why the next frame under a command is computed here; `None` if it may be lent.
    pub fn stays(&mut self, command: &Command) -> Option<Stay> {
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
            let is_awake = |i| matches!(state.fruit.phase(i), Phase::InHand | Phase::Free);
            if (0..parts.fruit.len()).any(is_awake) {
                return Some(Stay::Loose);
            }
        }
        let valve = state.commands.front().unwrap_or(command).vacuum;
        if parts.handle.cup.is_some() && (valve > 0.0 || valve.is_nan() || state.suction.vacuum != 0.0) {
            return Some(Stay::Cup);
        }
        self.is_near().then_some(Stay::Near)
    }

    /// True if the robot may touch something but tree and fruit within a frame.
    fn is_near(&mut self) -> bool {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        let (data, base) = (&state.data, parts.handle.base);
        let is_alone = parts.struts.is_empty();
        let mut fastest = 0.0_f64;
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
            fastest = fastest.max(v_world.norm() + w_world.norm() * radius);
        }
        // Two links may approach each other.
        let margin = parts.settings.contact_margin + 2.0 * (FASTER * fastest * spec.sim.frame() + SLACK);
        let mut groups = data.groups.clone();
        for id in parts.tree.colliders.iter().chain(&parts.fruit.colliders) {
            groups[id.index()] = Groups::NONE;
        }
        state.vicinity.any(&parts.model, data, &groups, margin)
    }

    /// Begins a frame elsewhere under a command.
    pub fn lend(&mut self, command: &Command) -> Lent {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        let command = state.begin(spec, parts, command);
        state.keep_velocities(parts);
        Lent { command }
    }

    /// Ends a frame that was lent. `write` writes coordinates, velocities, the motion of hanging fruit, and the servos' inputs of the last substep into the state.
    pub fn take_back(&mut self, lent: &Lent, write: impl FnOnce(&Model, &RobotHandle, &mut Data) -> Moved) {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        let Moved { set_points, contacts, impulse, peak_force } =
            write(&parts.model, &parts.handle, &mut state.data);
        state.servos.restore(&set_points);
        state.report.contacts = contacts;
        if state.data.is_finite() {
            forward_kinematics(&parts.model, &mut state.data);
            state.load.add_frame(impulse, peak_force);
            state.end_substep(parts);
        }
        state.finish(spec, parts, &self.start, lent.command.vacuum);
        self.end_of_frame();
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
