//! Limbs that fall on the arm, as a fault of the world's config asks for.

use crate::World;
use crate::build::Parts;
use crate::state::State;
use orchard_geometry::Vec3;
use orchard_spec::Spec;
use orchard_spec::fault::{FaultKind, FaultSpec};

impl State {
    /// Hangs the weight of a fault on the wrist, while it lasts.
    pub(crate) fn weigh_on_arm(&mut self, spec: &Spec, parts: &Parts) {
        let Some(fault) = spec.fault.as_ref().filter(|fault| fault.kind == FaultKind::WeightOnArm) else {
            return;
        };
        let lasts = fault.lasts(f64::from(self.frame) * spec.sim.frame());
        let weight = if lasts { fault.load.si() } else { 0.0 };
        self.data.body_force_world[parts.handle.wrist().index()] = -Vec3::z() * weight;
    }
}

impl World {
    /// Breaks the heaviest limb above the arm, once a fault lasts that asks for it: the first frame with such a limb breaks it. No event tells
    /// it: the robot has not snapped it. Nothing breaks any more once other wood has broken since the fault's beginning.
    pub(crate) fn drop_limb(&mut self) {
        let Some(fault) = self.spec.fault.as_ref().filter(|fault| fault.kind == FaultKind::LimbFalls) else {
            return;
        };
        let time = f64::from(self.state.frame) * self.spec.sim.frame();
        // Ages are sums of substeps, so that they are off by their rounding.
        let since = time - fault.from.si() + 0.5 * self.spec.sim.frame();
        let is_over = self.state.rupture.breaks().iter().any(|b| b.age <= since);
        if !fault.lasts(time) || is_over {
            return;
        }
        if let Some(segment) = self.limb_above_arm(fault) {
            let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
            let (tree, gravity) = (&parts.tree, spec.sim.gravity.si());
            state.rupture.break_joint(tree, &parts.model, &mut state.data, &spec.wood, gravity, segment);
        }
    }

    /// The heaviest limb that a fault allows above the arm; the first of equal ones.
    fn limb_above_arm(&self, fault: &FaultSpec) -> Option<usize> {
        let Parts { tree, handle, .. } = &*self.parts;
        let data = &self.state.data;
        let arm: Vec<Vec3> = (handle.arm.iter().map(|&body| data.x_world_body(body).translation.vector))
            .chain([handle.x_world_tcp(data).translation.vector])
            .collect();
        let is_above = |p: &Vec3| {
            arm.iter().any(|q| {
                let off = p - q;
                off.xy().norm() <= fault.limb_distance.si() && (0.0..=fault.limb_height.si()).contains(&off.z)
            })
        };
        let mut above: Vec<bool> =
            tree.bodies.iter().map(|&body| is_above(&data.x_world_body(body).translation.vector)).collect();
        let mut mass = self.loads_of_segments();
        // A parent stands before its children.
        for segment in (0..mass.len()).rev() {
            if let Some(parent) = tree.parent[segment] {
                mass[parent] += mass[segment];
                above[parent] |= above[segment];
            }
        }
        let mut best: Option<usize> = None;
        for segment in 0..mass.len() {
            let is_live = tree.parent[segment].is_some() && !self.state.rupture.is_debris(segment);
            let falls = is_live && above[segment] && fault.limb_mass.contains_si(mass[segment]);
            if falls && best.is_none_or(|heaviest| mass[segment] > mass[heaviest]) {
                best = Some(segment);
            }
        }
        best
    }

    /// Mass of each segment with the fruit that hang on it \[kg\].
    fn loads_of_segments(&self) -> Vec<f64> {
        let Parts { tree, model, fruit, .. } = &*self.parts;
        let mut mass: Vec<f64> = tree.bodies.iter().map(|&body| model.body(body).inertia.mass).collect();
        for (fruit, point) in fruit.fruit.iter().zip(&fruit.points) {
            if self.state.data.tethered[point.index()] {
                mass[fruit.segment] += model.points()[point.index()].mass;
            }
        }
        mass
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_robot::{Command, RobotModel};
    use std::sync::Arc;

    /// A world with a fault of a kind from 0.1 s to 1 s, whose limbs need not be near the arm.
    fn world(kind: &str) -> World {
        let figure = |value: f64, unit: &str| {
            format!("{{ value = {value}, range = [0, 36000], unit = '{unit}', source = 'test' }}")
        };
        let text = format!(
            "[fault]\nbase = 'standard'\nkind = '{kind}'\nfrom = {}\nuntil = {}\nlimb_distance = {}\nlimb_height = {}",
            figure(0.1, "s"),
            figure(1.0, "s"),
            figure(10.0, "m"),
            figure(100.0, "m")
        );
        let spec = Spec::paper().overlaid("x", text.parse().expect("TOML")).expect("in range");
        World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 20250704, 0).expect("it grows")
    }

    /// The heaviest limb in the range falls once, in the first frame of the fault, and no event says that the robot has snapped it.
    #[test]
    fn a_limb_falls_once() {
        let mut world = world("limb_falls");
        let command = Command::still(&world.sense());
        let mass = world.loads_of_segments();
        let tree = world.tree();
        let of = |segment: usize| tree.subtree(segment).iter().map(|&i| mass[i]).sum::<f64>();
        let limbs: Vec<f64> = (0..mass.len()).map(of).collect();
        let fault = world.spec().fault.clone().expect("a fault");
        let may_fall = |i: &usize| tree.parent[*i].is_some() && fault.limb_mass.contains_si(limbs[*i]);
        let heaviest = (0..mass.len()).filter(may_fall).map(|i| limbs[i]).fold(0.0, f64::max);
        for frame in 0..12 {
            world.step(&command);
            let broken = world.rupture().breaks().len();
            // Frame 6 ends at 0.1 s.
            assert_eq!(broken, usize::from(frame >= 5), "frame {frame}");
        }
        let fallen = limbs[world.rupture().breaks()[0].segment];
        assert!((fallen - heaviest).abs() < 1e-9, "{fallen} of {heaviest} kg");
        let snapped = |event: &crate::WorldEvent| matches!(event, crate::WorldEvent::BranchSnapped { .. });
        assert!(!world.drain_events().iter().any(snapped));
    }

    /// A weight makes the arm sag and shows in its torques; afterwards the arm rises again.
    #[test]
    fn a_weight_hangs_on_the_arm() {
        let (mut free, mut loaded) = (world("none"), world("weight_on_arm"));
        let command = Command::still(&free.sense());
        let height = |world: &World| world.handle().x_world_tcp(world.data()).translation.vector.z;
        for frame in 0..120 {
            free.step(&command);
            loaded.step(&command);
            let sag = height(&free) - height(&loaded);
            match frame {
                0..5 => assert_eq!(sag, 0.0),
                30 => {
                    assert!(sag > 1e-5, "{sag} m");
                    let arm = free.robot().kinematics();
                    let (free, loaded) = (free.sense(), loaded.sense());
                    let held = loaded.arm_torque.vector() - free.arm_torque.vector();
                    // The torques hold the weight at some point of the wrist.
                    let lift =
                        arm.jacobian(&free.arm_q.vector()).fixed_rows::<3>(3).row(2).transpose() * 40.0;
                    assert!(held.norm() > 0.3 * lift.norm(), "{held} of {lift}");
                }
                119 => assert!(sag.abs() < 1e-4, "{sag} m"),
                _ => {}
            }
        }
    }
}
