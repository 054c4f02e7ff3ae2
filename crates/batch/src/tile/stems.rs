//! Stems that bend, lane by lane: loading, wear and storing.

use super::Tile;
use crate::layout::{stem, stem_work};
use crate::stem_motion::StemMotion;
use crate::tree_world::Plant;
use orchard_fruit::{StemLoad, least_load};
use orchard_geometry::Vec3;
use orchard_multibody::{Data, forward_kinematics};

/// Constants of the elimination of a fruit's stem, which change when the fruit comes off.
fn inertias(plant: &Plant, data: &Data, fruit: usize) -> Vec<(usize, f64)> {
    let (Some(id), point) = (plant.fruit.stem(fruit), plant.fruit.points[fruit]) else { return Vec::new() };
    let (h, dofs, mass) = (plant.settings.h, plant.model.dofs(id), plant.model.point(point).mass);
    let tether = plant.model.point(point).tether.as_ref();
    let hangs = tether.filter(|_| data.tethered[point.index()]);
    let kappa = hangs.map_or(0.0, |tether| h * (tether.damping + h * tether.stiffness));
    let length = tether.map_or(0.0, |tether| tether.p_body.z);
    let [bend, twist] =
        [0, 2].map(|k| h * (data.damping[dofs.start + k] + h * data.stiffness[dofs.start + k]));
    let inertia = plant.model.body(id).inertia.i_com[(0, 0)];
    let inverse_mass = 1.0 / (mass + kappa);
    let added = mass * kappa * inverse_mass;
    let (lever, swing) = (added * length, inertia + added * length * length);
    let [i_bend, i_twist] = [1.0 / (swing + bend), 1.0 / (inertia + twist)];
    let across = added - lever * lever * i_bend;
    let coupling = lever * bend * i_bend;
    let reach = if across > 0.0 { coupling / across } else { 0.0 };
    let left = swing * bend * i_bend - coupling * reach;
    vec![
        (stem::ARMATURE, bend),
        (stem::ARMATURE_EXCESS, twist - bend),
        (stem::INVERSE_MASS, inverse_mass),
        (stem::INVERSE, i_bend),
        (stem::INVERSE_EXCESS, i_twist - i_bend),
        (stem::SWING, swing),
        (stem::SWING_EXCESS, inertia - swing),
        (stem::LEVER, lever),
        (stem::SHARE, swing * i_bend),
        (stem::SHARE_EXCESS, inertia * i_twist - swing * i_bend),
        (stem::SHARE_SHIFT, lever * i_bend),
        (stem::MASS, across),
        (stem::REACH, reach),
        (stem::MASS_ALONG, added - across),
        (stem::ACROSS, left),
        (stem::EXCESS, inertia * twist * i_twist - left),
    ]
}

impl Tile {
    pub(super) fn has_stems(&self) -> bool {
        !self.numbers.stems.as_slice().is_empty()
    }

    /// Fills a lane's stems with links that have no effect and never move.
    pub(super) fn pad_stems(&mut self, lane: usize) {
        for row in 0..self.numbers.schedule.fruit_rows() {
            for (field, number) in
                [(stem::REST + 2, 1.0), (stem::Q + 3, 1.0), (stem::LEAST_LOAD, f32::INFINITY)]
            {
                *self.stem_mut(row, field, lane) = number;
            }
        }
    }

    /// Loads the stem of a fruit into a lane.
    pub(super) fn load_stem(&mut self, lane: usize, plant: &Plant, data: &Data, fruit: usize) {
        let (Some(id), Some(spec)) = (plant.fruit.stem(fruit), &plant.spec.fruit.stem) else { return };
        let (row, h) = (self.worlds[lane].fruit_row[fruit], plant.settings.h);
        let (body, grown) = (plant.model.body(id), &plant.fruit.fruit[fruit]);
        let Some(motion) = StemMotion::of(plant, data, fruit) else { return };
        let point = plant.fruit.points[fruit];
        let Some(tether) = &plant.model.point(point).tether else { return };
        let rule = &spec.release;
        let stiffness = &data.stiffness[plant.model.dofs(id)];
        let mut numbers = vec![
            (stem::LENGTH, tether.p_body.z),
            (stem::H_INERTIA, h * body.inertia.i_com[(0, 0)]),
            (stem::H_BENDING, h * stiffness[0]),
            (stem::H_TWISTING, h * stiffness[2]),
            (stem::TWISTING, stiffness[2]),
            (stem::PER_PULL, 1.0 / grown.detach_force),
            (stem::PER_BEND, 1.0 / (rule.bent.si() * grown.detach_force)),
            (stem::PER_TWIST, 1.0 / grown.twist_strength),
            (stem::PER_SPUR, 1.0 / grown.spur_strength),
        ];
        numbers.extend((0..3).map(|k| (stem::REST + k, motion.rest[k])));
        numbers.extend((0..4).map(|k| (stem::Q + k, motion.rotation[k])));
        numbers.extend((0..3).map(|k| (stem::V + k, motion.rate[k])));
        if data.tethered[point.index()] {
            let least = least_load(rule);
            numbers.extend([(stem::STIFFNESS, tether.stiffness), (stem::LEAST_LOAD, least * least)]);
        } else {
            numbers.extend([(stem::STIFFNESS, 0.0), (stem::LEAST_LOAD, f64::INFINITY)]);
        }
        numbers.extend(inertias(plant, data, fruit));
        for (field, number) in numbers {
            *self.stem_mut(row, field, lane) = number as f32;
        }
    }

    /// Wears the stems whose load counts, by the rule of the f64 world.
    pub(super) fn wear_stems(&mut self) {
        let lanes = self.lanes;
        let work = self.numbers.stem_work.as_slice();
        for (lane, world) in self.worlds.iter_mut().enumerate().filter(|(_, world)| world.is_running()) {
            let plant = world.plant.clone();
            let Some(spec) = &plant.spec.fruit.stem else { continue };
            for (fruit, life) in world.stems.iter_mut().enumerate() {
                let row = world.fruit_row[fruit];
                let number = |field: usize| f64::from(work[(row * stem_work::FIELDS + field) * lanes + lane]);
                if number(stem_work::OVER) <= 0.0 {
                    continue;
                }
                let [tension, along, across, torque] = [0, 1, 2, 3].map(|k| number(stem_work::LOAD + k));
                let load = StemLoad { tension, along, across, torque };
                let grown = &plant.fruit.fruit[fruit];
                self.is_counting |= life.bear(&load, grown, &spec.release, plant.settings.h);
            }
        }
    }

    /// Takes the fruit off the stems that gave way in this frame.
    pub(super) fn take_off_stems(&mut self) {
        for lane in 0..self.worlds.len() {
            for fruit in 0..self.worlds[lane].stems.len() {
                let Some((release, _)) = self.worlds[lane].stems[fruit].take_gave_way() else { continue };
                let row = self.worlds[lane].fruit_row[fruit];
                let mut data = self.worlds[lane].take_shadow();
                self.store(lane, &mut data);
                let plant = self.worlds[lane].plant.clone();
                forward_kinematics(&plant.model, &mut data);
                let w_world =
                    plant.fruit.stem(fruit).map_or_else(Vec3::zeros, |id| data.velocity(id).angular);
                data.tethered[plant.fruit.points[fruit].index()] = false;
                let off = [(stem::STIFFNESS, 0.0), (stem::LEAST_LOAD, f64::INFINITY)];
                for (field, number) in inertias(&plant, &data, fruit).into_iter().chain(off) {
                    *self.stem_mut(row, field, lane) = number as f32;
                }
                self.worlds[lane].keep_shadow(data);
                self.take_off(lane, row, w_world, Some(release));
            }
        }
    }

    /// Writes rotation and rate of the stem of a lane's fruit.
    pub(super) fn store_stem(&self, lane: usize, fruit: usize, data: &mut Data) {
        let world = &self.worlds[lane];
        if world.plant.fruit.stem(fruit).is_some() {
            let number = |field: usize| f64::from(self.stem(world.fruit_row[fruit], field, lane));
            let rotation = std::array::from_fn(|k| number(stem::Q + k));
            let rate = Vec3::from_fn(|k, _| number(stem::V + k));
            StemMotion::store(&world.plant, data, fruit, rotation, rate);
        }
    }

    /// A stem's number of a lane's world, quarantined or not.
    pub(super) fn stem(&self, row: usize, field: usize, lane: usize) -> f32 {
        let at = row * stem::FIELDS + field;
        match self.worlds[lane].remains() {
            Some(remains) => remains.stems[at],
            None => self.numbers.stems.as_slice()[at * self.lanes + lane],
        }
    }

    fn stem_mut(&mut self, row: usize, field: usize, lane: usize) -> &mut f32 {
        &mut self.numbers.stems.as_mut_slice()[(row * stem::FIELDS + field) * self.lanes + lane]
    }
}
