//! Copies a world's numbers into its lane, and out of it.

use super::{Push, Tile};
use crate::lane_world::Wood;
use crate::layout::{fruit, limit, link, tip};
use crate::schedule::WORLD_SLOT;
use crate::tree_world::TreeWorld;
use orchard_geometry::Vec3;
use orchard_multibody::Data;

/// Armature of a padding link: any value that keeps its pivot away from zero.
const PADDING_ARMATURE: f32 = 1.0;
/// Mass of a padding fruit: any value but zero.
const PADDING_MASS: f32 = 1.0;

impl Tile {
    /// Fills an empty lane with links and fruit that have no effect and never move.
    pub(super) fn pad(&mut self, lane: usize) {
        for row in 0..self.numbers.schedule.rows.len() {
            *self.link_mut(row, link::DIRECTION + 2, lane) = 1.0;
            *self.link_mut(row, link::ARMATURE, lane) = PADDING_ARMATURE;
        }
        for row in 0..self.numbers.schedule.fruit_rows() {
            *self.fruit_mut(row, fruit::MASS, lane) = PADDING_MASS;
        }
        for k in 0..3 {
            *self.world_frame_mut(tip::AXES + 4 * k, lane) = 1.0;
            *self.world_frame_mut(tip::P + k, lane) = 0.0;
        }
        if self.has_stems() {
            self.pad_stems(lane);
        }
    }

    /// A number of the world frame, the parent of the trunks.
    fn world_frame_mut(&mut self, field: usize, lane: usize) -> &mut f32 {
        &mut self.numbers.tips.as_mut_slice()[(WORLD_SLOT * tip::FIELDS + field) * self.lanes + lane]
    }

    /// Loads constants and state of a world into a lane.
    pub(super) fn load_lane(&mut self, lane: usize, world: &TreeWorld) {
        let plant = world.plant().clone();
        let (model, data, tree) = (&plant.model, world.data(), &plant.tree);
        for row in 0..self.worlds[lane].walk.links.len() {
            let segment = self.worlds[lane].walk.links[row];
            let id = tree.bodies[segment];
            let body = model.body(id);
            let direction = body.x_parent_joint.rotation * Vec3::z();
            if body.parent.is_none() {
                for k in 0..3 {
                    *self.world_frame_mut(tip::P + k, lane) =
                        body.x_parent_joint.translation.vector[k] as f32;
                }
            }
            let (h, i_com) = (plant.settings.h, &body.inertia.i_com);
            let constants = [
                (link::DIRECTION, direction.x),
                (link::DIRECTION + 1, direction.y),
                (link::DIRECTION + 2, direction.z),
                (link::FOLD, 1.0 / (1.0 + direction.z)),
                (link::LENGTH, 2.0 * body.inertia.p_com.z),
                (link::H_MASS, h * body.inertia.mass),
                (link::H_ACROSS, h * i_com[(0, 0)]),
                (link::H_EXCESS, h * (i_com[(2, 2)] - i_com[(0, 0)])),
            ];
            for (field, number) in constants {
                *self.link_mut(row, field, lane) = number as f32;
            }
            let (dof, q) = (model.dofs(id).start, model.qs(id).start);
            for k in 0..2 {
                *self.link_mut(row, link::Q + k, lane) = data.q[q + k] as f32;
                *self.link_mut(row, link::V + k, lane) = data.v[dof + k] as f32;
            }
            let (force_world, torque_world) =
                (data.body_force_world[id.index()], data.body_torque_world[id.index()]);
            if force_world != Vec3::zeros() || torque_world != Vec3::zeros() {
                self.pushes.push(Push { row, lane, force_world, torque_world });
            }
        }
        self.load_wood(lane, data);
        for i in 0..plant.fruit.len() {
            let (row, id) = (self.worlds[lane].fruit_row[i], plant.fruit.points[i]);
            let (h, point) = (plant.settings.h, model.point(id));
            let mut constants = vec![
                (fruit::MASS, point.mass),
                (fruit::H_WEIGHT, h * point.mass * -plant.settings.gravity.z),
                (fruit::AIR_DRAG, data.point_quadratic_drag[id.index()]),
            ];
            for k in 0..3 {
                constants.push((fruit::FORCE + k, data.point_force_world[id.index()][k]));
                constants.push((fruit::P + k, data.point_p_world[id.index()][k]));
                constants.push((fruit::V + k, data.point_v_world[id.index()][k]));
            }
            self.load_stem(lane, &plant, data, i);
            self.load_ball(lane, i, data);
            let stem = plant.fruit.stem(i);
            // The anchor of a fruit on a stem that bends is the joint of the stem, tethered or not.
            let on_link = stem.map(|stem| model.body(stem).x_parent_joint.translation.vector);
            for k in 0..3 {
                let anchor = on_link.or(point.tether.as_ref().map(|tether| tether.p_body));
                constants.push((fruit::ANCHOR + k, anchor.map_or(0.0, |anchor| anchor[k])));
            }
            if let Some(tether) = point.tether.as_ref().filter(|_| data.tethered[id.index()]) {
                constants.extend([
                    (fruit::DROP, tether.offset_world.z),
                    (fruit::H_CAP, h * data.reaction_cap[id.index()]),
                    (fruit::H_STIFFNESS, h * tether.stiffness),
                    (fruit::KAPPA, h * (tether.damping + h * tether.stiffness)),
                    (fruit::H_BIAS, h * data.anchor_bias_world[id.index()].z),
                ]);
                let threshold = plant.fruit.fruit[i].detach_force;
                let stretch = plant.spec.fruit.tension_factor.si() * threshold / tether.stiffness;
                // A stem that bends wears out instead; a finite limit says that the fruit hangs.
                let [stretch, pull] = match stem {
                    Some(_) => [f32::MAX; 2],
                    None => [stretch, threshold].map(|x| (x * x) as f32),
                };
                *self.stem_limit_mut(row, limit::STRETCH, lane) = stretch;
                *self.stem_limit_mut(row, limit::PULL, lane) = pull;
            }
            for (field, number) in constants {
                *self.fruit_mut(row, field, lane) = number as f32;
            }
            if !data.tethered[id.index()] {
                self.worlds[lane].let_loose(i, data.point_w_world[id.index()]);
            }
        }
        if !self.worlds[lane].rupture.breaks().is_empty() {
            self.expect_debris(lane);
        }
    }

    /// Loads what breaking changes: springs, dampers, drag, the fruit's load on the wood, and the joints that can still break.
    pub(super) fn load_wood(&mut self, lane: usize, data: &Data) {
        let plant = self.worlds[lane].plant.clone();
        for row in 0..self.worlds[lane].walk.links.len() {
            let segment = self.worlds[lane].walk.links[row];
            let id = plant.tree.bodies[segment];
            let dof = plant.model.dofs(id).start;
            // Wind has a drag of its own.
            let in_wind = plant.weather.as_ref().filter(|_| !self.worlds[lane].rupture.is_debris(segment));
            let linear = in_wind.map_or(data.linear_drag[id.index()], |weather| weather.sail().still_drag());
            let wood = Wood {
                drag: [linear, data.angular_drag[id.index()]],
                stiffness: data.stiffness[dof],
                damping: data.damping[dof],
                leads: plant.tree.is_modal,
            };
            self.worlds[lane].wood[row] = wood;
            let (h, inertia) = (plant.settings.h, &plant.model.body(id).inertia);
            let [linear, angular] = wood.drag;
            let mass = inertia.mass * (1.0 + h * linear);
            // Half a mass at either end of a rod has this inertia about the middle.
            let (ends, length) = (mass * inertia.p_com.z * inertia.p_com.z, 2.0 * inertia.p_com.z);
            let [across, axial] =
                [inertia.i_com[(0, 0)], inertia.i_com[(2, 2)]].map(|moment| moment * (1.0 + h * angular));
            let constants = [
                (link::LINEAR_DRAG, linear),
                (link::ANGULAR_DRAG, angular),
                (link::HALF_MASS, 0.5 * mass),
                (link::ACROSS, across - ends),
                (link::ALONG, (axial - across + ends) / (length * length)),
                (link::H_STIFFNESS, h * wood.stiffness),
                (link::ARMATURE, wood.armature(h)),
                (link::H_DAMPING, wood.h_damping(h)),
            ];
            for (field, number) in constants {
                *self.link_mut(row, field, lane) = number as f32;
            }
            let limit = plant.tree.rupture_moment[segment] / plant.tree.stiffness[segment];
            self.numbers.bend_limits.as_mut_slice()[row * self.lanes + lane] =
                if self.worlds[lane].rupture.is_debris(segment) || plant.tree.parent[segment].is_none() {
                    f32::INFINITY
                } else {
                    (limit * limit) as f32
                };
        }
        self.load_sails(lane);
        for (i, point) in plant.fruit.points.iter().enumerate() {
            if data.tethered[point.index()] {
                let row = self.worlds[lane].fruit_row[i];
                let h_bias = plant.settings.h * data.anchor_bias_world[point.index()].z;
                *self.fruit_mut(row, fruit::H_BIAS, lane) = h_bias as f32;
                let h_cap = plant.settings.h * data.reaction_cap[point.index()];
                *self.fruit_mut(row, fruit::H_CAP, lane) = h_cap as f32;
            }
        }
    }

    /// Writes the state of a lane's world, and what breaking and detachment have changed.
    pub fn store(&self, lane: usize, data: &mut Data) {
        let world = &self.worlds[lane];
        let plant = &world.plant;
        for (row, &segment) in world.walk.links.iter().enumerate() {
            let id = plant.tree.bodies[segment];
            let number = |field: usize| f64::from(self.link(row, field, lane));
            for k in 0..2 {
                data.q[plant.model.qs(id).start + k] = number(link::Q + k);
                let dof = plant.model.dofs(id).start + k;
                data.v[dof] = number(link::V + k);
                data.stiffness[dof] = world.wood[row].stiffness;
                data.damping[dof] = world.wood[row].damping;
            }
            [data.linear_drag[id.index()], data.angular_drag[id.index()]] = world.wood[row].drag;
        }
        for (i, &row) in world.fruit_row.iter().enumerate() {
            let point = plant.fruit.points[i].index();
            let vector = |field: usize| Vec3::from_fn(|k, _| f64::from(self.fruit(row, field + k, lane)));
            data.point_p_world[point] = vector(fruit::P);
            data.point_v_world[point] = vector(fruit::V);
            data.point_quadratic_drag[point] = f64::from(self.fruit(row, fruit::AIR_DRAG, lane));
            data.tethered[point] = self.is_hanging(row, lane);
            self.store_stem(lane, i, data);
        }
        for (i, ball) in &world.loose {
            data.point_w_world[plant.fruit.points[*i].index()] = ball.w_world;
            data.groups[plant.fruit.colliders[*i].index()] = plant.fruit.groups.loose;
        }
        for tip in &world.debris {
            let collider = plant.tree.colliders[world.walk.links[tip.row]];
            data.groups[collider.index()] = plant.tree.groups.debris;
        }
        plant.fruit.weigh_on(data, |segment| world.rupture.is_debris(segment));
    }

    fn is_hanging(&self, fruit_row: usize, lane: usize) -> bool {
        let at = fruit_row * limit::FIELDS + limit::PULL;
        let limit = match self.worlds[lane].remains() {
            Some(remains) => remains.stem_limits[at],
            None => self.numbers.stem_limits.as_slice()[at * self.lanes + lane],
        };
        limit.is_finite()
    }
}
