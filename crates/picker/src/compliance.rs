//! Compliant push to a point: slows against resistance, yields to sideways forces, and tries detours where it makes no progress.
//!
//! With R the force of the hand along the push and S the force across it (both smoothed, less the reading before the push), the hand moves
//! along at `v (R_yield - R) / (R_yield - R_free)`, at most v and backwards at most a share of v, and sideways at `-S / drag`. Without
//! progress it goes back and tries the next detour: over, left, right, under. Sideways displacements fade out before the end.

use crate::task::ComplianceConfig;
use orchard_geometry::Vec3;

/// State of a compliant push.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Compliance {
    rules: ComplianceConfig,
    /// Unit vector along the push, base frame.
    direction: Vec3,
    length: f64,
    speed: f64,
    /// Force read before the push \[N\].
    bias: Vec3,
    /// Smoothed force that the hand exerts \[N\].
    force: Vec3,
    travelled: f64,
    /// Displacement by sideways forces \[m\].
    aside: Vec3,
    /// Farthest distance of the present detour \[m\], and the time since it grew \[s\].
    best: f64,
    idle: f64,
    /// Distance to which the hand goes back \[m\]; `None` while it goes on.
    back_to: Option<f64>,
    /// Number of the present detour; 0 is straight.
    detour: usize,
}

/// Number of detours: none, over, left, right, under.
const DETOURS: usize = 5;

impl Compliance {
    /// Makes the state at the start of a push of a length \[m\] at a speed [m/s]; `bias` is the force reading without contact \[N\].
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
            detour: 0,
        }
    }

    /// Displacement of the hand from the start of the push, base frame \[m\].
    pub fn offset(&self) -> Vec3 {
        let left = self.length - self.travelled;
        let fade = (left / self.rules.retry.si().max(f64::EPSILON)).clamp(0.0, 1.0);
        // A parabola: zero at both ends, the whole detour halfway.
        let bulge = 4.0 * self.travelled * left / (self.length * self.length);
        let around = self.sideways() * (self.rules.detour.si() * bulge);
        self.direction * self.travelled + around + self.aside * fade
    }

    /// Unit vector of the present detour.
    fn sideways(&self) -> Vec3 {
        let up = Vec3::z() - self.direction * self.direction.z;
        let up = up.try_normalize(f64::EPSILON.sqrt()).unwrap_or(Vec3::x());
        let left = up.cross(&self.direction);
        [Vec3::zeros(), up, left, -left, -up][self.detour % DETOURS]
    }

    /// True if the end of the push is reached.
    pub fn is_over(&self) -> bool {
        self.travelled >= self.length
    }

    /// Goes back to try the next detour.
    pub fn turn_back(&mut self) {
        self.back_to.get_or_insert((self.travelled - self.rules.retry.si()).max(0.0));
    }

    /// Advances by `dt` \[s\] under the force that the hand exerts, base frame \[N\].
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
                self.detour += 1;
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
    use crate::task::GoalConfig;

    const DT: f64 = 1.0 / 60.0;

    fn push() -> Compliance {
        let rules = GoalConfig::paper().compliance;
        Compliance::new(rules, Vec3::x(), 0.4, 0.2, Vec3::new(1.0, 2.0, 3.0))
    }

    #[test]
    fn without_resistance_it_goes_straight_at_full_speed() {
        let mut push = push();
        let nothing = Vec3::new(1.0, 2.0, 3.0);
        for k in 1..=120 {
            push.advance(&nothing, DT);
            let expected = Vec3::x() * (0.2 * DT * f64::from(k)).min(0.4);
            assert!((push.offset() - expected).norm() < 1e-12, "{k}");
        }
        assert!(push.is_over());
    }

    /// Against a spring the hand stops where the spring's force equals the yield force.
    #[test]
    fn against_a_spring_it_stands_at_the_yielding_force() {
        let mut push = push();
        let stiffness = 400.0;
        let yields = push.rules.yields.si();
        let mut deepest: f64 = 0.0;
        // Until its patience ends.
        while push.back_to.is_none() {
            let force = Vec3::x() * stiffness * (push.travelled - 0.1).max(0.0) + push.bias;
            push.advance(&force, DT);
            deepest = deepest.max(push.travelled - 0.1);
        }
        // The smoothed force lags the spring by about 5 frames of ever slower motion.
        assert!(deepest * stiffness < 1.1 * yields && deepest * stiffness > 0.7 * yields, "{deepest}");
    }

    #[test]
    fn a_wall_is_tried_on_every_side_in_turn() {
        let mut push = push();
        let mut detours = vec![];
        for _ in 0..60 * 60 {
            let wall = if push.travelled > 0.2 { 100.0 } else { 0.0 };
            push.advance(&(Vec3::x() * wall + push.bias), DT);
            if !detours.contains(&push.detour) {
                detours.push(push.detour);
            }
            let off = push.offset() - Vec3::x() * push.travelled;
            assert!(off.norm() <= push.rules.detour.si() + 1e-12 && off.x.abs() < 1e-12);
        }
        assert!(detours.len() > DETOURS, "{detours:?}");
    }

    #[test]
    fn it_gives_way_to_the_side_and_comes_back_to_the_line() {
        let mut push = push();
        // Something presses the hand to the left: the hand exerts a force to the right.
        for _ in 0..60 {
            push.advance(&(push.bias - Vec3::y() * 4.0), DT);
        }
        assert!(push.aside.y > 0.03 && push.aside.y <= 0.04, "{}", push.aside);
        for _ in 0..120 {
            push.advance(&push.bias.clone(), DT);
        }
        assert!(push.is_over());
        assert!((push.offset() - Vec3::x() * 0.4).norm() < 1e-12);
    }
}
