//! Stems that bend, lane by lane: loading, wear and storing.

use super::Tile;
use crate::layout::{link, stem, stem_work, work};
use crate::stem_motion::StemMotion;
use crate::tree_world::Plant;
use orchard_fruit::{StemLoad, least_load};
use orchard_geometry::Vec3;
use orchard_multibody::Data;

/// Numbers of a stem whose fruit is off.
const OFF: [(usize, f64); 4] = [
    (stem::STIFFNESS, 0.0),
    (stem::LEAST_LOAD, f64::INFINITY),
    (stem::ALERT_STRETCH, 0.0),
    (stem::ALERT_TWIST, 0.0),
];
/// Margin of the alert over the exact load, for round-off.
const ALERT: f64 = 1.001;

/// Constants of the elimination of a fruit's stem, which change when the fruit comes off: for its armatures in bending and twist [kg m^2], and whether it hangs.
fn inertias(plant: &Plant, fruit: usize, [bend, twist]: [f64; 2], hangs: bool) -> Vec<(usize, f64)> {
    let (Some(id), point) = (plant.fruit.stem(fruit), plant.fruit.points[fruit]) else { return Vec::new() };
    let (h, mass) = (plant.settings.h, plant.model.point(point).mass);
    let tether = plant.model.point(point).tether.as_ref();
    let kappa = tether.filter(|_| hangs).map_or(0.0, |tether| h * (tether.damping + h * tether.stiffness));
    let length = tether.map_or(0.0, |tether| tether.p_body.z);
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
        (stem::LEVER, lever),
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
        let dofs = plant.model.dofs(id);
        let (stiffness, damping) = (&data.stiffness[dofs.clone()], &data.damping[dofs]);
        let armatures = [0, 2].map(|k| h * (damping[k] + h * stiffness[k]));
        let (pull, bend) = (1.0 / grown.detach_force, 1.0 / (rule.bent.si() * grown.detach_force));
        let (twist, spur) = (1.0 / grown.twist_strength, 1.0 / grown.spur_strength);
        let mut numbers = vec![
            (stem::LENGTH, tether.p_body.z),
            (stem::INERTIA, body.inertia.i_com[(0, 0)]),
            (stem::H_BENDING, h * stiffness[0]),
            (stem::H_TWISTING, h * stiffness[2]),
            (stem::TWISTING, stiffness[2]),
            (stem::PER_PULL, pull),
            (stem::PER_BEND, bend),
            (stem::PER_TWIST, twist),
            (stem::PER_SPUR, spur),
        ];
        numbers.extend((0..3).map(|k| (stem::REST + k, motion.rest[k])));
        numbers.extend((0..4).map(|k| (stem::Q + k, motion.rotation[k])));
        numbers.extend((0..3).map(|k| (stem::V + k, motion.rate[k])));
        if data.tethered[point.index()] {
            let least = least_load(rule);
            numbers.extend([
                (stem::STIFFNESS, tether.stiffness),
                (stem::LEAST_LOAD, least * least),
                (stem::ALERT_STRETCH, ALERT * tether.stiffness * pull.max(bend).max(spur) / least),
                (stem::ALERT_TWIST, ALERT * stiffness[2] * twist / least),
            ]);
        } else {
            numbers.extend(OFF);
        }
        numbers.extend(inertias(plant, fruit, armatures, data.tethered[point.index()]));
        for (field, number) in numbers {
            *self.stem_mut(row, field, lane) = number as f32;
        }
    }

    /// Wears the stems whose load counts, by the rule of the f64 world.
    pub(super) fn wear_stems(&mut self) {
        let lanes = self.lanes;
        let work = self.numbers.stem_work.as_slice().chunks_exact(stem_work::FIELDS * lanes);
        for (row, work) in work.enumerate() {
            let number = |field: usize, lane: usize| work[field * lanes + lane];
            for lane in (0..lanes).filter(|&lane| number(stem_work::OVER, lane) > 0.0) {
                let world = &mut self.worlds[lane];
                let Some(fruit) = world.fruit_row.iter().position(|own| *own == row) else { continue };
                let plant = &world.plant;
                let Some(spec) = plant.spec.fruit.stem.as_ref().filter(|_| world.is_running()) else {
                    continue;
                };
                let [tension, along, across, torque] =
                    [0, 1, 2, 3].map(|k| f64::from(number(stem_work::LOAD + k, lane)));
                let load = StemLoad { tension, along, across, torque };
                let grown = &plant.fruit.fruit[fruit];
                self.is_counting |= world.stems[fruit].bear(&load, grown, &spec.release, plant.settings.h);
            }
        }
    }

    /// Takes the fruit off the stems that gave way in this frame.
    pub(super) fn take_off_stems(&mut self) {
        for lane in 0..self.worlds.len() {
            for fruit in 0..self.worlds[lane].stems.len() {
                let Some((release, _)) = self.worlds[lane].stems[fruit].take_gave_way() else { continue };
                let (row, w_world) = (self.worlds[lane].fruit_row[fruit], self.spin(lane, fruit));
                let [bend, excess] = [stem::ARMATURE, stem::ARMATURE_EXCESS]
                    .map(|field| f64::from(self.stem(row, field, lane)));
                let off = inertias(&self.worlds[lane].plant, fruit, [bend, bend + excess], false);
                for (field, number) in off.into_iter().chain(OFF) {
                    *self.stem_mut(row, field, lane) = number as f32;
                }
                self.take_off(lane, row, w_world, Some(release));
            }
        }
    }

    /// Angular velocity of the stem of a fruit [rad/s], world: its own rate in the axes of its link, and those of all joints down to the root.
    fn spin(&self, lane: usize, fruit: usize) -> Vec3 {
        let world = &self.worlds[lane];
        let segment = world.plant.fruit.fruit[fruit].segment;
        let work = self.numbers.work.as_slice();
        let vector = |row: usize, field: usize| {
            Vec3::from_fn(|k, _| f64::from(work[(row * work::FIELDS + field + k) * self.lanes + lane]))
        };
        let bears = world.walk.links.iter().position(|link| *link == segment);
        let mut w_world = bears.map_or_else(Vec3::zeros, |row| {
            let (y, z) = (vector(row, work::AXES + 3), vector(row, work::D).normalize());
            let v = Vec3::from_fn(|k, _| f64::from(self.stem(world.fruit_row[fruit], stem::V + k, lane)));
            y.cross(&z) * v.x + y * v.y + z * v.z
        });
        for row in std::iter::successors(bears, |&row| world.walk.parent[row]) {
            let rate = |k: usize| f64::from(self.link(row, link::V + k, lane));
            w_world += vector(row, work::AXES) * rate(0) + vector(row, work::AXES + 3) * rate(1);
        }
        w_world
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
