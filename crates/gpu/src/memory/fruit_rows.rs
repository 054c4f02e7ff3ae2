//! Fruit in a tile: their rows and their numbers.

use std::ops::Range;

use orchard_batch::{Plant, StemMotion, TreeWorld};
use orchard_multibody::Data;

use super::{Member, Memory, quad_at};
use crate::laws::Laws;
use crate::layout::{LANES, UNBOUNDED, fruit, pull, rod};
use crate::schedule::MOST_FRUIT_ROWS;

/// Mass in a row without fruit, which keeps its inverse finite [kg].
pub(super) const PADDING_MASS: f32 = 1.0;

/// Frame in which a fruit counts as come off that is moved by others, as [`Data::point_carried`] tells: the robot does not meet it here.
const CARRIED: u32 = 1;

/// First row of each link's fruit in a tile, in the order of a schedule's visits, and the number of rows. In worlds of one topology, fruit on the same link have the same rows, though
/// some worlds lack some fruit. `None` if the rows are not shared, since there are several topologies or too many rows.
pub(super) fn shared_rows(members: &[Member<'_>]) -> Option<(Vec<usize>, usize)> {
    let (&(_, first, schedule), others) = members.split_first()?;
    let parent = &first.plant().tree.parent;
    if others.iter().any(|(_, other, _)| other.plant().tree.parent != *parent) {
        return None;
    }
    let mut most = schedule.fruit_by_visit();
    for (_, _, other) in others {
        most.iter_mut().zip(other.fruit_by_visit()).for_each(|(most, count)| *most = count.max(*most));
    }
    let mut rows = 0;
    let starts = most.into_iter().map(|count| {
        rows += count;
        rows - count
    });
    let starts = starts.collect();
    (rows <= MOST_FRUIT_ROWS).then_some((starts, rows))
}

impl Memory {
    /// Sets the mass of the rows of a block that have no fruit.
    pub(super) fn pad_fruit(&mut self, rows: Range<usize>) {
        for (row, lane) in rows.flat_map(|row| (0..LANES).map(move |lane| (row, lane))) {
            let mass = quad_at(row * self.laws.fruit_fields() + fruit::MASS, lane);
            if self.fruit[mass] == 0.0 {
                self.fruit[mass] = PADDING_MASS;
            }
        }
    }
}

/// Fields of a world's fruit and their values.
pub(super) fn numbers(given: &TreeWorld, i: usize) -> Vec<(usize, f64)> {
    let (plant, data): (&Plant, &Data) = (given.plant(), given.data());
    let id = plant.fruit.points[i];
    let (grown, point, at) = (&plant.fruit.fruit[i], plant.model.point(id), id.index());
    let mut numbers = vec![
        (fruit::MASS, point.mass),
        (fruit::RADIUS, grown.radius),
        (fruit::THRESHOLD, grown.detach_force),
        (fruit::AIR_DRAG, plant.fruit.air_drag(i)),
        (fruit::CAP, f64::from(UNBOUNDED)),
    ];
    let laws = Laws::of(plant);
    if let Some(weather) = &plant.weather {
        let of_air = weather.sail().places().of_segment(grown.segment);
        numbers.push((laws.pull_field() + pull::PLACE, f64::from(f32::from_bits(of_air as u32))));
    }
    for k in 0..3 {
        let force = data.point_force_world[at][k];
        numbers.push((fruit::FORCE + k, force));
        if laws.wind {
            numbers.push((laws.pull_field() + k, force));
        }
        numbers.push((fruit::P + k, data.point_p_world[at][k]));
        numbers.push((fruit::V + k, data.point_v_world[at][k]));
    }
    let hangs = data.tethered[at];
    if !hangs {
        numbers.extend((0..3).map(|k| (fruit::ARM + k, data.point_w_world[at][k])));
    }
    if data.point_carried[at] {
        numbers.push((fruit::CAME_OFF, f64::from(f32::from_bits(CARRIED))));
    }
    let Some(tether) = &point.tether else { return numbers };
    if let Some(motion) = StemMotion::of(plant, data, i) {
        numbers.push((fruit::DROP, -tether.p_body.z));
        numbers.extend(on_rod(plant, i, motion));
        let [zone, spur] = given.fruit_lives().wear(i);
        numbers.extend([(rod::ZONE_WEAR, zone), (rod::SPUR_WEAR, spur)]);
        if hangs {
            numbers.extend([(fruit::STIFFNESS, tether.stiffness), (fruit::DAMPING, tether.damping)]);
        }
    } else if hangs {
        numbers.extend([
            (fruit::DROP, tether.offset_world.z),
            (fruit::CAP, data.reaction_cap[at].min(f64::from(UNBOUNDED))),
            (fruit::BIAS, data.anchor_bias_world[at].z),
            (fruit::STIFFNESS, tether.stiffness),
            (fruit::DAMPING, tether.damping),
        ]);
        numbers.extend((0..3).map(|k| (fruit::ANCHOR + k, tether.p_body[k])));
    }
    numbers
}

/// Fields of a fruit's rod, which stays when the fruit has come off.
fn on_rod(plant: &Plant, i: usize, motion: StemMotion) -> Vec<(usize, f64)> {
    let (Some(id), grown) = (plant.fruit.stem(i), &plant.fruit.fruit[i]) else { return Vec::new() };
    let [bending, twisting] = plant.fruit.stem_damping(i);
    let mut numbers = vec![
        (rod::BENDING_DAMPING, bending),
        (rod::TWISTING_DAMPING, twisting),
        (rod::PER_TWIST, 1.0 / grown.twist_strength),
        (rod::PER_SPUR, 1.0 / grown.spur_strength),
    ];
    let anchor = plant.model.body(id).x_parent_joint.translation.vector;
    for k in 0..3 {
        numbers.push((fruit::ANCHOR + k, anchor[k]));
        numbers.push((rod::RATE + k, motion.rate[k]));
        numbers.push((rod::REST + k, motion.rest[k]));
    }
    numbers.extend((0..4).map(|k| (rod::Q + k, motion.rotation[k])));
    numbers
}
