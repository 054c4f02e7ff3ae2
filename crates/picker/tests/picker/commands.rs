//! Commands are finite and within the robot's limits for any sensor readings.

use crate::fake::FakeWorld;
use orchard_geometry::Image;
use orchard_picker::Kind;
use proptest::prelude::*;

/// A sensor reading: mostly plausible, sometimes not finite or huge.
fn reading() -> impl Strategy<Value = f64> {
    prop_oneof![60 => -3.0..3.0, 1 => Just(f64::NAN), 1 => Just(f64::INFINITY), 1 => -1e9..1e9]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(80))]

    #[test]
    fn commands_are_finite_and_within_limits(
        frames in prop::collection::vec((prop::array::uniform32(reading()), any::<u32>()), 1..30),
        nonsense in any::<bool>(),
        kind in prop::sample::select(Kind::ALL.to_vec()),
    ) {
        let mut world = FakeWorld::new(&[(3.0, 0.5, 1.0)]);
        let arm = world.robot.kinematics().clone();
        let mut picker = world.picker(kind);
        let mut time = 0.0;
        for (mut r, noise) in frames {
            if !nonsense {
                r = r.map(|x: f64| if x.is_finite() { x.clamp(-3.0, 3.0) } else { 0.0 });
            }
            let mut o = world.observe();
            time += r[31].abs().min(1.0) * 0.1;
            (o.time, o.depth_time) = (time, time);
            o.arm_q.copy_from_slice(&r[0..7]);
            o.arm_v.copy_from_slice(&r[7..14]);
            o.arm_torque.copy_from_slice(&r[14..21]);
            o.finger_q.copy_from_slice(&r[21..23]);
            o.finger_force.copy_from_slice(&r[21..23]);
            o.base_pose.copy_from_slice(&r[23..26]);
            o.base_velocity.copy_from_slice(&r[26..29]);
            o.base_height = r[29];
            // Blocks of random depth, invalid and impossible values among them.
            let mut image = Image::filled(48, 36, 0.0f32);
            let mut state = noise | 1;
            for (k, pixel) in image.pixels_mut().iter_mut().enumerate() {
                if k % 5 == 0 {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                }
                *pixel = match state >> 29 {
                    0 => f32::NAN,
                    1 => -1.0,
                    2 => f32::INFINITY,
                    _ => (state >> 8) as f32 / 2e7 + 0.3,
                };
            }
            o.intrinsics = orchard_geometry::Intrinsics::from_vertical_fov(48, 36, 1.3);
            o.depth = Some(image);
            let c = picker.act(&o);
            for (q, limit) in c.arm_q.iter().zip(arm.limits()) {
                prop_assert!(q.is_finite() && (limit.lower..=limit.upper).contains(q));
            }
            prop_assert!(c.base_velocity[..2].iter().all(|v| v.abs() <= 1.1));
            prop_assert!(c.base_velocity[2].abs() <= 2.0);
            prop_assert!((0.0..=arm.finger_stroke()).contains(&c.finger_q));
            prop_assert!((0.0..=arm.finger_force()).contains(&c.finger_force));
        }
    }
}
