//! Largest speed of a joint from which it can still stop in time.

/// Returns the largest speed for the coming step of length `dt` \[s\] from which a joint that brakes with `deceleration` stops within the
/// distance `way`; units of `way` per second.
///
/// Moving at v, then at v - a dt, v - 2 a dt ..., covers `(n + 1) v dt - a dt^2 n (n + 1) / 2` with n = floor(v / (a dt)):
/// a line between the values `a dt^2 n (n + 1) / 2` at v = n a dt, which is solved for v. After that step the remaining distance gives a
/// speed that is lower by no more than `a dt`, so the bound never needs more than the deceleration. A negative distance has been passed:
/// the joint goes back in one step.
pub(crate) fn stopping_speed(way: f64, deceleration: f64, dt: f64) -> f64 {
    if way <= 0.0 {
        return way / dt;
    }
    let quantum = deceleration * dt * dt;
    let steps = (((1.0 + 8.0 * way / quantum).sqrt() - 1.0) * 0.5).floor();
    (way + 0.5 * quantum * steps * (steps + 1.0)) / ((steps + 1.0) * dt)
}

/// Returns the range of velocities that a joint may have in the coming step: within its speed limit, within the reach of its acceleration
/// from `v`, and slow enough to stop before the ends of its range. If these contradict each other, because the state broke them before,
/// the acceleration counts: the joint brakes as hard as it may.
pub(crate) fn velocity_range(q: f64, v: f64, limit: &crate::Limit, acceleration: f64, dt: f64) -> (f64, f64) {
    let highest = stopping_speed(limit.upper - q, acceleration, dt).min(limit.velocity);
    let lowest = -stopping_speed(q - limit.lower, acceleration, dt).min(limit.velocity);
    let step = acceleration * dt;
    let within = |x: f64| x.max(v - step).min(v + step);
    (within(lowest), within(highest))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Braking from the bound ends at the goal, never past it, and needs no more than the deceleration.
    #[test]
    fn braking_from_the_bound_ends_on_the_mark() {
        let (a, dt) = (10.0, 1.0 / 60.0);
        for start in [1e-5, 3e-4, 0.0021, 0.05, 0.7, 3.0] {
            let (mut way, mut v): (f64, f64) = (start, stopping_speed(start, a, dt));
            for _ in 0..2000 {
                way -= v * dt;
                let next = stopping_speed(way, a, dt);
                assert!(next >= v - a * dt * (1.0 + 1e-9) - 1e-12, "{start}: {v} to {next}");
                assert!(way > -1e-12, "{start}: {way}");
                v = next;
            }
            assert!(way < 1e-9, "{start}: {way} left");
        }
    }

    #[test]
    fn a_state_beyond_its_limits_brakes_at_the_acceleration() {
        let limit = crate::Limit { lower: -1.0, upper: 1.0, velocity: 2.0, effort: 1.0 };
        let dt = 0.01;
        assert_eq!(velocity_range(0.0, 5.0, &limit, 10.0, dt), (4.9, 4.9));
        assert_eq!(velocity_range(0.999, 1.5, &limit, 10.0, dt), (1.4, 1.4));
        assert_eq!(velocity_range(1.5, 0.0, &limit, 10.0, dt), (-0.1, -0.1));
        assert_eq!(velocity_range(0.0, 1.0, &limit, 10.0, dt), (0.9, 1.1));
    }
}
