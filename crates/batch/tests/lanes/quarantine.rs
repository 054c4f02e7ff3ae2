//! A world that turns non-finite is reported and stands still; its neighbours keep their bits.

use crate::trees::{bits, drop_fruit, grown, kick, siblings, state, tip_over};
use orchard_batch::{Batch, BatchEvent, Fault, Isa, Quarantine, Status, TreeEvent, TreeWorld};
use orchard_geometry::Vec3;
use orchard_multibody::Data;

/// Frames between the looks at the neighbours, and their number.
const FRAMES: u32 = 15;
const LOOKS: u32 = 4;
/// A force [N] beyond anything that f32 can square.
const ENORMOUS: Vec3 = Vec3::new(0.0, 0.0, -1e30);

/// Ways to go wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ill {
    /// A joint angle that is NaN from the start.
    Angle,
    /// An infinite joint rate from the start.
    Rate,
    /// A loose fruit that is nowhere from the start.
    FruitPosition,
    /// A fruit that falls and whose spin is NaN: no vector holds it.
    FruitSpin,
    /// A branch pushed after a while.
    Push,
    /// A fruit pulled after a while.
    Pull,
    /// A tree that topples, pushed at its stump.
    Toppled,
}

/// The ills and the worlds that have them: two in the same tile, neighbours in all, last of the siblings, in tiles of
/// mixed topologies.
const ILLS: [(usize, Ill); 7] = [
    (1, Ill::Angle),
    (2, Ill::FruitSpin),
    (4, Ill::Rate),
    (6, Ill::Toppled),
    (8, Ill::Push),
    (9, Ill::FruitPosition),
    (11, Ill::Pull),
];

fn ill(world: usize) -> Option<Ill> {
    ILLS.into_iter().find(|(index, _)| *index == world).map(|(_, ill)| ill)
}

/// Worlds with breaks, loose fruit and debris, before any is corrupted.
fn orchard() -> Vec<TreeWorld> {
    let mut worlds = siblings(9);
    worlds.extend(grown(4));
    kick(&mut worlds, 1.0);
    for world in [2, 3, 9] {
        drop_fruit(&mut worlds[world], 0.5);
    }
    for world in [5, 6] {
        tip_over(&mut worlds[world], 4.0);
    }
    worlds
}

fn sicken(worlds: &mut [TreeWorld]) {
    for (index, ill) in ILLS {
        let plant = worlds[index].plant().clone();
        let point = plant.fruit.points[0].index();
        let data = worlds[index].data_mut();
        match ill {
            Ill::Angle => data.q[20] = f64::NAN,
            Ill::Rate => data.v[31] = f64::NEG_INFINITY,
            Ill::FruitPosition => data.point_p_world[point].x = f64::INFINITY,
            Ill::FruitSpin => data.point_w_world[point].y = f64::NAN,
            Ill::Push | Ill::Pull | Ill::Toppled => {}
        }
    }
}

/// Steps worlds, with the forces on the ill ones if there are any; the states at each look, the events, the batch.
fn run(worlds: &[TreeWorld], isa: Isa, are_ill: bool) -> (Vec<Vec<Data>>, Vec<BatchEvent>, Batch) {
    let mut batch = Batch::with_isa(worlds, isa).unwrap();
    for toppled in [5, 6] {
        batch.break_branch(toppled, 2);
    }
    let (mut looks, mut events) = (Vec::new(), Vec::new());
    for look in 0..LOOKS {
        if look == 1 && are_ill {
            batch.push(8, 17, ENORMOUS, Vec3::zeros());
            batch.push(6, 0, ENORMOUS, Vec3::zeros());
            batch.pull(11, 3, ENORMOUS);
        }
        events.extend(batch.step(FRAMES));
        looks.push(worlds.iter().enumerate().map(|(index, world)| state(&mut batch, world, index)).collect());
    }
    (looks, events, batch)
}

#[test]
fn neighbours_of_a_world_that_goes_wrong_keep_their_bits() {
    let healthy = orchard();
    let mut worlds = orchard();
    sicken(&mut worlds);
    for isa in Isa::available() {
        let (expected, expected_events, _) = run(&healthy, isa, false);
        let (looks, events, batch) = run(&worlds, isa, true);
        for (look, (ours, theirs)) in looks.iter().zip(&expected).enumerate() {
            for index in (0..worlds.len()).filter(|index| ill(*index).is_none()) {
                assert_eq!(bits(&ours[index]), bits(&theirs[index]), "{isa:?}, world {index}, look {look}");
                assert_eq!(batch.status(index), Status::Running);
            }
        }
        let of_the_healthy = |events: &[BatchEvent]| -> Vec<BatchEvent> {
            events.iter().copied().filter(|event| ill(event.world).is_none()).collect()
        };
        assert_eq!(of_the_healthy(&events), of_the_healthy(&expected_events), "{isa:?}");
    }
}

#[test]
fn a_world_that_goes_wrong_is_reported_once_at_the_end_of_the_frame() {
    let mut worlds = orchard();
    sicken(&mut worlds);
    for isa in Isa::available() {
        let (_, events, batch) = run(&worlds, isa, true);
        for (index, ill) in ILLS {
            let is_forced = matches!(ill, Ill::Push | Ill::Pull | Ill::Toppled);
            let frame = if is_forced { FRAMES + 1 } else { 1 };
            let Status::Quarantined(quarantine) = batch.status(index) else {
                panic!("{isa:?}: {ill:?} runs on");
            };
            println!("{isa:?}, {ill:?}: frame {}, {}", quarantine.frame, quarantine.fault);
            assert_eq!(quarantine.frame, frame, "{ill:?}");
            // All but a spin reaches the joints within the frame.
            let is_fruit = quarantine.fault == Fault::Fruit { fruit: 0 };
            assert_eq!(is_fruit, ill == Ill::FruitSpin, "{ill:?}");
            let reports: Vec<_> = events
                .iter()
                .filter(|e| e.world == index && matches!(e.event, TreeEvent::Quarantined { .. }))
                .collect();
            let Quarantine { frame, fault } = quarantine;
            assert_eq!(
                reports,
                [&BatchEvent { frame, world: index, event: TreeEvent::Quarantined { fault } }]
            );
            // Nothing happens to it any more.
            assert!(events.iter().all(|event| event.world != index || event.frame <= frame), "{ill:?}");
        }
    }
}

#[test]
fn a_world_in_quarantine_stands_still_whatever_is_asked_of_it() {
    let mut worlds = orchard();
    sicken(&mut worlds);
    let (looks, _, mut batch) = run(&worlds, Isa::best(), true);
    for (index, ill) in ILLS {
        let found = bits(&looks[1][index]);
        assert!(
            !looks[1][index].is_finite() || matches!(ill, Ill::Push | Ill::Pull | Ill::Toppled),
            "{ill:?}"
        );
        assert_eq!(bits(&looks[2][index]), found, "{ill:?}");
        batch.push(index, 3, Vec3::x(), Vec3::y());
        batch.pull(index, 2, Vec3::x());
        batch.break_branch(index, 10);
    }
    assert!(batch.step(FRAMES).iter().all(|event| ill(event.world).is_none()));
    let mut copy = batch.clone();
    copy.step(1);
    for (index, ill) in ILLS {
        assert_eq!(bits(&state(&mut batch, &worlds[index], index)), bits(&looks[1][index]), "{ill:?}");
        assert_eq!(bits(&state(&mut copy, &worlds[index], index)), bits(&looks[1][index]), "{ill:?}");
        assert_eq!(copy.status(index), batch.status(index));
    }
}
