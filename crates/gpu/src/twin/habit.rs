//! A tree in another habit and other dimensions: `orchard_treegen::reshape`, one segment after the other, each of which needs only its parent.

use super::Lane;
use super::math::Vec3;
use super::motion::{Axes, joint_outward};
use super::turns::{
    Turn, bend_turn, droop_turn, no_turn, product, spread_turn, turn_between, turn_by, turned, unit_turn,
    unit_vector,
};
use crate::layout::{QUAD, UNBOUNDED, axis, base, dial, form, growth, segment};
use crate::table::NO_SEGMENT;

/// Quantities that are the same for all wood of a tree.
#[derive(Clone, Copy)]
pub(super) struct Habit {
    /// Factor on lengths.
    pub scale: f32,
    /// Factor on radii.
    pub thickness: f32,
    /// Lean: rotation of the whole tree.
    pub lean: Turn,
    /// Droop of an internode [rad].
    pub droop: f32,
    /// Factor on the angle of a fork.
    pub fork_spread: f32,
    /// Roll from one lateral to the next [rad].
    pub twist: f32,
}

/// A segment of the base tree.
#[derive(Clone, Copy)]
pub(super) struct Segment {
    pub row: usize,
    pub parent: u32,
    pub growth: usize,
    pub radius_units: usize,
    /// Direction in world coordinates.
    pub heading: Vec3,
    pub limit: f32,
    pub direction: Vec3,
    pub length: f32,
    /// Mass, inertia across, excess, stiffness.
    pub weight: [f32; 4],
    pub radius: f32,
}

/// A segment in its new form.
#[derive(Clone, Copy)]
pub(super) struct Formed {
    /// Rotation of the segment and of everything that grows on it.
    pub turn: Turn,
    /// Rotation after it, which lifts the segment off the ground.
    pub lift: Turn,
    pub axes: Axes,
    pub z_tip: f32,
    pub radius: f32,
}

/// The ground, as what the trunk grows from.
pub(super) fn formed_ground(lean: Turn) -> Formed {
    Formed { turn: lean, lift: no_turn(), axes: Axes::world(), z_tip: 0.0, radius: UNBOUNDED }
}

/// Rotation of a segment: roll and spread of a lateral, droop of a branch, bend.
fn turn_of(own: &Segment, start: &Turn, along: &Vec3, habit: &Habit, bend: [f32; 2]) -> Turn {
    let mut turn = *start;
    if own.growth & growth::LATERAL != 0 {
        let roll = habit.twist * (own.growth >> growth::ORDINAL) as f32;
        turn = product(&turn_by(&(along * roll)), &turn);
        turn = product(&spread_turn(along, &turned(&turn, &own.heading), habit.fork_spread), &turn);
    }
    if own.growth & growth::BRANCH != 0 {
        turn = product(&droop_turn(&turned(&turn, &own.heading), habit.droop), &turn);
    }
    product(&bend_turn(&turned(&turn, &own.heading), bend), &turn)
}

/// Unit vector in the same compass direction with the given sine of elevation; a vertical heading takes +x.
fn elevated(heading: &Vec3, sine: f32) -> Vec3 {
    let across = (heading.x * heading.x + heading.y * heading.y).sqrt();
    let [x, y] =
        if across > 0.0 { [heading.x * (1.0 / across), heading.y * (1.0 / across)] } else { [1.0, 0.0] };
    let cosine = (1.0 - sine * sine).max(0.0).sqrt();
    Vec3::new(x * cosine, y * cosine, sine)
}

impl Lane<'_> {
    /// Entry of a segment.
    pub(super) fn segment_of(&self, index: u32) -> Segment {
        let dials = base::FIELDS + axis::COUNT * dial::FIELDS;
        let at = (dials + index as usize * segment::FIELDS) / QUAD;
        let quad = |field: usize| self.memory.table[at + field / QUAD];
        let number = |field: usize| f32::from_bits(quad(field)[field % QUAD]);
        let vector = |field: usize| Vec3::from_fn(|k, _| number(field + k));
        let [row, parent, growth, radius_units] = quad(segment::ROW);
        Segment {
            row: row as usize,
            parent,
            growth: growth as usize,
            radius_units: radius_units as usize,
            heading: vector(segment::HEADING),
            limit: number(segment::LIMIT),
            direction: vector(segment::DIRECTION),
            length: number(segment::DIRECTION + 3),
            weight: quad(segment::MASS).map(f32::from_bits),
            radius: number(segment::RADIUS),
        }
    }

    /// Draws the quantities that are the same for all wood.
    pub(super) fn habit_drawn(&self) -> Habit {
        let scale = self.factor_of(axis::SCALE);
        Habit {
            scale,
            thickness: scale * self.factor_of(axis::STOCKINESS),
            lean: turn_by(&self.lean_drawn()),
            droop: (self.factor_of(axis::DROOP) - 1.0) * self.base_number(base::INTERNODE),
            fork_spread: self.factor_of(axis::FORK_SPREAD),
            twist: self.angle_drawn(axis::TWIST),
        }
    }

    /// Stored new form of a segment.
    pub(super) fn formed(&self, row: usize) -> Formed {
        let at = self.work_at(row);
        let [y, z] = self.vectors(at, form::AXES);
        let [.., z_tip, radius] = self.quad(at, form::AXES + QUAD);
        let (turn, lift) = (self.quad(at, form::TURN).into(), self.quad(at, form::LIFT).into());
        Formed { turn, lift, axes: Axes::of(y, z), z_tip, radius }
    }

    pub(super) fn set_formed(&mut self, row: usize, formed: &Formed) {
        let at = self.work_at(row);
        let Formed { turn, lift, axes, z_tip, radius } = formed;
        self.set_quad(at, form::TURN, (*turn).into());
        self.set_quad(at, form::LIFT, (*lift).into());
        self.set_quad(at, form::AXES, [axes.y.x, axes.y.y, axes.y.z, axes.z.x]);
        self.set_quad(at, form::AXES + QUAD, [axes.z.y, axes.z.z, *z_tip, *radius]);
    }

    /// New form of a segment on its parent's new form, and its direction in the parent's frame. A branch that dips below the clearance is rotated upwards about its base, with everything that grows on
    /// it. If it were too low even upright, where the host refuses the tree, it stands upright.
    pub(super) fn form_segment(
        &self,
        own: &Segment,
        parent: &Formed,
        habit: &Habit,
        bend: [f32; 2],
        length: f32,
        radius: f32,
    ) -> (Formed, Vec3) {
        let mut turn = parent.turn;
        if own.parent != NO_SEGMENT {
            let along = unit_vector(&turned(&parent.turn, &self.segment_of(own.parent).heading));
            turn = unit_turn(&turn_of(own, &parent.turn, &along, habit, bend));
        }
        let mut heading = turned(&parent.lift, &unit_vector(&turned(&turn, &own.heading)));
        let mut lift = parent.lift;
        if own.growth & growth::BRANCH != 0 {
            let clearance = self.base_number(base::CLEARANCE);
            let rise = ((clearance + radius - parent.z_tip) / length).min(1.0);
            if heading.z < rise {
                let raised = elevated(&heading, rise);
                lift = unit_turn(&product(&turn_between(&unit_vector(&heading), &raised), &lift));
                heading = raised;
            }
        }
        let in_parent = [parent.axes.x, parent.axes.y, parent.axes.z].map(|axis| axis.dot(&heading));
        let direction = unit_vector(&in_parent.into());
        let axes = joint_outward(&parent.axes, direction, [0.0; 2]);
        (Formed { turn, lift, axes, z_tip: parent.z_tip + heading.z * length, radius }, direction)
    }
}
