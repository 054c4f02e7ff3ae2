//! The part of a world in a lane that is not in the tile: its plant, and the f64 rules of breaking.

use crate::fault::{Quarantine, Status};
use crate::ground::{Ball, DebrisTip};
use crate::schedule::Walk;
use crate::tree_world::{Plant, TreeWorld};
use orchard_fruit::StemLife;
use orchard_geometry::{Shape, Vec3};
use orchard_multibody::contact::in_series;
use orchard_multibody::{Data, forward_kinematics};
use orchard_treephys::Rupture;
use std::sync::Arc;

/// Properties of a link that breaking changes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Wood {
    /// Drag of translation and of rotation [1/s].
    pub drag: [f64; 2],
    /// Joint stiffness [N m/rad].
    pub stiffness: f64,
    /// Joint damping [N m s/rad].
    pub damping: f64,
    /// True if the spring leads: it then acts without the joint's present rate.
    pub leads: bool,
}

impl Wood {
    /// Inertia that the joint's implicit spring and damper add [kg m^2].
    pub fn armature(&self, h: f64) -> f64 {
        h * (self.damping + h * self.stiffness)
    }

    /// Factor of the joint's rate in the impulse of spring and damper [kg m^2].
    pub fn h_damping(&self, h: f64) -> f64 {
        if self.leads { h * self.damping } else { self.armature(h) }
    }
}

/// A lane's own numbers as they were when it was taken out, `[row][field]`.
#[derive(Debug, Clone)]
pub(crate) struct Remains {
    pub links: Vec<f32>,
    pub fruit: Vec<f32>,
    pub stems: Vec<f32>,
    pub stem_limits: Vec<f32>,
}

/// The world of one lane, apart from its numbers.
#[derive(Debug, Clone)]
pub(crate) struct LaneWorld {
    /// Place in the batch.
    pub index: usize,
    pub plant: Arc<Plant>,
    pub walk: Walk,
    /// Row of each fruit.
    pub fruit_row: Vec<usize>,
    pub rupture: Rupture,
    /// Drag, springs and dampers of each link, as the f64 state has them.
    pub wood: Vec<Wood>,
    /// Rows of the joints that broke.
    pub broken_rows: Vec<usize>,
    /// Fruit off the stem, by index, as balls.
    pub loose: Vec<(usize, Ball)>,
    /// Lives of the stems, by fruit; empty on tethers.
    pub stems: Vec<StemLife>,
    /// Tips of the links of broken limbs.
    pub debris: Vec<DebrisTip>,
    /// The f64 state that the rules of breaking work on; `None` before the first break.
    shadow: Option<Box<Data>>,
    /// Frame of the tile in which the world's time was 0.
    pub began: i64,
    /// Time and reason at which it was stopped, and its numbers then.
    stopped: Option<(Quarantine, Remains)>,
}

impl LaneWorld {
    /// A world that joins its tile at a frame.
    pub fn new(index: usize, world: &TreeWorld, walk: Walk, fruit_row: Vec<usize>, frame: u32) -> Self {
        let rupture = world.rupture().clone();
        let shadow = (!rupture.breaks().is_empty()).then(|| Box::new(world.data().clone()));
        let (wood, stems) = (vec![Wood::default(); walk.links.len()], fruit_row.len());
        let is_broken = |segment: &usize| rupture.breaks().iter().any(|b| b.segment == *segment);
        let broken_rows = (0..walk.links.len()).filter(|row| is_broken(&walk.links[*row])).collect();
        Self {
            index,
            plant: world.plant().clone(),
            walk,
            fruit_row,
            rupture,
            wood,
            broken_rows,
            loose: Vec::new(),
            stems: if world.has_stems() { vec![StemLife::default(); stems] } else { Vec::new() },
            debris: Vec::new(),
            shadow,
            began: i64::from(frame) - i64::from(world.frame()),
            stopped: None,
        }
    }

    /// True if it has not been stopped.
    pub fn is_running(&self) -> bool {
        self.stopped.is_none()
    }

    /// True if it has joints whose dampers follow their rates.
    pub fn is_braking(&self) -> bool {
        self.is_running() && !self.broken_rows.is_empty()
    }

    pub fn status(&self) -> Status {
        self.stopped.as_ref().map_or(Status::Running, |(quarantine, _)| Status::Quarantined(*quarantine))
    }

    /// Stops it for good.
    pub fn quarantine(&mut self, quarantine: Quarantine, remains: Remains) {
        self.stopped = Some((quarantine, remains));
    }

    /// The numbers of a world that was stopped.
    pub fn remains(&self) -> Option<&Remains> {
        self.stopped.as_ref().map(|(_, remains)| remains)
    }

    /// A fruit of a running world whose spin, which is in no vector, is not finite.
    pub fn bad_spin(&self) -> Option<usize> {
        let is_bad = |ball: &Ball| !ball.w_world.iter().all(|x| x.is_finite());
        let found = self.loose.iter().find(|(_, ball)| is_bad(ball)).filter(|_| self.is_running())?;
        Some(found.0)
    }

    /// Takes the f64 state, to be updated and put back.
    pub fn take_shadow(&mut self) -> Box<Data> {
        self.shadow.take().unwrap_or_else(|| Box::new(Data::new(&self.plant.model)))
    }

    pub fn keep_shadow(&mut self, shadow: Box<Data>) {
        self.shadow = Some(shadow);
    }

    /// Breaks a joint of the state in `data`.
    pub fn break_joint(&mut self, data: &mut Data, segment: usize) {
        let Plant { spec, model, tree, .. } = &*self.plant;
        forward_kinematics(model, data);
        self.rupture.break_joint(tree, model, data, &spec.wood, spec.sim.gravity.si(), segment);
        self.plant.fruit.weigh_on(data, |segment| self.rupture.is_debris(segment));
        self.broken_rows.extend(self.walk.links.iter().position(|link| *link == segment));
    }

    /// Marks a fruit as loose, with its angular velocity.
    pub fn let_loose(&mut self, fruit: usize, w_world: Vec3) {
        let Plant { spec, model, fruit: set, .. } = &*self.plant;
        let ball = Ball {
            radius: set.fruit[fruit].radius,
            inertia: model.point(set.points[fruit]).spin_inertia,
            friction: (spec.fruit.friction.si() * spec.sim.ground_friction.si()).sqrt(),
            stiffness: in_series(spec.fruit.contact_stiffness.si(), spec.sim.ground_stiffness.si()),
            spin_loss: spec.fruit.rolling_loss.si(),
            w_world,
        };
        self.loose.push((fruit, ball));
    }

    /// Adds the tips of links that have become debris.
    pub fn list_debris(&mut self) {
        let Plant { spec, model, tree, .. } = &*self.plant;
        let friction = (spec.wood.friction.si() * spec.sim.ground_friction.si()).sqrt();
        let stiffness = in_series(spec.wood.contact_stiffness.si(), spec.sim.ground_stiffness.si());
        for (row, &segment) in self.walk.links.iter().enumerate() {
            if self.rupture.is_debris(segment) && !self.debris.iter().any(|tip| tip.row == row) {
                let Shape::Capsule { radius, .. } = model.collider(tree.colliders[segment]).shape else {
                    continue;
                };
                self.debris.push(DebrisTip::new(row, radius, friction, stiffness));
            }
        }
    }

    /// Sets the dampers of the broken joints for the next substep, from their rates by row [rad/s].
    pub fn brake(&mut self, rate: impl Fn(usize) -> [f64; 2]) {
        let Plant { spec, model, tree, settings, .. } = &*self.plant;
        let Some(data) = self.shadow.as_deref_mut() else { return };
        let dof = |row: usize| model.dofs(tree.bodies[self.walk.links[row]]).start;
        for &row in &self.broken_rows {
            data.v[dof(row)..dof(row) + 2].copy_from_slice(&rate(row));
        }
        self.rupture.begin_substep(tree, model, data, &spec.wood, settings.h);
        for &row in &self.broken_rows {
            self.wood[row].damping = data.damping[dof(row)];
        }
    }

    /// True if these numbers of frames over the direct pull, or over the stem tension, detach a fruit.
    pub fn is_detached_after(&self, pull_frames: u32, tension_frames: u32) -> bool {
        let spec = &self.plant.spec.fruit;
        pull_frames >= spec.pull_frames.get() || tension_frames >= spec.tension_frames.get()
    }

    /// The fruit of a row, and its air drag off the stem.
    pub fn loose_fruit(&self, row: usize) -> Option<(usize, f64)> {
        let i = self.fruit_row.iter().position(|r| *r == row)?;
        Some((i, self.plant.fruit.air_drag(i)))
    }
}
