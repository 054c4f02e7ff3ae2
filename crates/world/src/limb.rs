//! A limb that falls, as a fault of the world's config asks for.

use crate::World;
use orchard_geometry::{Vec3, transform};
use orchard_spec::fault::{FaultKind, FaultSpec};

impl World {
    /// Breaks the heaviest limb above the hand, once a fault lasts that asks for it: the first frame with such a limb breaks it. No event tells
    /// it: the robot has not snapped it. Nothing breaks any more once other wood has broken since the fault's beginning.
    pub(crate) fn drop_limb(&mut self) {
        let Some(fault) = self.spec.fault.clone().filter(|fault| fault.kind == FaultKind::LimbFalls) else {
            return;
        };
        let time = f64::from(self.state.frame) * self.spec.sim.frame();
        let since = time - fault.from.si();
        let is_over = self.state.rupture.breaks().iter().any(|b| b.age <= since);
        if !fault.lasts(time) || is_over {
            return;
        }
        if let Some(segment) = self.limb_above_hand(&fault) {
            let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
            let gravity = spec.sim.gravity.si();
            state.rupture.break_joint(
                &parts.tree,
                &parts.model,
                &mut state.data,
                &spec.wood,
                gravity,
                segment,
            );
        }
    }

    /// The heaviest limb that a fault allows above the hand; the first of equal ones.
    fn limb_above_hand(&self, fault: &FaultSpec) -> Option<usize> {
        let (tree, data) = (&self.parts.tree, &self.state.data);
        let p_hand = self.parts.handle.x_world_tcp(data).translation.vector;
        let mut best: Option<(usize, f64)> = None;
        for (segment, (mass, moment)) in self.limbs().into_iter().enumerate() {
            let is_live = tree.parent[segment].is_some() && !self.state.rupture.is_debris(segment);
            let off = moment / mass - p_hand;
            let above = off.z > 0.0 && off.xy().norm() <= fault.limb_distance.si();
            if is_live
                && above
                && fault.limb_mass.contains_si(mass)
                && best.is_none_or(|(_, most)| mass > most)
            {
                best = Some((segment, mass));
            }
        }
        best.map(|(segment, _)| segment)
    }

    /// Mass \[kg\] of each segment with all that it bears, fruit too, and that mass times the position of its centre \[kg m\], world.
    fn limbs(&self) -> Vec<(f64, Vec3)> {
        let (tree, model, data) = (&self.parts.tree, &self.parts.model, &self.state.data);
        let mut limbs: Vec<(f64, Vec3)> = Vec::with_capacity(tree.bodies.len());
        for &body in &tree.bodies {
            let link = &model.body(body).inertia;
            limbs.push((link.mass, transform(data.x_world_body(body), &link.p_com) * link.mass));
        }
        let fruit = &self.parts.fruit;
        for (fruit, point) in fruit.fruit.iter().zip(&fruit.points) {
            if data.tethered[point.index()] {
                let mass = model.points()[point.index()].mass;
                let limb = &mut limbs[fruit.segment];
                *limb = (limb.0 + mass, limb.1 + data.point_p_world[point.index()] * mass);
            }
        }
        // A parent stands before its children.
        for segment in (0..limbs.len()).rev() {
            if let Some(parent) = tree.parent[segment] {
                let (mass, moment) = limbs[segment];
                limbs[parent] = (limbs[parent].0 + mass, limbs[parent].1 + moment);
            }
        }
        limbs
    }
}
