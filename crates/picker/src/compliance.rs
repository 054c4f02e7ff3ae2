//! A way to a point that gives way: slower against resistance, aside from forces from the side, around where nothing moves.
//!
//! With R the force of the hand along the way and S the part across it (both smoothed, less what the arm's torques read before
//! the push), the hand goes on at `v (R_yield - R) / (R_yield - R_free)`, at most v and no faster back than a share of v, and
//! aside at `-S / drag`. Where it makes no progress it goes back and tries the next way around: over, left, right, under. What leads
//! off the line fades out before its end.

use crate::goal::ComplianceConfig;
use orchard_geometry::Vec3;

/// Progress on a compliant way.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Compliance {
    rules: ComplianceConfig,
    /// Unit vector along the way, base frame.
    direction: Vec3,
    length: f64,
    speed: f64,
    /// Force read before the push [N].
    bias: Vec3,
    /// Smoothed force that the hand exerts [N].
    force: Vec3,
    travelled: f64,
    /// Off the line by forces from the side [m].
    aside: Vec3,
    /// Farthest of this way, and the time since it grew.
    best: f64,
    idle: f64,
    /// Going back to here.
    back_to: Option<f64>,
    /// Which way around is being tried; 0 is straight.
    way: usize,
}

/// Ways around: none, over, left, right, under.
const WAYS: usize = 5;

impl Compliance {
    /// At the beginning of a way of a length [m] at a speed [m/s]; `bias` is the force that the arm's torques tell of nothing.
    pub fn new(rules: ComplianceConfig, direction: Vec3, length: f64, speed: f64, bias: Vec3) -> Self {
        Self {
            rules,
            direction,
            length,
            speed,
            bias,
            force: Vec3::zeros(),
            travelled: 0.0,
            aside: Vec3::zeros(),
            best: 0.0,
            idle: 0.0,
            back_to: None,
            way: 0,
        }
    }

    /// Where the hand should be, from the start of the way.
    pub fn offset(&self) -> Vec3 {
        let left = self.length - self.travelled;
        let fade = (left / self.rules.retry.si().max(f64::EPSILON)).clamp(0.0, 1.0);
        // A parabola: nothing at both ends, the whole detour halfway.
        let bulge = 4.0 * self.travelled * left / (self.length * self.length);
        let around = self.sideways() * (self.rules.detour.si() * bulge);
        self.direction * self.travelled + around + self.aside * fade
    }

    /// Unit vector of the present way around.
    fn sideways(&self) -> Vec3 {
        let up = Vec3::z() - self.direction * self.direction.z;
        let up = up.try_normalize(f64::EPSILON.sqrt()).unwrap_or(Vec3::x());
        let left = up.cross(&self.direction);
        [Vec3::zeros(), up, left, -left, -up][self.way % WAYS]
    }

    /// Whether the end of the way is reached.
    pub fn is_over(&self) -> bool {
        self.travelled >= self.length
    }

    /// Goes back to try the next way around.
    pub fn turn_back(&mut self) {
        self.back_to.get_or_insert((self.travelled - self.rules.retry.si()).max(0.0));
    }

    /// Moves on by `dt` [s] under the force that the hand exerts [N, base frame].
    pub fn advance(&mut self, force: &Vec3, dt: f64) {
        let c = &self.rules;
        self.force += (force - self.bias - self.force) * c.force_weight.si();
        let along = self.force.dot(&self.direction);
        let across = self.force - self.direction * along;
        self.aside = (self.aside - across * (dt / c.drag.si())).cap_magnitude(c.aside.si());
        if let Some(goal) = self.back_to {
            self.travelled = (self.travelled - self.speed * dt).max(goal);
            if self.travelled <= goal {
                self.back_to = None;
                self.way += 1;
                (self.best, self.idle) = (goal, 0.0);
            }
            return;
        }
        let room = (c.yields.si() - along) / (c.yields.si() - c.free.si());
        let step = self.speed * dt * room.clamp(-c.back.si(), 1.0);
        self.travelled = (self.travelled + step).clamp(0.0, self.length);
        self.idle += dt;
        if self.travelled >= self.best + c.progress.si() || self.is_over() {
            (self.best, self.idle) = (self.travelled, 0.0);
        } else if self.idle > c.patience.si() {
            self.turn_back();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::goal::GoalConfig;

    const DT: f64 = 1.0 / 60.0;

    fn way() -> Compliance {
        let rules = GoalConfig::paper().compliance;
        Compliance::new(rules, Vec3::x(), 0.4, 0.2, Vec3::new(1.0, 2.0, 3.0))
    }

    #[test]
    fn without_resistance_it_goes_straight_at_full_speed() {
        let mut way = way();
        let nothing = Vec3::new(1.0, 2.0, 3.0);
        for k in 1..=120 {
            way.advance(&nothing, DT);
            let expected = Vec3::x() * (0.2 * DT * f64::from(k)).min(0.4);
            assert!((way.offset() - expected).norm() < 1e-12, "{k}");
        }
        assert!(way.is_over());
    }

    /// A spring in the way: the hand comes to stand where the spring's force is the yielding one, and no deeper.
    #[test]
    fn against_a_spring_it_stands_at_the_yielding_force() {
        let mut way = way();
        let stiffness = 400.0;
        let yields = way.rules.yields.si();
        let mut deepest: f64 = 0.0;
        // Until its patience is over.
        while way.back_to.is_none() {
            let force = Vec3::x() * stiffness * (way.travelled - 0.1).max(0.0) + way.bias;
            way.advance(&force, DT);
            deepest = deepest.max(way.travelled - 0.1);
        }
        // The smoothed force lags the spring by about 5 frames of ever slower motion.
        assert!(deepest * stiffness < 1.1 * yields && deepest * stiffness > 0.7 * yields, "{deepest}");
    }

    #[test]
    fn a_wall_is_tried_on_every_side_in_turn() {
        let mut way = way();
        let mut ways = vec![];
        for _ in 0..60 * 60 {
            let wall = if way.travelled > 0.2 { 100.0 } else { 0.0 };
            way.advance(&(Vec3::x() * wall + way.bias), DT);
            if !ways.contains(&way.way) {
                ways.push(way.way);
            }
            let off = way.offset() - Vec3::x() * way.travelled;
            assert!(off.norm() <= way.rules.detour.si() + 1e-12 && off.x.abs() < 1e-12);
        }
        assert!(ways.len() > WAYS, "{ways:?}");
    }

    #[test]
    fn it_gives_way_to_the_side_and_comes_back_to_the_line() {
        let mut way = way();
        // Something presses the hand to the left: the hand exerts a force to the right.
        for _ in 0..60 {
            way.advance(&(way.bias - Vec3::y() * 4.0), DT);
        }
        assert!(way.aside.y > 0.03 && way.aside.y <= 0.04, "{}", way.aside);
        for _ in 0..120 {
            way.advance(&way.bias.clone(), DT);
        }
        assert!(way.is_over());
        assert!((way.offset() - Vec3::x() * 0.4).norm() < 1e-12);
    }
}
