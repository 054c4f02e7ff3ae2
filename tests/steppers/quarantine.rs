//! Worlds with a number that is not finite.

use super::backends::backends;
use super::trees::{bits, grown, kick, state};
use orchard_batch::{BatchEvent, Fault, Quarantine, Status, TreeEvent, TreeWorld};

/// Frames of a run.
const FRAMES: u32 = 3;
/// World with the fault.
const ILL: usize = 1;

fn worlds() -> Vec<TreeWorld> {
    let mut worlds = grown(3);
    kick(&mut worlds, 0.5);
    worlds
}

/// A joint rate that is not a number: the world is reported once, at the end of the frame, and stands still; its neighbours keep their bits.
#[test]
fn a_world_that_is_not_finite_is_taken_out() {
    let healthy = worlds();
    let mut worlds = worlds();
    worlds[ILL].data_mut().v[6] = f64::NAN;
    for backend in backends() {
        let name = &backend.name;
        let [mut stepper, mut neighbours] = [&worlds, &healthy].map(|worlds| backend.build(worlds));
        stepper.advance(FRAMES);
        neighbours.advance(FRAMES);
        let [stop] = stepper.events().unwrap()[..] else { panic!("{name}: one event was expected") };
        let BatchEvent { frame: 1, world: ILL, event: TreeEvent::Quarantined { fault } } = stop else {
            panic!("{name}: {stop:?}")
        };
        assert!(matches!(fault, Fault::Joint { .. }), "{name}: {fault:?}");
        let stopped = Status::Quarantined(Quarantine { frame: 1, fault });
        assert_eq!(stepper.status(ILL).unwrap(), stopped, "{name}");
        let found = bits(&state(&mut *stepper, &worlds[ILL], ILL));
        for index in [0, 2] {
            assert_eq!(stepper.status(index).unwrap(), Status::Running, "{name}");
            let [beside, truth] =
                [&mut stepper, &mut neighbours].map(|all| bits(&state(&mut **all, &healthy[index], index)));
            assert_eq!(beside, truth, "{name}, world {index}");
        }
        stepper.advance(1);
        assert_eq!(stepper.events().unwrap(), [], "{name}");
        assert_eq!(bits(&state(&mut *stepper, &worlds[ILL], ILL)), found, "{name}");
    }
}
