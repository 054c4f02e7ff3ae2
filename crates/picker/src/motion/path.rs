//! Joint motion through way-points without stopping at them.

use crate::motion::{WayPoint, stopping_speed};
use orchard_robot::JointVector;
use std::collections::VecDeque;

/// Speed and acceleration limits of the joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pace {
    /// Largest speed of a joint [rad/s].
    pub speed: f64,
    /// Largest acceleration of a joint [rad/s2].
    pub acceleration: f64,
}

/// State of a motion through way-points. All joints move in proportion to their remaining distances, so that they stop together; after a
/// way-point each turns to the next one with its largest acceleration.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Path {
    ahead: VecDeque<WayPoint>,
    v: JointVector,
    pace: Pace,
    /// Largest joint step with which the last frame may close the rest \[rad\].
    last_step: f64,
}

impl Path {
    pub fn new(way_points: impl IntoIterator<Item = WayPoint>, v: JointVector, pace: Pace) -> Self {
        Self { ahead: way_points.into_iter().collect(), v, pace, last_step: 0.0 }
    }

    pub fn goal(&self) -> Option<&JointVector> {
        self.ahead.back().map(|w| &w.q)
    }

    pub fn velocity(&self) -> JointVector {
        self.v
    }

    /// True if the posture is the goal.
    pub fn is_over(&self, q: &JointVector) -> bool {
        self.goal().is_none_or(|goal| goal == q)
    }

    /// The posture after `dt` \[s\].
    pub fn step(&mut self, q: &JointVector, dt: f64) -> JointVector {
        while let Some(next) = self.ahead.front()
            && self.ahead.len() > 1
            && (next.q - q).amax() <= next.blend
        {
            self.ahead.pop_front();
        }
        let Some(next) = self.ahead.front() else { return *q };
        let left = next.q - q;
        let farthest = left.amax();
        let Pace { speed, acceleration } = self.pace;
        self.last_step = acceleration * dt * dt;
        let slow = self.v.amax() <= 2.0 * acceleration * dt;
        if self.ahead.len() == 1 && farthest <= self.last_step && slow {
            return next.q;
        }
        // Braking leads to the path's end, but past a way-point by no more than its blend.
        let beyond: f64 =
            self.ahead.iter().zip(self.ahead.iter().skip(1)).map(|(a, b)| (b.q - a.q).amax()).sum();
        let beyond = beyond.min(if self.ahead.len() > 1 { next.blend } else { 0.0 });
        let fastest = stopping_speed(acceleration, farthest + beyond, dt).min(speed);
        let wanted = if farthest > 0.0 { left * (fastest / farthest) } else { JointVector::zeros() };
        let change = acceleration * dt;
        self.v += (wanted - self.v).map(|x| x.clamp(-change, change));
        q + self.v * dt
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: Pace = Pace { speed: 2.5, acceleration: 9.0 };
    const DT: f64 = 1.0 / 60.0;

    fn run(path: &mut Path, mut q: JointVector) -> Vec<JointVector> {
        let mut way = vec![q];
        while !path.is_over(&q) && way.len() < 1000 {
            q = path.step(&q, DT);
            way.push(q);
        }
        way
    }

    /// From rest to rest the time is at best d / v + v / a; speed and acceleration keep their limits.
    #[test]
    fn a_single_leg_takes_the_time_of_a_trapezoid() {
        let goal = JointVector::from_fn(|i, _| 3.0 - 0.5 * i as f64);
        let mut path = Path::new([WayPoint { q: goal, blend: 0.0 }], JointVector::zeros(), PACE);
        let way = run(&mut path, JointVector::zeros());
        let least = 3.0 / PACE.speed + PACE.speed / PACE.acceleration;
        let time = (way.len() - 1) as f64 * DT;
        // Frames are whole: at most two are lost at either end.
        assert!(time >= least - DT && time <= least + 4.0 * DT, "{time} {least}");
        assert_eq!(way[way.len() - 1], goal);
        let mut before = JointVector::zeros();
        for pair in way.windows(2) {
            let v = (pair[1] - pair[0]) / DT;
            assert!(v.amax() <= PACE.speed + 1e-9);
            // The last frame may close what one frame's braking leaves.
            assert!((v - before).amax() <= 3.0 * PACE.acceleration * DT, "{}", (v - before).amax());
            before = v;
        }
    }

    #[test]
    fn a_way_point_is_passed_within_its_blend_without_a_stop() {
        let corner = JointVector::from_element(1.0);
        let mut goal = corner;
        goal[0] = 3.0;
        let points = [WayPoint { q: corner, blend: 0.2 }, WayPoint { q: goal, blend: 0.0 }];
        let mut path = Path::new(points, JointVector::zeros(), PACE);
        let way = run(&mut path, JointVector::zeros());
        assert_eq!(way[way.len() - 1], goal);
        assert!(way.iter().any(|q| (q - corner).amax() <= 0.3));
        let slowest = way.windows(2).skip(5).map(|p| (p[1] - p[0])[0] / DT).take_while(|v| *v > 0.0);
        assert!(slowest.take(60).fold(f64::INFINITY, f64::min) > 0.5);
    }
}
