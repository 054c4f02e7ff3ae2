//! Suction cup in a world: on which fruit its lip lies, what lies under the lip, and the force of the pressure.
//!
//! Contact and friction between lip and fruit are contacts of the model like all others. The pressure adds one force along the cup's axis:
//! on the fruit at its centre, since pressure on a ball acts through its centre, and the opposite on the last arm link along the same line.
//! Nothing else acts between cup and fruit, and the two forces act like those of contacts. Equations: `docs/computation/suction.md`.

use crate::build::Parts;
use crate::touch::Part;
use orchard_fruit::{FruitLives, Phase};
use orchard_geometry::{Pose, Vec3, inverse_transform, transform};
use orchard_multibody::{BodyId, Data, StepReport};
use orchard_robot::{Cup, Suction, UnderLip};

/// Force of the pressure in one substep, with the inputs that it replaced.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pull {
    point: usize,
    wrist: BodyId,
    /// External force and torque on the wrist, without the cup.
    before: [Vec3; 2],
}

impl Pull {
    /// Takes the force back, so that inputs that others set keep their values.
    pub fn end_substep(self, data: &mut Data) {
        let [force, torque] = self.before;
        data.point_paired_force_world[self.point] = Vec3::zeros();
        data.body_force_world[self.wrist.index()] = force;
        data.body_torque_world[self.wrist.index()] = torque;
    }
}

/// True if a suction's fruit is one of so many.
pub(crate) fn fits(suction: &Suction, fruit: usize) -> bool {
    suction.vacuum.is_finite() && suction.fruit.is_none_or(|i| i < fruit)
}

/// Fruit that the vacuum holds on to.
pub(crate) fn sealed(suction: &Suction, parts: &Parts) -> Option<usize> {
    let cup = parts.handle.cup.as_ref()?;
    suction.fruit.filter(|_| cup.is_sealed(suction.vacuum))
}

/// Brings the vacuum to the end of the next substep and applies its force. `report` holds the contacts of the substep before; `valve` is
/// the commanded opening.
pub(crate) fn begin_substep(
    suction: &mut Suction,
    parts: &Parts,
    data: &mut Data,
    lives: &FruitLives,
    report: &StepReport,
    valve: f64,
) -> Option<Pull> {
    let cup = parts.handle.cup.as_ref()?;
    let wrist = parts.handle.wrist();
    let x_world_lip = data.x_world_body(wrist) * cup.x_wrist_lip;
    let found = nearest(parts, data, lives, cup, &x_world_lip, suction.fruit);
    let (mut seal, mut closed) = (cup.open(), 0);
    if let Some((fruit, p_lip)) = found {
        let radius = parts.fruit.fruit[fruit].radius;
        let was_closed = if suction.fruit == Some(fruit) { suction.closed } else { 0 };
        // Nothing comes between the fruit and a point that was closed on it.
        let under = under(parts, data, report, cup, &x_world_lip, Some(fruit)).without(was_closed);
        let openings = || cup.openings(&p_lip, radius, |i| cup.gap_over(&under, i));
        seal = cup.seal(openings());
        closed =
            openings().enumerate().fold(0, |mask, (i, gap)| mask | (u64::from(gap == 0.0) * Cup::bit(i)));
    }
    suction.vacuum = cup.vacuum_after(suction.vacuum, valve, &seal, parts.settings.h);
    suction.fruit = found.map(|(fruit, _)| fruit).filter(|_| seal.closed > 0.0);
    suction.closed = closed;
    let fruit = suction.fruit?;
    let point = parts.fruit.points[fruit].index();
    let on_cup = x_world_lip.rotation * Vec3::z() * cup.force(suction.vacuum, &seal);
    let r = data.point_p_world[point] - data.com_p_world(wrist);
    let w = wrist.index();
    let before = [data.body_force_world[w], data.body_torque_world[w]];
    data.point_paired_force_world[point] = -on_cup;
    data.body_force_world[w] += on_cup;
    data.body_torque_world[w] += r.cross(&on_cup);
    Some(Pull { point, wrist, before })
}

/// Fruit that the lip lies on, with its centre in the lip's frame \[m\]: that of the smallest mean gap. `before` is that of
/// the substep before. Fruit that the rigid-body engine
/// moves, or that sleeps, is none: the hand-over rule gives it to the model when the lip comes near.
fn nearest(
    parts: &Parts,
    data: &Data,
    lives: &FruitLives,
    cup: &Cup,
    x_world_lip: &Pose,
    before: Option<usize>,
) -> Option<(usize, Vec3)> {
    let mut best: Option<(f64, usize, Vec3)> = None;
    for i in 0..parts.fruit.len() {
        if !matches!(lives.phase(i), Phase::Hanging | Phase::InHand) {
            continue;
        }
        let p_world = data.point_p_world[parts.fruit.points[i].index()];
        let radius = parts.fruit.fruit[i].radius;
        let far = radius + 2.0 * cup.lip_radius + cup.half_thickness;
        if (p_world - x_world_lip.translation.vector).norm_squared() > far * far {
            continue;
        }
        let p_lip = inverse_transform(x_world_lip, &p_world);
        if cup.lies_on(&p_lip, radius, before == Some(i)) {
            let sum: f64 = cup.gaps(&p_lip, radius).sum();
            if best.is_none_or(|(least, ..)| sum < least) {
                best = Some((sum, i, p_lip));
            }
        }
    }
    best.map(|(_, fruit, p_lip)| (fruit, p_lip))
}

/// Finds the points of the lip over leaves and those pressed on. A point is pressed on if a contact of `report` presses on it that is not with `fruit`, the fruit on which the lip lies. A leaf is the flat ellipse that the camera draws. It lies under a point if it passes
/// within half the distance between two points of the lip. Leaves bear no force here, so the lip does not push them aside.
fn under(
    parts: &Parts,
    data: &Data,
    report: &StepReport,
    cup: &Cup,
    x_world_lip: &Pose,
    fruit: Option<usize>,
) -> UnderLip {
    let mut under = UnderLip::default();
    for contact in &report.contacts {
        let (a, b) = (parts.colliders[contact.a.index()], parts.colliders[contact.b.index()]);
        let presses = contact.force_world.dot(&contact.n_world) > 0.0;
        for (one, other) in [(a, b), (b, a)] {
            let is_fruit = matches!(other, Part::Fruit(i) if Some(i) == fruit);
            if let (Part::Cup(i), false, true) = (one, is_fruit, presses) {
                under.pressed |= Cup::bit(i);
            }
        }
    }
    let lip = x_world_lip.translation.vector;
    let near = 0.5 * cup.spacing();
    for leaf in &parts.skeleton.leaves {
        let x_world_segment = data.x_world_body(parts.tree.bodies[leaf.segment]);
        let petiole = transform(x_world_segment, &leaf.x_segment_leaf.translation.vector);
        let far = leaf.length + cup.lip_radius + near;
        if (petiole - lip).norm_squared() > far * far {
            continue;
        }
        let x_world_leaf = x_world_segment * leaf.x_segment_leaf;
        for (i, p_lip) in cup.lip_p_lip.iter().enumerate() {
            let p = inverse_transform(&x_world_leaf, &transform(x_world_lip, p_lip));
            let (along, across) = (2.0 * p.x / leaf.length - 1.0, 2.0 * p.y / leaf.width);
            if along * along + across * across <= 1.0 && p.z.abs() <= near {
                under.leaves |= Cup::bit(i);
            }
        }
    }
    under
}

/// Points of the lip over leaves and pressed on, now; none without a cup.
pub(crate) fn under_lip(
    suction: &Suction,
    parts: &Parts,
    data: &Data,
    lives: &FruitLives,
    report: &StepReport,
) -> UnderLip {
    let Some(cup) = &parts.handle.cup else { return UnderLip::default() };
    let x_world_lip = data.x_world_body(parts.handle.wrist()) * cup.x_wrist_lip;
    let on = nearest(parts, data, lives, cup, &x_world_lip, suction.fruit);
    under(parts, data, report, cup, &x_world_lip, on.map(|(fruit, _)| fruit))
}

#[cfg(test)]
#[path = "suction_tests.rs"]
mod tests;
