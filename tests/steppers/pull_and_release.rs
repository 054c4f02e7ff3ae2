//! A pull on every tree for half a second, and half a second after its release: nothing breaks.

use super::backends::{PUSHES, backends};
use super::forces::push;
use super::trees::{
    Errors, grown, in_short_waves, in_wind, kick, measured, on_tethers_in_wind, siblings, state, stemmed,
};
use orchard_batch::{Status, TreeWorld};
use orchard_geometry::Vec3;

/// Force on a tip \[N\], and torque about its segment's centre of mass \[N m\].
const PULL: [Vec3; 2] = [Vec3::new(0.4, -0.2, -0.3), Vec3::new(0.04, -0.02, -0.03)];
/// Joint rates at the start \[rad/s\]. Wood as measured has little damping: its twigs whip, and from 18 rad/s on f64 takes velocity products otherwise
/// (decision 10). Half of its pull stays on, since its joints bend too little by themselves for an error over the largest angle.
const KICK: f64 = 0.5;
const LIGHTLY_DAMPED_KICK: f64 = 0.2;
const STAYS_ON: f64 = 0.5;
/// Speed of the wind at the height of the canopy [m/s]: a fresh breeze.
const WIND: f64 = 6.0;
/// Kinds of worlds that a slow batch takes.
const SLOW_KINDS: usize = 3;
/// Frames of each half, and between two comparisons.
const HALF: u32 = 30;
const LOOK: u32 = 6;

/// The first segments without children.
fn tip_segments(world: &TreeWorld) -> Vec<usize> {
    let parent = &world.plant().tree.parent;
    (0..parent.len()).filter(|i| !parent.contains(&Some(*i))).take(PUSHES).collect()
}

#[test]
fn pull_and_release_agrees_with_f64() {
    for backend in backends() {
        let mut kinds = vec![
            ("one topology", siblings(3), KICK, 0.0, backend.tolerance),
            ("own topologies", grown(4), KICK, 0.0, backend.tolerance),
            ("fruit on stems", stemmed(4), LIGHTLY_DAMPED_KICK, STAYS_ON, backend.tolerance.on_stems()),
            (
                "wood as measured",
                measured(4),
                LIGHTLY_DAMPED_KICK,
                STAYS_ON,
                backend.tolerance.lightly_damped(),
            ),
            ("in wind", in_wind(3, WIND), LIGHTLY_DAMPED_KICK, STAYS_ON, backend.tolerance.on_stems()),
            (
                "in short waves",
                in_short_waves(WIND),
                LIGHTLY_DAMPED_KICK,
                STAYS_ON,
                backend.tolerance.on_stems(),
            ),
            (
                "in wind, on tethers",
                on_tethers_in_wind(3, WIND),
                LIGHTLY_DAMPED_KICK,
                STAYS_ON,
                backend.tolerance.lightly_damped(),
            ),
        ];
        if backend.is_slow {
            kinds.truncate(SLOW_KINDS);
        }
        for (kind, mut worlds, rate, stays_on, tolerance) in kinds {
            kick(&mut worlds, rate);
            let mut stepper = backend.build(&worlds);
            let mut worst = Errors::default();
            for wrench in [PULL, PULL.map(|part| part * stays_on)] {
                for (index, world) in worlds.iter_mut().enumerate() {
                    for segment in tip_segments(world) {
                        push(world, &mut *stepper, index, segment, wrench);
                    }
                }
                for _ in 0..HALF / LOOK {
                    stepper.advance(LOOK);
                    stepper.wait().unwrap();
                    for (index, world) in worlds.iter_mut().enumerate() {
                        (0..LOOK).for_each(|_| assert_eq!(world.step(), []));
                        let errors = Errors::of(world, &state(&mut *stepper, world, index));
                        worst = worst.max(errors);
                        assert!(
                            tolerance.admits(errors),
                            "{}, {kind}, world {index}: {errors:?}",
                            backend.name
                        );
                    }
                }
            }
            println!("{}, {kind}: at most {worst:?}", backend.name);
            assert_eq!(stepper.events().unwrap(), [], "{}", backend.name);
            for index in 0..worlds.len() {
                assert_eq!(stepper.status(index).unwrap(), Status::Running);
            }
        }
    }
}
