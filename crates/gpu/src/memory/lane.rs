//! Numbers of a world in its lane, by row, and their places in the buffers.

use orchard_batch::{Plant, TreeWorld};
use orchard_geometry::{Shape, Vec3};
use orchard_multibody::Data;

use super::placed::{PlacedQuad, PlacedWord};
use super::{Memory, Place, fruit_rows};
use crate::layout::{
    LANES, QUAD, RADIUS_UNITS, UNBOUNDED, damper, fourth, fruit, link, notice, state, third, tile, touch,
    world,
};
use crate::schedule::{PARTS, Schedule};

/// Numbers of a world: constants, state and operations. Rows are those of its tile, used or not.
#[derive(Debug)]
pub(crate) struct LaneNumbers {
    operations: Vec<[u32; QUAD]>,
    states: Vec<u32>,
    /// Quads of each row, one row after another.
    links: Vec<[f32; QUAD]>,
    /// Of joints that have their own.
    dampers: Vec<[f32; QUAD]>,
    touches: Vec<[f32; QUAD]>,
    fruit: Vec<[f32; QUAD]>,
    /// Quads of the wind in the buffer of links, each with its place there.
    winds: Vec<(u32, [f32; QUAD])>,
    worlds: Vec<f32>,
}

/// Numbers of a world with their places in the buffers.
#[derive(Debug, Default)]
pub(crate) struct Scattered {
    pub links: Vec<PlacedQuad>,
    pub fruit: Vec<PlacedQuad>,
    /// Places and radii of links, which contacts with a robot read; they lie in the buffer of work.
    pub touches: Vec<PlacedQuad>,
    pub operations: Vec<PlacedQuad>,
    pub states: Vec<PlacedWord>,
    pub worlds: Vec<PlacedWord>,
}

/// A field of a row, whose quads follow one another.
fn field(quads: &mut [[f32; QUAD]], fields: usize, row: usize, field: usize) -> &mut f32 {
    &mut quads[row * fields / QUAD + field / QUAD][field % QUAD]
}

impl Memory {
    /// The numbers of a world at a place, with so many rows of fruit; forces from outside lie elsewhere.
    pub(super) fn lane_numbers(
        &self,
        place: &Place,
        fruit_rows: usize,
        given: &TreeWorld,
        schedule: &Schedule,
    ) -> LaneNumbers {
        let rows = self.header(place.tile, tile::STARTS + PARTS);
        let of_fruit = self.laws.fruit_fields();
        let mut numbers = LaneNumbers {
            operations: vec![[0; QUAD]; rows],
            states: vec![0; rows],
            links: vec![[0.0; QUAD]; rows * link::FIELDS / QUAD],
            dampers: vec![[0.0; QUAD]; rows * self.laws.behind_links()[0] / QUAD],
            touches: vec![[0.0; QUAD]; rows * self.laws.touch_fields() / QUAD],
            fruit: vec![[0.0; QUAD]; fruit_rows * of_fruit / QUAD],
            winds: self.wind_quads(given.plant(), place),
            worlds: vec![0.0; world::FIELDS],
        };
        let (plant, data) = (given.plant(), given.data());
        self.add_operations(&mut numbers, place, plant, schedule);
        add_links(&mut numbers.links, place, plant, data);
        if self.laws.modal {
            for (&id, &row) in plant.tree.bodies.iter().zip(&*place.rows) {
                let dof = plant.model.dofs(id).start;
                // A broken joint has no stiffness; its damper is another (`treephys::Rupture`).
                let time =
                    if data.stiffness[dof] == 0.0 { 0.0 } else { data.damping[dof] / data.stiffness[dof] };
                *field(&mut numbers.dampers, damper::FIELDS, row, damper::TIME) = time as f32;
            }
        }
        if self.laws.touched {
            for (segment, &row) in place.rows.iter().enumerate() {
                *field(&mut numbers.touches, touch::FIELDS, row, touch::RADIUS) =
                    radius(plant, segment) as f32;
            }
        }
        for row in 0..fruit_rows {
            *field(&mut numbers.fruit, of_fruit, row, fruit::MASS) = fruit_rows::PADDING_MASS;
        }
        for (i, &row) in place.fruit_rows.iter().enumerate() {
            for (at, value) in fruit_rows::numbers(given, i) {
                *field(&mut numbers.fruit, of_fruit, row, at) = value as f32;
            }
        }
        let root = plant.tree.parent.iter().position(Option::is_none).unwrap_or_default();
        let p_root = plant.model.body(plant.tree.bodies[root]).x_parent_joint.translation.vector;
        for k in 0..3 {
            numbers.worlds[world::P + k] = p_root[k] as f32;
        }
        numbers.worlds[world::DAMPING_TIME] = plant.spec.wood.damping_time.si() as f32;
        for (at, count) in [
            (world::NOTICE, notice::STALE),
            (world::FRUIT, place.fruit_rows.iter().max().map_or(0, |last| last + 1)),
            (world::LINKS, place.rows.len()),
            (world::BEGAN, self.began(place, given) as usize),
        ] {
            numbers.worlds[at] = f32::from_bits(count as u32);
        }
        numbers
    }

    fn add_operations(&self, numbers: &mut LaneNumbers, place: &Place, plant: &Plant, schedule: &Schedule) {
        for (part, visits) in schedule.parts.iter().enumerate() {
            // First leaf of the inward pass, if the part has more rows in other lanes.
            let leaves = visits.last().map_or(0, |visit| (visit.words[2] >> third::LEAF & 0x3ff) + 1);
            let start = self.header(place.tile, tile::STARTS + part);
            let rows = start + visits.len()..self.header(place.tile, tile::STARTS + part + 1);
            rows.for_each(|row| numbers.operations[row][2] = leaves << third::LEAF);
        }
        for visit in schedule.parts.iter().flatten() {
            let segment = visit.link;
            let [a, b, mut c] = visit.words;
            if let Some(&first) = schedule.fruit[visit.fruit()].first() {
                c &= !((0xfff << third::FIRST_FRUIT) as u32);
                c |= (place.fruit_rows[first] << third::FIRST_FRUIT) as u32;
            }
            let radius = (radius(plant, segment) * f64::from(RADIUS_UNITS)).round() as usize;
            let d = plant.tree.parent[segment].map_or(0xffff, |up| place.rows[up]) << fourth::PARENT_ROW
                | radius.min(fourth::RADIUS_BITS) << fourth::RADIUS;
            numbers.operations[place.rows[segment]] = [a, b, c, d as u32];
        }
    }

    /// Writes numbers of a world into the host's copy.
    pub(super) fn put(&mut self, place: &Place, numbers: &LaneNumbers) {
        let Scattered { links, fruit, touches, operations, states, .. } = self.scattered(place, numbers);
        let copy = |to: &mut [f32], quads: Vec<PlacedQuad>| {
            let (to, _) = to.as_chunks_mut();
            quads.into_iter().for_each(|quad| to[quad.at as usize] = quad.bits.map(f32::from_bits));
        };
        copy(&mut self.links, links);
        copy(&mut self.fruit, fruit);
        copy(&mut self.work, touches);
        operations.into_iter().for_each(|words| self.operations[words.at as usize] = words.bits);
        states.into_iter().for_each(|word| self.states[word.at as usize] = word.bits);
        self.put_world(place, numbers);
    }

    /// Writes the numbers that a world has but once into the host's copy.
    pub(super) fn put_world(&mut self, place: &Place, numbers: &LaneNumbers) {
        for (field, value) in numbers.worlds.iter().enumerate() {
            let at = self.world_at(place.tile, field, place.lane);
            self.worlds[at] = *value;
        }
    }

    /// The numbers of a world with their places.
    pub(super) fn scattered(&self, place: &Place, numbers: &LaneNumbers) -> Scattered {
        let (number, lane) = (place.tile, place.lane);
        let rows = 0..numbers.operations.len();
        let rows: Vec<u32> = rows.map(|row| self.operation_at(number, row, lane) as u32).collect();
        let of_link = |k: usize| self.link_at(number, 0, k * QUAD, lane);
        let of_damper = |k: usize| self.damper_at(number, 0, lane) + k * LANES * QUAD;
        let of_touch = |k: usize| self.touch_at(number, 0, k * QUAD, lane);
        let of_fruit = |k: usize| self.fruit_at(number, 0, k * QUAD, lane);
        let quads = |numbers: &[[f32; QUAD]], at: &dyn Fn(usize) -> usize| -> Vec<PlacedQuad> {
            let each = numbers.iter().enumerate();
            each.map(|(k, quad)| PlacedQuad::new((at(k) / QUAD) as u32, *quad)).collect()
        };
        let word = |(at, bits): (u32, u32)| PlacedWord { at, bits };
        let of_world = |k: usize| self.world_at(number, k, lane) as u32;
        Scattered {
            links: [
                quads(&numbers.links, &of_link),
                quads(&numbers.dampers, &of_damper),
                numbers.winds.iter().map(|(at, quad)| PlacedQuad::new(*at, *quad)).collect(),
            ]
            .concat(),
            fruit: quads(&numbers.fruit, &of_fruit),
            touches: quads(&numbers.touches, &of_touch),
            operations: rows
                .iter()
                .zip(&numbers.operations)
                .map(|(at, own)| PlacedQuad::new(*at, *own))
                .collect(),
            states: rows.iter().copied().zip(numbers.states.iter().copied()).map(word).collect(),
            worlds: (0..).map(of_world).zip(numbers.worlds.iter().map(|x| x.to_bits())).map(word).collect(),
        }
    }
}

impl Memory {
    /// Bits of the states of a world's links, by segment: which have broken, and when. The next frame of the world is the one after the rules' own, less those in which it stood still.
    pub(super) fn states_of(&self, place: &Place, given: &TreeWorld) -> Vec<u32> {
        let (plant, rupture) = (given.plant(), given.rupture());
        let bits = |segment| if rupture.is_debris(segment) { state::DEBRIS as u32 } else { 0 };
        let mut states: Vec<u32> = (0..plant.tree.len()).map(bits).collect();
        for broken in rupture.breaks() {
            let frames = (broken.age / plant.spec.sim.frame()).round() as u32;
            let broke = self.rules.frame.wrapping_sub(place.missed).wrapping_sub(frames) << state::BROKE;
            states[broken.segment] |= state::BROKEN as u32 | broke;
        }
        states
    }
}

/// Quad of each segment from the square of its limit on. A joint tells how far it was bent at the start of the episode, |M| / M_max, a broken one what its friction needs.
pub(super) fn limits(given: &TreeWorld, start: &Data) -> Vec<[f32; QUAD]> {
    let (plant, rupture) = (given.plant(), given.rupture());
    let tree = &plant.tree;
    let mut limits: Vec<[f32; QUAD]> = (0..tree.len())
        .map(|segment| {
            let bend = tree.bending_angle(&plant.model, start, segment);
            let ratio = tree.stiffness[segment] * bend / tree.rupture_moment[segment];
            [limit(plant, segment) as f32, 0.0, 0.0, ratio as f32]
        })
        .collect();
    for broken in rupture.breaks() {
        let own = &mut limits[broken.segment];
        [own[1], own[2], own[3]] = [broken.inertia, broken.friction, broken.rate].map(|x| x as f32);
    }
    limits
}

impl LaneNumbers {
    /// Sets what has broken, and how far the joints were bent at the start of the episode.
    pub(super) fn set_wood(&mut self, place: &Place, states: &[u32], limits: &[[f32; QUAD]]) {
        for ((&row, bits), limit) in place.rows.iter().zip(states).zip(limits) {
            self.states[row] = *bits;
            self.links[(row * link::FIELDS + link::LIMIT) / QUAD] = *limit;
        }
    }
}

/// Square of the angle that breaks a segment's joint \[rad^2\]. The root's joint stands for the soil's grip and does not break.
fn limit(plant: &Plant, segment: usize) -> f64 {
    let tree = &plant.tree;
    let angle = tree.rupture_moment[segment] / tree.stiffness[segment];
    if tree.parent[segment].is_none() { f64::from(UNBOUNDED) } else { angle * angle }
}

fn add_links(links: &mut [[f32; QUAD]], place: &Place, plant: &Plant, data: &Data) {
    let (model, tree) = (&plant.model, &plant.tree);
    for (segment, &row) in place.rows.iter().enumerate() {
        let id = tree.bodies[segment];
        let body = model.body(id);
        let (direction, i_com) = (body.x_parent_joint.rotation * Vec3::z(), &body.inertia.i_com);
        let (dof, q) = (model.dofs(id).start, model.qs(id).start);
        for (at, value) in [
            (link::DIRECTION, direction.x),
            (link::DIRECTION + 1, direction.y),
            (link::DIRECTION + 2, direction.z),
            (link::LENGTH, 2.0 * body.inertia.p_com.z),
            (link::MASS, body.inertia.mass),
            (link::ACROSS, i_com[(0, 0)]),
            (link::EXCESS, i_com[(2, 2)] - i_com[(0, 0)]),
            (link::STIFFNESS, data.stiffness[dof]),
            (link::Q, data.q[q]),
            (link::Q + 1, data.q[q + 1]),
            (link::V, data.v[dof]),
            (link::V + 1, data.v[dof + 1]),
            (link::LIMIT, limit(plant, segment)),
        ] {
            *field(links, link::FIELDS, row, at) = value as f32;
        }
    }
}

/// Radius of a segment \[m\].
fn radius(plant: &Plant, segment: usize) -> f64 {
    match plant.model.collider(plant.tree.colliders[segment]).shape {
        Shape::Capsule { radius, .. } => radius,
        _ => 0.0,
    }
}
