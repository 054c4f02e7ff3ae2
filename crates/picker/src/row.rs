//! Row of a trellis: the rectangle on the ground in which its wires and the tree were seen, and the way of the base round its end.
//!
//! The base does not know how long a row is. It drives along it, looking, and the row grows with the wires that it sees; where the base is past all of them, it
//! turns round the end.

use crate::drive::BaseGoal;
use crate::record::AttemptEnd;
use nalgebra::Vector2;
use orchard_geometry::{Vec3, math};

/// A line on the ground by its ends, odom \[m\].
pub(crate) type Line = [Vector2<f64>; 2];

/// Share of the clearance by which a base may be off a leg that it has begun; our own choice.
const DRIFT: f64 = 0.25;
/// Share of the clearance from the row's middle line from which on a base is on the other side; our own choice.
const ACROSS: f64 = 0.5;

/// Way round an end of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Round {
    /// Direction along the row to that end, odom.
    towards: Vector2<f64>,
    /// Side of the row on which it leads to the tree: 1 to the left of that direction, -1 to its right.
    side: f64,
    /// Part of it on which the base was last.
    leg: Leg,
    /// True of the way back to the side from which the base came.
    returns: bool,
}

/// Part of a way round an end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Leg {
    /// Out to the lane beside the row.
    Out,
    /// On it towards the row's end.
    Beside,
    /// Round the end.
    Around,
    /// Beside the row back to the tree.
    Back,
}

impl Round {
    /// The way back to the side from which it came; `None` of a way that leads back already.
    pub fn back(self) -> Option<Self> {
        (!self.returns).then_some(Self { side: -self.side, leg: Leg::Out, returns: true, ..self })
    }
}

/// Side of a row on which the base works, and what was in vain there since the last fruit.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Side {
    /// A place on it, odom: where the base started, or where its last way round ended.
    pub p_odom: Vector2<f64>,
    /// Bearings of the views that showed no target, as seen from the tree \[rad\].
    pub views: Vec<f64>,
    /// Bearings of those that a contact ended, or the way there \[rad\].
    pub barred: Vec<f64>,
    /// Number of attempts that failed.
    pub failures: u32,
    /// Way to the other side that the base is on.
    pub way: Option<Round>,
}

impl Side {
    /// Side on which a place (odom) lies, where nothing was in vain yet.
    pub fn at(p_odom: Vector2<f64>) -> Self {
        Self { p_odom, ..Self::default() }
    }

    /// Takes note of the end of an attempt.
    pub fn note(&mut self, end: AttemptEnd) {
        match end {
            AttemptEnd::Deposited => *self = Self::at(self.p_odom),
            AttemptEnd::Failed(_) => self.failures = self.failures.saturating_add(1),
        }
    }
}

/// A row: a rectangle on the ground about the tree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row {
    p_tree: Vector2<f64>,
    /// Unit vector along the row, odom.
    along: Vector2<f64>,
    /// Corners of the rectangle as seen from the tree, along the row and to the left of that \[m\].
    low: Vector2<f64>,
    high: Vector2<f64>,
}

impl Row {
    /// Makes the row through a tree from its wires, and from other lines at which something has held the base; both count if they lie within `width` \[m\] of
    /// the line through the tree. The longest wire gives its direction. `None` without a wire.
    pub fn about(p_tree: &Vec3, width: f64, wires: &[Line], others: &[Line]) -> Option<Self> {
        let p_tree = p_tree.xy();
        let passes = |line: &&Line| {
            let along = (line[1] - line[0]).normalize();
            along.perp(&(p_tree - line[0])).abs() <= width
        };
        let longest = wires.iter().filter(passes).max_by(|a, b| length(a).total_cmp(&length(b)))?;
        let along = (longest[1] - longest[0]).normalize();
        let mut row = Self { p_tree, along, low: Vector2::zeros(), high: Vector2::zeros() };
        for line in wires.iter().chain(others) {
            let ends = line.map(|p| row.local(&p));
            if ends.iter().all(|p| p.y.abs() <= width) {
                row.low = ends.iter().fold(row.low, |low, p| low.inf(p));
                row.high = ends.iter().fold(row.high, |high, p| high.sup(p));
            }
        }
        Some(row)
    }

    /// A place as seen from the tree, along the row and to the left of that \[m\].
    fn local(&self, p: &Vector2<f64>) -> Vector2<f64> {
        let off = p - self.p_tree;
        Vector2::new(self.along.dot(&off), self.along.perp(&off))
    }

    /// Way from a place (odom) round the nearer end, as far as the row has been seen, to the other side than that on which it works.
    pub fn round(&self, here: &Vector2<f64>, works: &Side) -> Round {
        let x = self.local(here).x;
        let sense = if self.high.x - x <= x - self.low.x { 1.0 } else { -1.0 };
        let side = -(self.local(&works.p_odom).y * sense).signum();
        Round { towards: self.along * sense, side, leg: Leg::Out, returns: false }
    }

    /// Bearing straight out of the row, on the side of a place (odom) \[rad\].
    pub fn outwards(&self, here: &Vector2<f64>) -> f64 {
        let side = self.local(here).y.signum();
        math::atan2(self.along.x * side, -self.along.y * side)
    }

    /// Turns the row's direction towards the end that a way goes round; the rectangle stays where it is.
    fn turned(self, way: &Round) -> Self {
        match self.along.dot(&way.towards) < 0.0 {
            true => Self { along: -self.along, low: -self.high, high: -self.low, ..self },
            false => self,
        }
    }

    /// Next corner of a way from a place (odom): out to the lane beside the row, along it past the end, round the end, and back to the tree, `clearance` \[m\]
    /// outside the rectangle. The base faces the row. `None` once it is there within `tolerance` \[m\]. A base that stands in the row, under its wires, leaves it to
    /// the side from which it came. A leg that was begun is kept until the base is [`DRIFT`] of `clearance` off it: a base on wheels drifts while it turns.
    pub fn corner(
        &self,
        here: &Vector2<f64>,
        way: &mut Round,
        clearance: f64,
        tolerance: f64,
    ) -> Option<BaseGoal> {
        let row = self.turned(way);
        let p = row.local(here);
        let (to_right, to_left) = (clearance - row.low.y, clearance + row.high.y);
        let (near, far) = if way.side > 0.0 { (to_right, to_left) } else { (to_left, to_right) };
        let (end, off) = (row.high.x + clearance, p.y * way.side);
        let kept = |leg: Leg| if way.leg >= leg { DRIFT * clearance } else { tolerance };
        let is_past = p.x >= end - kept(Leg::Around);
        let (leg, x, y, facing) = if off < ACROSS * clearance && !is_past {
            let is_off = off > kept(Leg::Beside) - near;
            let (leg, x) = if is_off { (Leg::Out, p.x) } else { (Leg::Beside, end) };
            (leg, x, -near, Vector2::new(0.0, way.side))
        } else if off < far - kept(Leg::Back) {
            let x = if is_past { end } else { p.x };
            (Leg::Around, x, far, Vector2::new(-1.0, 0.0))
        } else if p.x.abs() > tolerance || off > far + kept(Leg::Back) {
            (Leg::Back, 0.0, far, Vector2::new(0.0, -way.side))
        } else {
            return None;
        };
        way.leg = leg;
        let left = Vector2::new(-row.along.y, row.along.x);
        let odom = |x: f64, y: f64| row.along * x + left * y;
        let (p_goal, facing) = (row.p_tree + odom(x, y * way.side), odom(facing.x, facing.y));
        Some(BaseGoal { x: p_goal.x, y: p_goal.y, yaw: math::atan2(facing.y, facing.x) })
    }
}

fn length(line: &Line) -> f64 {
    (line[1] - line[0]).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    const CLEARANCE: f64 = 1.6;
    const TOLERANCE: f64 = 0.1;
    const TREE: Vec3 = Vec3::new(2.4, 0.0, 0.0);

    /// Line across the robot's start, `off` before the tree, between two ends.
    fn line(off: f64, from: f64, to: f64) -> Line {
        [Vector2::new(TREE.x - off, from), Vector2::new(TREE.x - off, to)]
    }

    fn row(wires: &[Line]) -> Row {
        Row::about(&TREE, 1.3, wires, &[]).expect("wires")
    }

    /// Straight out of the row is square to it, to the side on which the place lies.
    #[test]
    fn out_of_the_row_is_square_to_it() {
        let row = row(&[line(0.2, -2.0, 1.0)]);
        for (x, bearing) in [(0.5, PI), (4.0, 0.0)] {
            let off = math::wrap_angle(row.outwards(&Vector2::new(x, 0.7)) - bearing);
            assert!(off.abs() < 1e-12, "{x}: {off}");
        }
    }

    /// The rectangle holds the tree, the wires beside it and what has held the base at their ends; wires elsewhere, and a tree without wires, make no row.
    #[test]
    fn a_row_is_where_wires_pass_the_tree() {
        let wires = [line(0.4, -1.0, 1.5), line(0.2, -2.0, 1.0), line(3.0, -9.0, 9.0)];
        let held = [[Vector2::new(2.2, 1.2), Vector2::new(2.4, 2.4)], line(-2.0, -8.0, 8.0)];
        let row = Row::about(&TREE, 1.3, &wires, &held).expect("wires");
        // Left of its direction, odom's y axis, is against odom's x axis.
        assert_eq!((row.along, row.p_tree), (Vector2::y(), TREE.xy()));
        assert!((row.low - Vector2::new(-2.0, 0.0)).norm() < 1e-12, "{row:?}");
        assert!((row.high - Vector2::new(2.4, 0.4)).norm() < 1e-12, "{row:?}");
        assert_eq!(Row::about(&TREE, 1.3, &[wires[2]], &held), None);
        assert_eq!(Row::about(&TREE, 1.3, &[], &held), None);
    }

    /// From its start the base drives out to the lane, along it past the nearer end, round it and back to the tree, and faces the row; it keeps its distance from the row
    /// all the way, and is there after the length of these legs.
    #[test]
    fn it_leads_round_the_nearer_end() {
        let wire = [line(0.4, -7.5, 7.5)];
        let row = row(&wire);
        for sign in [1.0, -1.0] {
            let mut here = Vector2::new(1.2, 0.5 * sign);
            let mut way = row.round(&here, &Side::default());
            let (mut corners, mut length): (Vec<BaseGoal>, f64) = (Vec::new(), 0.0);
            let step = 0.01_f64;
            while let Some(goal) = row.corner(&here, &mut way, CLEARANCE, TOLERANCE) {
                if corners.last().is_none_or(|last| (last.yaw - goal.yaw).abs() > 1e-9) {
                    corners.push(goal);
                }
                let left = Vector2::new(goal.x, goal.y) - here;
                here += left.normalize() * step.min(left.norm());
                length += step;
                let outside = |x: f64, low: f64, high: f64| (low - x).max(x - high).max(0.0);
                let off = Vector2::new(outside(here.x, 2.0, 2.4), outside(here.y, -7.5, 7.5));
                assert!(length < 0.9 || off.norm() > CLEARANCE - TOLERANCE - 1e-9, "{here} {length}");
                assert!(length < 30.0);
            }
            let expected = [
                (2.0 - CLEARANCE, 0.5 * sign, 0.0),
                (2.4 + CLEARANCE, (7.5 + CLEARANCE) * sign, -FRAC_PI_2 * sign),
                (2.4 + CLEARANCE, 0.0, PI),
            ];
            assert_eq!(corners.len(), expected.len(), "{corners:?}");
            for (goal, (x, y, yaw)) in corners.iter().zip(expected) {
                assert!((goal.x - x).abs() < 0.02 && (goal.y - y).abs() < TOLERANCE, "{goal:?}");
                assert!(math::cos(goal.yaw - yaw) > 1.0 - 1e-12, "{goal:?}");
            }
            let legs = 0.8 + (7.0 + CLEARANCE) + (0.4 + 2.0 * CLEARANCE) + (7.5 + CLEARANCE);
            // The corners are cut by the tolerance.
            assert!((length - legs).abs() < 8.0 * TOLERANCE, "{length} {legs}");
            assert!((here - Vector2::new(2.4 + CLEARANCE, 0.0)).norm() < TOLERANCE + step, "{here}");
        }
    }

    /// Wires seen on the way move the end on, also where the base is about to turn round it; whichever wire is the longest, the way leads to the same end. The way back
    /// leads to the side from which it came.
    #[test]
    fn the_row_grows_on_the_way() {
        let (short, long) = (line(0.4, -1.0, 3.0), [Vector2::new(2.0, 7.5), Vector2::new(2.0, 1.0)]);
        let mut way = row(&[short]).round(&Vector2::new(0.4, 1.2), &Side::default());
        let here = Vector2::new(0.4, 3.0 + CLEARANCE);
        let corner =
            |row: &Row, way: &mut Round| row.corner(&here, way, CLEARANCE, TOLERANCE).expect("on its way");
        let turns = corner(&row(&[short]), &mut way);
        assert!((turns.x - 4.0).abs() < 1e-12 && (turns.y - here.y).abs() < 1e-12, "{turns:?}");
        let goes_on = corner(&row(&[short, long]), &mut way);
        assert!(
            (goes_on.x - 0.4).abs() < 1e-12 && (goes_on.y - 7.5 - CLEARANCE).abs() < 1e-12,
            "{goes_on:?}"
        );
        let mut way_back = way.back().expect("it leads on");
        assert_eq!(way_back.back(), None);
        let back = corner(&row(&[short, long]), &mut way_back);
        assert!((back.x - 0.4).abs() < 1e-12 && back.y.abs() < 1e-12 && back.yaw.abs() < 1e-12, "{back:?}");
    }

    /// A base that drifts while it turns for its next leg keeps that leg; before it has come to the leg's start, the drift leads it on there.
    #[test]
    fn a_drift_does_not_change_the_leg() {
        let row = row(&[line(0.4, -3.0, 3.0)]);
        let (end, far) = (3.0 + CLEARANCE, 2.4 + CLEARANCE);
        let drift = 2.0 * TOLERANCE;
        let goal = |way: &mut Round, x: f64, y: f64| {
            let goal = row.corner(&Vector2::new(x, y), way, CLEARANCE, TOLERANCE).expect("on its way");
            Vector2::new(goal.x, goal.y)
        };
        let lane = 2.0 - CLEARANCE;
        let mut way = row.round(&Vector2::new(lane, 1.2), &Side::default());
        // Out to the lane, beside the row, round its end, back: first off the start of each leg, then on it, then off it again.
        let legs = [
            (Vector2::new(lane, 1.2), Vector2::x(), Vector2::new(lane, 1.2), Vector2::new(lane, end)),
            (Vector2::new(lane, end), -Vector2::y(), Vector2::new(lane, end), Vector2::new(far, end)),
            (Vector2::new(far, end), -Vector2::x(), Vector2::new(far, end), Vector2::new(far, 0.0)),
        ];
        for (start, off, before, after) in legs {
            let p = start + off * drift;
            assert!((goal(&mut way, p.x, p.y) - before).norm() < 1e-12, "{start}");
            goal(&mut way, start.x, start.y);
            assert!((goal(&mut way, p.x, p.y) - after).norm() < 1e-12, "{start}");
        }
    }

    /// A base that stands under the wires, a little beyond them, leaves the row to the side on which it works, whichever that is.
    #[test]
    fn a_base_under_the_wires_leaves_to_its_side() {
        let (row, here) = (row(&[line(0.0, -7.5, 7.5)]), Vector2::new(2.45, 1.0));
        for (home, x) in [(0.0, 2.4 - CLEARANCE), (4.8, 2.4 + CLEARANCE)] {
            let mut way = row.round(&here, &Side::at(Vector2::new(home, 0.0)));
            let goal = row.corner(&here, &mut way, CLEARANCE, TOLERANCE).expect("on its way");
            assert!((goal.x - x).abs() < 1e-12 && (goal.y - 1.0).abs() < 1e-12, "{home} {goal:?}");
        }
    }

    /// A fruit makes good what was in vain on a side; a failure adds to it.
    #[test]
    fn a_fruit_makes_good_what_was_in_vain() {
        let mut side = Side::at(Vector2::x());
        side.note(AttemptEnd::Failed(crate::record::FailureReason::Blocked));
        side.views.push(0.5);
        assert_eq!((side.failures, side.p_odom), (1, Vector2::x()));
        side.note(AttemptEnd::Deposited);
        assert_eq!(side, Side::at(Vector2::x()));
    }
}
