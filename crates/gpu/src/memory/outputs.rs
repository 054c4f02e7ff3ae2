//! Results of a world on the host: status, losses and state.

use orchard_batch::{Fault, Plant, Quarantine, Status, StemMotion};
use orchard_fruit::Release;
use orchard_geometry::Vec3;
use orchard_multibody::Data;

use super::{Memory, Place};
use crate::layout::{fruit, link, rod, state, world};

/// Way in which a stem gave way ([`rod::RELEASE`]); `None` while it holds.
fn release_of(bits: u32) -> Option<Release> {
    const WAYS: [Release; 4] = [Release::Pull, Release::Bend, Release::Twist, Release::Spur];
    bits.checked_sub(1).and_then(|way| WAYS.get(way as usize).copied())
}

impl Memory {
    /// Status of a world.
    pub fn status(&self, index: usize) -> Status {
        let place = &self.places[index];
        let frame = self.worlds[self.world_at(place.tile, world::STOPPED, place.lane)].to_bits();
        if frame == 0 {
            return Status::Running;
        }
        let bad = |x: f32| !(x * x).is_finite();
        let joint = (0..place.rows.len()).find(|&segment| {
            (link::Q..link::Q + 4).any(|field| {
                bad(self.links[self.link_at(place.tile, place.rows[segment], field, place.lane)])
            })
        });
        let of_stem = if self.laws.stems { rod::Q..rod::ZONE_WEAR } else { 0..0 };
        let fruit = || {
            (0..place.fruit_rows.len()).find(|&i| {
                (fruit::P..fruit::P + 6).chain(of_stem.clone()).any(|field| {
                    bad(self.fruit[self.fruit_at(place.tile, place.fruit_rows[i], field, place.lane)])
                })
            })
        };
        let fault = match joint {
            Some(segment) => Fault::Joint { segment },
            None => Fault::Fruit { fruit: fruit().unwrap_or_default() },
        };
        Status::Quarantined(Quarantine { frame, fault })
    }

    /// Frames in which each joint of a world broke, and in which each fruit came off, and how; frame 0 if that has not happened.
    pub fn lost(&self, index: usize) -> (Vec<u32>, Vec<(u32, Option<Release>)>) {
        let Place { tile, lane, rows, fruit_rows, .. } = &self.places[index];
        let broke = rows.iter().map(|&row| self.states[self.operation_at(*tile, row, *lane)] >> state::BROKE);
        let off = fruit_rows.iter().map(|&row| {
            let bits = |field: usize| self.fruit[self.fruit_at(*tile, row, field, *lane)].to_bits();
            let release = if self.laws.stems { release_of(bits(rod::RELEASE)) } else { None };
            (bits(fruit::CAME_OFF), release)
        });
        (broke.collect(), off.collect())
    }

    /// Writes a world's state into the f64 state of its model.
    pub fn store(&self, index: usize, plant: &Plant, data: &mut Data) {
        let Place { tile, lane, rows, fruit_rows, .. } = &self.places[index];
        for (segment, &row) in rows.iter().enumerate() {
            let id = plant.tree.bodies[segment];
            let number = |field: usize| f64::from(self.links[self.link_at(*tile, row, field, *lane)]);
            let bits = self.states[self.operation_at(*tile, row, *lane)];
            let (dof, q) = (plant.model.dofs(id).start, plant.model.qs(id).start);
            for k in 0..2 {
                data.q[q + k] = number(link::Q + k);
                data.v[dof + k] = number(link::V + k);
                if bits & state::BROKEN as u32 != 0 {
                    data.stiffness[dof + k] = 0.0;
                }
            }
            if bits & state::DEBRIS as u32 != 0 {
                let wood = &plant.spec.wood;
                data.linear_drag[id.index()] = wood.linear_drag.si() * wood.broken_linear_drag_scale.si();
                data.angular_drag[id.index()] = wood.angular_drag.si() * wood.broken_angular_drag_scale.si();
            }
        }
        for (i, &row) in fruit_rows.iter().enumerate() {
            let point = plant.fruit.points[i].index();
            let number = |field: usize| f64::from(self.fruit[self.fruit_at(*tile, row, field, *lane)]);
            let vector = |field: usize| Vec3::from_fn(|k, _| number(field + k));
            data.point_p_world[point] = vector(fruit::P);
            data.point_v_world[point] = vector(fruit::V);
            if self.laws.stems {
                let rotation = [0, 1, 2, 3].map(|k| number(rod::Q + k));
                StemMotion::store(plant, data, i, rotation, vector(rod::RATE));
            }
            data.tethered[point] = number(fruit::STIFFNESS) != 0.0 && number(fruit::CAME_OFF) == 0.0;
            if !data.tethered[point] {
                data.point_w_world[point] = vector(fruit::ARM);
                data.point_quadratic_drag[point] = number(fruit::AIR_DRAG);
                data.groups[plant.fruit.colliders[i].index()] = plant.fruit.groups.loose;
            }
        }
        plant.fruit.weigh_on(data, |segment| {
            self.states[self.operation_at(*tile, rows[segment], *lane)] & state::DEBRIS as u32 != 0
        });
    }
}
