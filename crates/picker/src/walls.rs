//! Walls: lines on the ground that the base does not cross, since wires are seen there or something has held it.
//!
//! Wires and posts of a trellis stand in rows. Images show [wires](crate::wires) as dotted lines, but not always. So what holds the base is taken for a straight
//! piece of a row across its way, known by the base's stop alone.

use crate::config::{DriveConfig, PickerConfig};
use crate::drive::{BaseGoal, bearing_of};
use crate::robot_state::{RobotState, turned};
use crate::row::{Line, Row};
use crate::wires::{Wires, WiresConfig};
use nalgebra::Vector2;
use orchard_geometry::{Vec3, math};

/// Longest step on the circle about the tree by which a way is checked \[rad\]; our choice, within 8 mm of the arc.
const ARC_STEP: f64 = 0.2;

/// A place where the base was held: its position \[m\] and the direction of its motion, both odom.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stop {
    p: Vector2<f64>,
    direction: Vector2<f64>,
}

/// Walls met so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Walls {
    stops: Vec<Stop>,
    wires: Wires,
}

impl Walls {
    /// Takes note of a wall ahead of a base that was commanded to a velocity [m/s, m/s, rad/s] in its own frame, unless it was not to drive or the config
    /// knows no walls.
    pub fn meet(&mut self, robot: &RobotState, velocity: &[f64; 3], c: &DriveConfig) {
        let [x, y, yaw] = robot.base_pose;
        let ahead = Vector2::from(turned([velocity[0], velocity[1]], yaw));
        if c.wall_half.si() > 0.0 && ahead.norm() > c.stall_command.si() {
            self.stops.push(Stop { p: Vector2::new(x, y), direction: ahead.normalize() });
        }
    }

    /// Takes note of the wires among the thin points of an image by a camera at a position, both odom \[m\].
    pub fn see(&mut self, points: Vec<Vec3>, eye: Vec3, c: &WiresConfig) {
        self.wires.see(points, eye, c);
    }

    /// True if the way to a goal, straight or around the tree, crosses a wall.
    pub fn bar(&self, robot: &RobotState, goal: &BaseGoal, tree: &Vec3, c: &PickerConfig) -> bool {
        let mut lines = self.lines(c).peekable();
        if lines.peek().is_none() {
            return false;
        }
        let way = way(robot, goal, tree, &c.drive);
        lines.any(|line| way.windows(2).any(|leg| cross([leg[0], leg[1]], line)))
    }

    /// Walls as lines on the ground, odom.
    fn lines<'a>(&'a self, c: &'a PickerConfig) -> impl Iterator<Item = Line> {
        let wires = self.wires.of_trellis(c.align.body_height.si(), &c.wires);
        self.met(&c.drive).chain(wires.map(|wire| wire.on_ground(c.drive.wall_half.si())))
    }

    /// Walls that were met, as lines on the ground, odom.
    fn met(&self, c: &DriveConfig) -> impl Iterator<Item = Line> {
        let (half, ahead) = (c.wall_half.si(), c.wall_ahead.si());
        self.stops.iter().map(move |stop| {
            let across = Vector2::new(-stop.direction.y, stop.direction.x) * half;
            let middle = stop.p + stop.direction * ahead;
            [middle - across, middle + across]
        })
    }

    /// Row of the trellis in which a tree (odom) stands; `None` if no wires of one were seen.
    pub fn row(&self, tree: &Vec3, c: &PickerConfig) -> Option<Row> {
        let wires = self.wires.of_trellis(c.align.body_height.si(), &c.wires);
        let wires: Vec<Line> = wires.map(|wire| wire.on_ground(0.0)).collect();
        let met: Vec<Line> = self.met(&c.drive).collect();
        Row::about(tree, c.belief.canopy_radius.si(), &wires, &met)
    }
}

/// Way of the base to a goal as corners of straight legs, odom: straight where that is driven straight, else on the circle about the tree.
fn way(robot: &RobotState, goal: &BaseGoal, tree: &Vec3, c: &DriveConfig) -> Vec<Vector2<f64>> {
    let (here, there) = (robot.p_odom(), Vec3::new(goal.x, goal.y, 0.0));
    let start = bearing_of(&here, tree);
    let swing = math::wrap_angle(bearing_of(&there, tree) - start);
    let round = (swing.abs() - c.orbit_angle.si()).max(0.0);
    let steps = (round / ARC_STEP).ceil();
    let on_circle = |k: f64| {
        let (sin, cos) = math::sin_cos(start + swing.signum() * round * k / steps);
        tree.xy() + Vector2::new(cos, sin) * c.orbit_radius.si()
    };
    let arc = (0..=steps as u32).filter(|_| steps > 0.0).map(|k| on_circle(f64::from(k)));
    [here.xy()].into_iter().chain(arc).chain([there.xy()]).collect()
}

/// True if two segments cross.
fn cross(a: [Vector2<f64>; 2], b: [Vector2<f64>; 2]) -> bool {
    let side = |s: &[Vector2<f64>; 2], p: &Vector2<f64>| (s[1] - s[0]).perp(&(p - s[0])) > 0.0;
    side(&a, &b[0]) != side(&a, &b[1]) && side(&b, &a[0]) != side(&b, &a[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PickerConfig;
    use crate::expert::ExpertConfig;

    fn robot(x: f64, y: f64) -> RobotState {
        let mut robot = RobotState::still(0.0);
        robot.place_base([x, y, 0.5]);
        robot
    }

    /// A base that was held on its way around the tree finds no way past the row that it met; the other way around the tree is open.
    #[test]
    fn a_wall_bars_the_far_side() {
        let config = ExpertConfig::preset().shared;
        let (c, tree) = (&config.drive, Vec3::zeros());
        // It drives around the tree from the south and meets a row along x at its eastern end.
        let held = robot(1.6, -0.4);
        let mut walls = Walls::default();
        let goal = |x: f64, y: f64| BaseGoal { x, y, yaw: 0.0 };
        assert!(!walls.bar(&held, &goal(0.0, 1.3), &tree, &config));
        let north = turned([0.0, 0.5], -0.5);
        walls.meet(&held, &[north[0], north[1], 0.0], c);
        let south = robot(0.2, -1.5);
        for (x, y, barred) in
            [(0.0, 1.3, true), (1.0, 0.8, true), (0.0, -1.0, false), (-1.0, -0.9, false), (-1.2, 0.6, false)]
        {
            assert_eq!(walls.bar(&south, &goal(x, y), &tree, &config), barred, "{x} {y}");
        }
    }

    /// A trellis that is seen bars the way to its other side, as far as its wires were seen and `wall_half` beyond; places on this side stay open.
    #[test]
    fn a_trellis_is_barred_before_it_is_touched() {
        let config = ExpertConfig::preset().shared;
        let wire = |z: f64| (0..20).map(move |k| Vec3::new(-1.9 + 0.2 * f64::from(k), 0.08, z));
        let mut walls = Walls::default();
        let goal = |x: f64, y: f64| BaseGoal { x, y, yaw: 0.0 };
        let (tree, south) = (Vec3::zeros(), robot(0.2, -1.5));
        let look = |walls: &mut Walls, z: f64| {
            for x in [0.0, 0.5] {
                walls.see(wire(z).collect(), Vec3::new(x, -1.5, 1.0), &config.wires);
            }
        };
        look(&mut walls, 0.6);
        assert!(!walls.bar(&south, &goal(0.0, 1.3), &tree, &config), "one wire alone");
        look(&mut walls, 1.0);
        for (x, y, barred) in [(0.0, 1.3, true), (1.2, 0.8, true), (0.0, -1.0, false), (-1.2, -0.6, false)] {
            assert_eq!(walls.bar(&south, &goal(x, y), &tree, &config), barred, "{x} {y}");
        }
    }

    /// A base that was not to drive met nothing; the baseline keeps no walls.
    #[test]
    fn walls_are_met_by_driving() {
        let (expert, baseline) = (ExpertConfig::preset().shared.drive, PickerConfig::baseline().drive);
        for (velocity, c) in [([0.0, 0.0, 1.0], &expert), ([0.5, 0.0, 0.0], &baseline)] {
            let mut walls = Walls::default();
            walls.meet(&robot(1.0, 0.0), &velocity, c);
            assert_eq!(walls, Walls::default());
        }
    }
}
