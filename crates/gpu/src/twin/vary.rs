//! Dimensions, habit, wood and fruit of a world, drawn from its own streams: `orchard_world::Planting::draw` without leaves and colours
//! and without moving fruit to other segments. Numbers on which no axis acts keep the base's bits.

use std::f32::consts::PI;

use super::Lane;
use super::habit::{Segment, formed_ground};
use super::math::Vec3;
use crate::layout::{
    QUAD, RADIUS_UNITS, axis, base, dial, fourth, fruit, fruit_entry, growth, link, segment, varied, world,
};
use crate::table::NO_SEGMENT;

/// Second moment and modulus of a circular section: pi / 4 times a power of its radius.
const SECTION: f32 = 0.25;
/// Volume of half a ball over pi r^3.
const BALL_HALF: f32 = 2.0 / 3.0;
/// Rotational inertia of a ball by mass and square of the radius.
const BALL: f32 = 0.4;
/// Inertia of a rod about its middle over m l^2.
const ROD: f32 = 1.0 / 12.0;
/// Distance of the centre of half a ball from its base, over the radius.
const HALF_BALL_ARM: f32 = 3.0 / 8.0;
/// Wood this near to the vertical has no underside, as on the host (`orchard_treegen::underside`) [rad].
const MICRORADIAN: f32 = 1e-6;

/// Dimensions of a segment, and whether they are the base's.
#[derive(Clone, Copy)]
struct Stick {
    length: f32,
    radius: f32,
    is_base: bool,
}

impl Stick {
    fn of_base(segment: &Segment) -> Self {
        Self { length: segment.length, radius: segment.radius, is_base: true }
    }
}

/// Bending stiffness of a segment, E I / l [N m/rad].
fn bending(modulus: f32, stick: Stick) -> f32 {
    let area = stick.radius * stick.radius;
    modulus * (SECTION * PI) * area * area / stick.length
}

impl Lane<'_> {
    /// Draws a marked world; on the device a reset follows.
    pub(super) fn vary(&mut self) {
        if self.world(world::RESET) == 0.0 {
            return;
        }
        self.vary_wood();
        self.vary_fruit();
    }

    fn base_flags(&self) -> usize {
        self.base_word(base::FLAGS) as usize
    }

    /// Draws the wood, segment by segment, each after its parent: form, then mass, stiffness and limit.
    fn vary_wood(&mut self) {
        let [density, modulus, stress] =
            [axis::WOOD_DENSITY, axis::YOUNGS_MODULUS, axis::RUPTURE_STRESS].map(|axis| self.factor_of(axis));
        let forms = self.base_flags() & varied::FORM != 0;
        let habit = self.habit_drawn();
        let [mut lengths, mut radii, mut bends] =
            [axis::SEGMENT_LENGTH, axis::SEGMENT_RADIUS, axis::SEGMENT_BEND].map(|axis| self.stream_of(axis));
        for index in 0..self.base_word(base::SEGMENTS) {
            let own = self.segment_of(index);
            let up = (own.parent != NO_SEGMENT).then(|| self.segment_of(own.parent));
            let (mut stick, mut before) = (Stick::of_base(&own), up.as_ref().map(Stick::of_base));
            let mut direction = own.direction;
            if forms {
                let parent = up.map_or_else(|| formed_ground(habit.lean), |up| self.formed(up.row));
                before = up.map(|up| {
                    let (length, radius) = (self.link(up.row, link::LENGTH), parent.radius);
                    Stick { length, radius, is_base: length == up.length && radius == up.radius }
                });
                let length = own.length * (habit.scale * self.next_factor(&mut lengths));
                let radius =
                    (own.radius * (habit.thickness * self.next_factor(&mut radii))).min(parent.radius);
                stick = Stick { length, radius, is_base: length == own.length && radius == own.radius };
                let bend = self.next_bend(&mut bends);
                let (formed, turned) = self.form_segment(&own, &parent, &habit, bend, length, radius);
                self.set_formed(own.row, &formed);
                direction = turned;
            }
            (0..3).for_each(|k| self.set_link(own.row, link::DIRECTION + k, direction[k]));
            self.set_link(own.row, link::LENGTH, stick.length);
            let stiffness = self.joint_stiffness(&own, stick, before, modulus);
            let [mass, across, excess] = self.capsule(&own, stick, density);
            for (field, value) in [
                (link::MASS, mass),
                (link::ACROSS, across),
                (link::EXCESS, excess),
                (link::LIMIT, self.joint_limit(&own, stick, stiffness, stress)),
                (link::STIFFNESS, stiffness),
            ] {
                self.set_link(own.row, field, value);
            }
            self.set_radius(&own, stick);
        }
    }

    /// Mass [kg], inertia across [kg m^2] and excess of a capsule, as `treephys::section::capsule_inertia`.
    fn capsule(&self, own: &Segment, stick: Stick, factor: f32) -> [f32; 3] {
        if stick.is_base && factor == 1.0 {
            let [mass, across, excess, _] = own.weight;
            return [mass, across, excess];
        }
        let density = self.base_number(base::DENSITY) * factor;
        let Stick { length: l, radius: r, .. } = stick;
        let cylinder = density * PI * r * r * l;
        let half_ball = density * BALL_HALF * PI * r * r * r;
        let axial = cylinder * (0.5 * r * r) + half_ball * (2.0 * BALL * r * r);
        let across = cylinder * (l * l * ROD + r * r * 0.25)
            + half_ball * (2.0 * (BALL * r * r + 0.25 * l * l + HALF_BALL_ARM * l * r));
        [cylinder + 2.0 * half_ball, across, axial - across]
    }

    /// Stiffness of the joint at a segment's base by the spec's law, as `treephys::stiffness`; `before` is its parent.
    fn joint_stiffness(&self, own: &Segment, stick: Stick, before: Option<Stick>, factor: f32) -> f32 {
        let flags = self.base_flags();
        let is_corrected = flags & varied::CORRECTED != 0;
        let is_base = stick.is_base && (before.is_none_or(|b| b.is_base) || !is_corrected) && factor == 1.0;
        if is_base || flags & varied::PER_LEVEL != 0 {
            return own.weight[3];
        }
        let modulus = self.base_number(base::MODULUS) * factor;
        let mut stiffness = bending(modulus, stick);
        if is_corrected {
            let mut compliance = 0.5 / stiffness;
            if let Some(before) = before.filter(|_| own.growth & growth::LATERAL == 0) {
                compliance += 0.5 / bending(modulus, before);
            }
            stiffness = 1.0 / compliance;
        }
        stiffness.clamp(self.base_number(base::STIFFNESS_MIN), self.base_number(base::STIFFNESS_MAX))
    }

    /// Square of the angle at which a joint breaks. The root's joint never breaks.
    fn joint_limit(&self, own: &Segment, stick: Stick, stiffness: f32, factor: f32) -> f32 {
        let is_base = stick.is_base && stiffness == own.weight[3] && factor == 1.0;
        if is_base || own.parent == NO_SEGMENT {
            return own.limit;
        }
        let stress = self.base_number(base::STRESS) * factor;
        let r = stick.radius;
        let angle = stress * (SECTION * PI) * r * r * r / stiffness;
        angle * angle
    }

    /// Sets the radius for the contact of a broken limb with the ground.
    fn set_radius(&mut self, own: &Segment, stick: Stick) {
        let units = if stick.is_base {
            own.radius_units
        } else {
            ((stick.radius * RADIUS_UNITS + 0.5) as usize).min(fourth::RADIUS_BITS)
        };
        let at = self.memory.operation_at(self.number, own.row, self.lane);
        let word = &mut self.memory.operations[at][3];
        *word = *word & !((fourth::RADIUS_BITS << fourth::RADIUS) as u32) | (units << fourth::RADIUS) as u32;
    }

    /// A value times an axis's factor, clamped to the axis's limits; a value that is already outside them is not moved further out.
    fn clipped(&self, value: f32, factor: f32, axis: usize) -> f32 {
        let [least, most] = self.limits_of(self.dial_at(axis));
        (value * factor).clamp(value.min(least), value.max(most))
    }

    /// Draws sizes and masses of all fruit, the numbers that follow from them as in `FruitSet::add_to`, and the new positions of their anchors.
    fn vary_fruit(&mut self) {
        let [size, heaviness] = [axis::FRUIT_SIZE, axis::FRUIT_MASS].map(|axis| self.factor_of(axis));
        let segments = self.base_word(base::SEGMENTS) as usize;
        let first = (base::FIELDS + axis::COUNT * dial::FIELDS + segments * segment::FIELDS) / QUAD;
        for index in 0..self.base_word(base::FRUIT) as usize {
            let at = first + index * fruit_entry::FIELDS / QUAD;
            let quad = |field: usize| self.memory.table[at + field / QUAD];
            let numbers = |field: usize| quad(field).map(f32::from_bits);
            let [row, index, off_bark, _] = quad(fruit_entry::ROW);
            let across = numbers(fruit_entry::ACROSS);
            let [mut mass, mut radius, threshold, mut air_drag] = numbers(fruit_entry::MASS);
            let [stiffness, mut damping, mut bias, cap] = numbers(fruit_entry::STIFFNESS);
            let [mut x, mut y, mut z, mut drop] = numbers(fruit_entry::ANCHOR);
            let sized = self.clipped(radius, size, axis::FRUIT_SIZE);
            if sized != radius {
                radius = sized;
                air_drag = self.base_number(base::AIR_DRAG) * radius * radius;
                drop = -(self.base_number(base::STEM) + radius);
            }
            let heavy = self.clipped(mass, heaviness, axis::FRUIT_MASS);
            if heavy != mass {
                mass = heavy;
                damping = self.base_number(base::STEM_DAMPING) * mass.sqrt();
                bias = self.base_number(base::BIAS) * mass;
            }
            if self.base_flags() & varied::FORM != 0 {
                let anchor = self.carried(index, f32::from_bits(off_bark), across, z);
                [x, y, z] = anchor.into();
            }
            for (field, values) in [
                (fruit::MASS, [mass, radius, threshold, air_drag]),
                (fruit::STIFFNESS, [stiffness, damping, bias, cap]),
                (fruit::ANCHOR, [x, y, z, drop]),
            ] {
                (0..QUAD).for_each(|k| self.set_fruit(row as usize, field + k, values[k]));
            }
        }
    }

    /// Position of an anchor on the new form of its segment, as in `treegen::SegmentMap`: at the same share of the length, rolled with the underside, its distance from the
    /// bark stretched with the segment. Directions across the wood are complex numbers, whose products add angles.
    fn carried(&self, index: u32, off_bark: f32, [x, y, a, b]: [f32; 4], along: f32) -> Vec3 {
        let own = self.segment_of(index);
        let form = self.formed(own.row);
        let stretch = self.link(own.row, link::LENGTH) / own.length;
        let level = [-form.axes.x.z, -form.axes.y.z];
        let sine = (level[0] * level[0] + level[1] * level[1]).sqrt();
        let underside = if sine > MICRORADIAN { level.map(|part| part * (1.0 / sine)) } else { [0.0; 2] };
        let side = if [x, y] == [0.0; 2] {
            underside.map(|part| part * form.radius)
        } else {
            let rolls = underside != [0.0; 2] && [a, b] != [0.0; 2];
            let rolled = [a * underside[0] - b * underside[1], a * underside[1] + b * underside[0]];
            let side = if rolls { rolled } else { [x, y] };
            side.map(|part| part * (form.radius + off_bark * stretch).max(0.0))
        };
        Vec3::new(side[0], side[1], along * stretch)
    }
}
