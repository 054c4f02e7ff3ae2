//! The 3-D turtle, which reads a string of modules and draws internodes.

use orchard_geometry::{Rotation, Vec3, math};

use crate::lsystem::{Command, Module, Unit};

/// An internode drawn by the turtle. Its base is its parent's tip; the first internode's base is the origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Internode {
    /// Index of the internode from which it grows.
    pub parent: Option<usize>,
    /// Unit heading, world.
    pub heading: Vec3,
    /// Length \[m\].
    pub length: f64,
    /// Relative width.
    pub width: f64,
    /// Number of brackets around it.
    pub order: u8,
    /// Number of its growth unit in the string, and the unit; `None` if the grammar has no growth units.
    pub unit: Option<(u32, Unit)>,
}

/// The turtle stands at an internode's tip; its frame has +x left, +y up, +z the heading.
#[derive(Debug, Clone, Copy)]
struct State {
    at: Option<usize>,
    r_world_turtle: Rotation,
    width: f64,
    order: u8,
    unit: Option<(u32, Unit)>,
}

/// Draws a string: the turtle starts at the origin, heading up, with width 1.
pub fn interpret<A>(string: &[Module<A>]) -> Vec<Internode> {
    let mut internodes = Vec::new();
    let mut state =
        State { at: None, r_world_turtle: Rotation::identity(), width: 1.0, order: 0, unit: None };
    let mut units = 0;
    let mut stack = Vec::new();
    for module in string {
        let Module::Turtle(command) = module else { continue };
        match *command {
            Command::Forward(length) => {
                internodes.push(Internode {
                    parent: state.at,
                    heading: (state.r_world_turtle * Vec3::z()).normalize(),
                    length,
                    width: state.width,
                    order: state.order,
                    unit: state.unit,
                });
                state.at = Some(internodes.len() - 1);
            }
            Command::Width(width) => state.width = width,
            Command::Pitch(angle) => state.turn(Vec3::x() * angle),
            Command::Roll(angle) => state.turn(Vec3::z() * angle),
            Command::Droop(angle) => {
                let heading = state.r_world_turtle * Vec3::z();
                state.r_world_turtle = droop_rotation(&heading, angle) * state.r_world_turtle;
            }
            Command::Push => {
                stack.push(state);
                state.order = state.order.saturating_add(1);
            }
            Command::Unit(unit) => {
                state.unit = Some((units, unit));
                units += 1;
            }
            // A closing bracket without an opening one changes nothing.
            Command::Pop => state = stack.pop().unwrap_or(state),
        }
    }
    internodes
}

impl State {
    /// Rotates the frame about its own axes by a rotation vector \[rad\].
    fn turn(&mut self, rotation_turtle: Vec3) {
        self.r_world_turtle *= Rotation::from_scaled_axis(rotation_turtle);
    }
}

/// Rotation that bends a unit heading by `angle` \[rad\] towards the ground, or away from it where negative,
/// but no further than straight down (up). A vertical heading has no direction to bend in and stays.
pub(crate) fn droop_rotation(heading: &Vec3, angle: f64) -> Rotation {
    let axis = heading.cross(&-Vec3::z());
    let sine = axis.norm();
    if sine == 0.0 {
        return Rotation::identity();
    }
    let to_ground = math::atan2(sine, -heading.z);
    let bend = angle.clamp(to_ground - std::f64::consts::PI, to_ground);
    Rotation::from_scaled_axis(axis * (bend / sine))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn draw(commands: &[Command]) -> Vec<Internode> {
        interpret(&commands.iter().map(|&c| Module::<()>::Turtle(c)).collect::<Vec<_>>())
    }

    fn assert_heading(internode: &Internode, heading: [f64; 3]) {
        // A few roundings of a unit vector.
        assert!((internode.heading - Vec3::from(heading)).norm() < 1e-15, "{internode:?}");
    }

    #[test]
    fn pitch_turns_about_left_and_roll_about_heading() {
        use Command::*;
        let drawn = draw(&[Forward(1.0), Pitch(FRAC_PI_2), Forward(2.0)]);
        assert_heading(&drawn[0], [0.0, 0.0, 1.0]);
        assert_heading(&drawn[1], [0.0, -1.0, 0.0]);
        let drawn = draw(&[Roll(FRAC_PI_2), Pitch(FRAC_PI_2), Forward(2.0)]);
        assert_heading(&drawn[0], [1.0, 0.0, 0.0]);
    }

    #[test]
    fn brackets_restore_the_state_and_count_the_order() {
        use Command::*;
        let drawn = draw(&[Forward(1.0), Push, Width(3.0), Pitch(1.0), Forward(1.0), Pop, Forward(1.0)]);
        assert_eq!(drawn.iter().map(|i| i.parent).collect::<Vec<_>>(), [None, Some(0), Some(0)]);
        assert_eq!(drawn.iter().map(|i| i.order).collect::<Vec<_>>(), [0, 1, 0]);
        assert_eq!(drawn.iter().map(|i| i.width).collect::<Vec<_>>(), [1.0, 3.0, 1.0]);
        assert_heading(&drawn[2], [0.0, 0.0, 1.0]);
    }

    #[test]
    fn droop_stops_at_the_vertical() {
        use Command::*;
        let from_horizontal = |angle| draw(&[Pitch(FRAC_PI_2), Droop(angle), Forward(1.0)]);
        let (s, c) = math::sin_cos(0.3);
        assert_heading(&from_horizontal(0.3)[0], [0.0, -c, -s]);
        assert_heading(&from_horizontal(-0.3)[0], [0.0, -c, s]);
        assert_heading(&from_horizontal(3.0)[0], [0.0, 0.0, -1.0]);
        assert_heading(&from_horizontal(-3.0)[0], [0.0, 0.0, 1.0]);
        assert_heading(&draw(&[Droop(1.0), Forward(1.0)])[0], [0.0, 0.0, 1.0]);
    }
}
