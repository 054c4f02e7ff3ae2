//! Wind on the worlds of a tile, once a frame and lane by lane in f64: the rule of the f64 world.

use super::{Push, Tile};
use crate::layout::fruit;
use orchard_geometry::Vec3;
use orchard_multibody::forward_kinematics;

impl Tile {
    /// Sets the forces of the air on wood and hanging fruit, and the drag that damps them, for the next frame.
    pub(super) fn blow(&mut self) {
        for lane in 0..self.worlds.len() {
            if self.worlds[lane].is_running() {
                self.blow_on(lane);
            }
        }
    }

    fn blow_on(&mut self, lane: usize) {
        let plant = self.worlds[lane].plant.clone();
        let Some(weather) = &plant.weather else { return };
        let mut data = self.worlds[lane].take_shadow();
        self.store(lane, &mut data);
        data.body_force_world.fill(Vec3::zeros());
        forward_kinematics(&plant.model, &mut data);
        let world = &self.worlds[lane];
        let time = (i64::from(self.frame) - world.began) as f64 * plant.spec.sim.frame();
        weather.blow(&plant.tree, plant.fruit.balls(), &world.rupture, &plant.model, &mut data, time);
        self.load_wood(lane, &data);
        self.gusts.retain(|gust| gust.lane != lane);
        for (row, &segment) in self.worlds[lane].walk.links.iter().enumerate() {
            let force_world = data.body_force_world[plant.tree.bodies[segment].index()];
            if force_world != Vec3::zeros() {
                self.gusts.push(Push { row, lane, force_world, torque_world: Vec3::zeros() });
            }
        }
        for (i, point) in plant.fruit.points.iter().enumerate() {
            let row = self.worlds[lane].fruit_row[i];
            let force = self.worlds[lane].pulls[i] + data.point_force_world[point.index()];
            for k in 0..3 {
                *self.fruit_mut(row, fruit::FORCE + k, lane) = force[k] as f32;
            }
        }
        self.worlds[lane].keep_shadow(data);
        self.is_stale = true;
    }
}
