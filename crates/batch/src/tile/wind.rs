//! Wind on the worlds of a tile: what it takes hold of, and the air of the next frame.

use super::Tile;
use crate::breeze::Breeze;
use crate::kernel::{Air, Gusts};
use crate::layout::{air, ball, fruit, link};
use crate::schedule::Walk;
use crate::tree_world::TreeWorld;
use orchard_multibody::Data;

/// The air of a lane's world, and the sample of each of its places.
#[derive(Debug, Clone)]
pub(super) struct LaneAir {
    breeze: Breeze,
    samples: Vec<usize>,
}

impl LaneAir {
    pub fn bytes(&self) -> usize {
        self.breeze.bytes()
    }
}

/// Rows of the first links of a world's places, by place; empty in still air.
fn starts(world: &TreeWorld, walk: &Walk) -> Vec<usize> {
    let Some(weather) = &world.plant().weather else { return Vec::new() };
    let places = weather.sail().places();
    let mut starts = vec![0; places.p_world().len()];
    // Parents stand before their children.
    for (row, &segment) in walk.links.iter().enumerate().rev() {
        starts[places.of_segment(segment)] = row;
    }
    starts
}

impl Tile {
    /// Makes room for the air of worlds in wind, with their walks.
    pub(super) fn expect_wind(&mut self, worlds: &[(usize, &TreeWorld)], walks: &[Walk]) {
        if worlds.iter().all(|(_, world)| world.plant().weather.is_none()) {
            return;
        }
        let starts: Vec<Vec<usize>> =
            worlds.iter().zip(walks).map(|((_, world), walk)| starts(world, walk)).collect();
        let mut air = Air::new(&self.numbers.schedule, self.lanes, &starts);
        for (lane, ((_, world), starts)) in worlds.iter().zip(starts).enumerate() {
            let plant = world.plant();
            let folding_speed = plant.spec.wind.as_ref().map_or(0.0, |wind| wind.folding_speed.si());
            air.folding_speed.as_mut_slice()[lane] = folding_speed as f32;
            self.airs.push(plant.weather.as_ref().map(|weather| LaneAir {
                breeze: Breeze::new(weather, plant.spec.sim.frame()),
                samples: starts.iter().filter_map(|row| air.sample_of_row[*row]).collect(),
            }));
        }
        let weathers = worlds.iter().filter_map(|(_, world)| world.plant().weather.as_ref());
        self.scratch =
            Gusts::scratch(weathers.map(|weather| weather.wind().waves().count()).max().unwrap_or(0));
        self.numbers.air = Some(air);
    }

    /// Sets the air of a frame of the tile.
    pub(super) fn sample_air(&mut self, frame: u32) {
        let Some(air) = &mut self.numbers.air else { return };
        let samples = air.samples.as_mut_slice();
        for (lane, (world, own)) in self.worlds.iter().zip(&mut self.airs).enumerate() {
            let Some(LaneAir { breeze, samples: own }) = own.as_mut().filter(|_| world.is_running()) else {
                continue;
            };
            let clock = i64::from(frame) - world.began;
            if let Some(gusts) = breeze.advance_to(clock, &mut self.scratch) {
                self.isa.run(gusts);
            }
            let [x, y, z] = breeze.at(clock);
            for (&sample, ((x, y), z)) in own.iter().zip(x.iter().zip(y).zip(z)) {
                let to = &mut samples[sample * 3 * self.lanes..][..3 * self.lanes];
                (to[lane], to[self.lanes + lane], to[2 * self.lanes + lane]) = (*x, *y, *z);
            }
        }
    }

    fn air_mut(&mut self, row: usize, field: usize, lane: usize) -> Option<&mut f32> {
        let at = (row * air::FIELDS + field) * self.lanes + lane;
        self.numbers.air.as_mut().map(|air| &mut air.links.as_mut_slice()[at])
    }

    fn ball_mut(&mut self, fruit_row: usize, field: usize, lane: usize) -> Option<&mut f32> {
        let at = (fruit_row * ball::FIELDS + field) * self.lanes + lane;
        self.numbers.air.as_mut().map(|air| &mut air.balls.as_mut_slice()[at])
    }

    /// Loads what the wind takes hold of on the links of a lane, after the numbers of the wood in still air.
    pub(super) fn load_sails(&mut self, lane: usize) {
        if self.numbers.air.is_none() {
            return;
        }
        for row in 0..self.worlds[lane].walk.links.len() {
            let world = &self.worlds[lane];
            let segment = world.walk.links[row];
            let weather = world.plant.weather.as_ref().filter(|_| !world.rupture.is_debris(segment));
            let [wood, leaves] = weather.map_or([0.0; 2], |weather| weather.sail().of(segment));
            let still = |field: usize| self.link(row, field, lane);
            let h_mass = still(link::H_MASS);
            let numbers = [
                (air::WOOD, wood as f32),
                (air::LEAVES, leaves as f32),
                (air::STILL, still(link::LINEAR_DRAG)),
                (air::PER_H_MASS, 1.0 / h_mass),
                (air::ACROSS, still(link::ACROSS)),
                (air::ALONG, still(link::ALONG)),
            ];
            for (field, number) in numbers {
                if let Some(to) = self.air_mut(row, field, lane) {
                    *to = number;
                }
            }
        }
    }

    /// Loads what the wind takes hold of on a fruit, and what pulls at it.
    pub(super) fn load_ball(&mut self, lane: usize, i: usize, data: &Data) {
        let (row, plant) = (self.worlds[lane].fruit_row[i], self.worlds[lane].plant.clone());
        let point = plant.fruit.points[i].index();
        let weather = plant.weather.as_ref().filter(|_| data.tethered[point]);
        let drag = weather.map_or(0.0, |weather| weather.of_ball(plant.fruit.fruit[i].radius));
        let pull = data.point_force_world[point];
        for (field, number) in
            [(ball::DRAG, drag), (ball::PULL, pull.x), (ball::PULL + 1, pull.y), (ball::PULL + 2, pull.z)]
        {
            if let Some(to) = self.ball_mut(row, field, lane) {
                *to = number as f32;
            }
        }
    }

    /// A number of the force that is applied to a fruit: in wind, without the wind's.
    pub(super) fn pull_mut(&mut self, fruit_row: usize, axis: usize, lane: usize) -> &mut f32 {
        let lanes = self.lanes;
        let place = |fields: usize, first: usize| (fruit_row * fields + first + axis) * lanes + lane;
        match &mut self.numbers.air {
            Some(air) => &mut air.balls.as_mut_slice()[place(ball::FIELDS, ball::PULL)],
            None => &mut self.numbers.fruit.as_mut_slice()[place(fruit::FIELDS, fruit::FORCE)],
        }
    }

    /// Takes the wind off a fruit that has come off.
    pub(super) fn shelter(&mut self, fruit_row: usize, lane: usize) {
        if let Some(drag) = self.ball_mut(fruit_row, ball::DRAG, lane) {
            *drag = 0.0;
        }
    }

    /// Removes a lane's air.
    pub(super) fn calm(&mut self, lane: usize) {
        let lanes = self.lanes;
        if let Some(air) = &mut self.numbers.air {
            for numbers in [&mut air.links, &mut air.balls, &mut air.samples] {
                numbers.as_mut_slice().iter_mut().skip(lane).step_by(lanes).for_each(|x| *x = 0.0);
            }
        }
    }
}
