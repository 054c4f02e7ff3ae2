//! Worlds whose numbers are no longer finite: found at the end of a frame, reported, and taken out of their lanes.

use super::{BatchEvent, Tile};
use crate::fault::{Fault, Quarantine};
use crate::kernel::Numbers;
use crate::lane_world::Remains;
use crate::layout::{Aligned, fruit, link, stem};
use crate::tree_world::TreeEvent;

impl Tile {
    /// Takes worlds whose state is no longer finite out of their lanes.
    pub(super) fn quarantine(&mut self) {
        for lane in 0..self.worlds.len() {
            if self.worlds[lane].is_running()
                && let Some(fault) = self.fault(lane)
            {
                self.take_out(lane, fault);
            }
        }
    }

    /// First part of a world that is no longer finite, if any.
    fn fault(&self, lane: usize) -> Option<Fault> {
        // By the square, as the vectors test it.
        let is_bad = |x: f32| !(x * x).is_finite();
        let world = &self.worlds[lane];
        let links = world.walk.links.iter().enumerate();
        let segment = links
            .filter(|(row, _)| (link::Q..link::V + 2).any(|field| is_bad(self.link(*row, field, lane))))
            .map(|(_, segment)| *segment)
            .min();
        let is_bad_fruit = |row: &usize| {
            (fruit::P..fruit::V + 3).any(|field| is_bad(self.fruit(*row, field, lane)))
                || (self.has_stems()
                    && (stem::Q..stem::V + 3).any(|field| is_bad(self.stem(*row, field, lane))))
        };
        segment
            .map(|segment| Fault::Joint { segment })
            .or_else(|| world.fruit_row.iter().position(is_bad_fruit).map(|fruit| Fault::Fruit { fruit }))
            .or_else(|| world.bad_spin().map(|fruit| Fault::Fruit { fruit }))
    }

    /// Copies a lane's state out and empties the lane.
    fn take_out(&mut self, lane: usize, fault: Fault) {
        let lanes = self.lanes;
        let column =
            |numbers: &Aligned| numbers.as_slice().iter().skip(lane).step_by(lanes).copied().collect();
        let Numbers { links, fruit, stems, stem_limits, .. } = &self.numbers;
        let remains = Remains {
            links: column(links),
            fruit: column(fruit),
            stems: column(stems),
            stem_limits: column(stem_limits),
        };
        let quarantine = Quarantine { frame: self.frame, fault };
        self.worlds[lane].quarantine(quarantine, remains);
        self.empty(lane);
        let event = TreeEvent::Quarantined { fault };
        self.events.push(BatchEvent { frame: self.frame, world: self.worlds[lane].index, event });
    }

    /// Removes a lane's numbers, counts and pushes, as if it had never had a world.
    pub(super) fn empty(&mut self, lane: usize) {
        let lanes = self.lanes;
        self.pushes.retain(|push| push.lane != lane);
        for counts in [&mut self.bend_frames, &mut self.stretch_frames, &mut self.pull_frames] {
            counts.iter_mut().skip(lane).step_by(lanes).for_each(|count| *count = 0);
        }
        let Numbers { links, fruit, stems, tip_motion, props, bend_limits, stem_limits, .. } =
            &mut self.numbers;
        for (numbers, padding) in [
            (links, 0.0),
            (fruit, 0.0),
            (stems, 0.0),
            (tip_motion, 0.0),
            (props, 0.0),
            (bend_limits, f32::INFINITY),
            (stem_limits, f32::INFINITY),
        ] {
            numbers.as_mut_slice().iter_mut().skip(lane).step_by(lanes).for_each(|x| *x = padding);
        }
        self.calm(lane);
        self.pad(lane);
        self.is_stale = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::Isa;
    use crate::kernel::{Found, Phase};
    use crate::tree_world::TreeWorld;
    use orchard_geometry::Vec3;
    use orchard_spec::Spec;
    use std::sync::Arc;

    /// After a quarantine the tile is as fast as one with an empty lane: the tests at the end of a frame have no
    /// finding, no angle needs reduction, and all numbers of the lane are finite.
    #[test]
    fn nothing_of_a_world_in_quarantine_is_left_in_the_vectors() {
        let spec = Arc::new(Spec::paper());
        let worlds: Vec<TreeWorld> =
            (0..3).map(|index| TreeWorld::grow(spec.clone(), 1, index).unwrap()).collect();
        for isa in Isa::available() {
            let members: Vec<_> = worlds.iter().enumerate().collect();
            let mut tile = Tile::new(isa, &members);
            // With limbs in their fall, so that there are props as well.
            (0..worlds.len()).for_each(|lane| tile.break_joint(lane, worlds[lane].plant().tree.len() / 2));
            tile.run(10);
            tile.push(1, 4, Vec3::new(1e30, 0.0, 0.0), Vec3::zeros());
            tile.run(1);
            assert!(!tile.worlds[1].is_running());
            tile.run(60);
            assert_eq!(tile.work(Phase::Test, false), Found::default(), "{isa:?}");
            assert!(!tile.is_counting && tile.pushes.is_empty());
            let Numbers { links, work, fruit, fruit_work, tips, changes, loads, tip_motion, props, .. } =
                &tile.numbers;
            assert!(!props.as_slice().is_empty());
            for numbers in [links, work, fruit, fruit_work, tips, changes, loads, tip_motion, props] {
                let lane = numbers.as_slice().iter().skip(1).step_by(tile.lanes);
                assert!(lane.clone().all(|x| x.is_finite() && x.abs() <= 1.0), "{isa:?}");
            }
        }
    }
}
