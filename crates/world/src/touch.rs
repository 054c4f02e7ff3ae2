//! Touches between parts of a world, from the contacts of a substep.

use orchard_multibody::{ColliderId, Model, Owner, StepReport};
use orchard_robot::RobotHandle;

/// Part of the world that a collider belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    Ground,
    Wood,
    Fruit(usize),
    Finger(usize),
    Scenery,
    Chassis,
    Bucket,
    /// Arm up to the hand, and all other parts of the robot.
    Arm,
    Hand,
    /// Point of a suction cup's lip.
    Cup(usize),
}

impl Part {
    /// True if it is part of the robot.
    pub fn is_robot(self) -> bool {
        matches!(self, Part::Chassis | Part::Bucket | Part::Arm | Part::Hand | Part::Finger(_) | Part::Cup(_))
    }
}

/// Part of every collider of a model.
pub(crate) fn parts(
    model: &Model,
    wood: &[ColliderId],
    fruit: &[ColliderId],
    ground: ColliderId,
    scenery: &[ColliderId],
    handle: &RobotHandle,
) -> Vec<Part> {
    let mut parts = vec![Part::Arm; model.colliders().len()];
    for &c in &handle.colliders.arm {
        if matches!(model.collider(c).owner, Owner::Body(body) if body == handle.wrist()) {
            parts[c.index()] = Part::Hand;
        }
    }
    for c in &handle.colliders.base {
        parts[c.index()] = Part::Chassis;
    }
    for c in &handle.colliders.bucket {
        parts[c.index()] = Part::Bucket;
    }
    for (point, c) in handle.colliders.cup.iter().enumerate() {
        parts[c.index()] = Part::Cup(point);
    }
    parts[ground.index()] = Part::Ground;
    for c in scenery {
        parts[c.index()] = Part::Scenery;
    }
    for c in wood {
        parts[c.index()] = Part::Wood;
    }
    for (i, c) in fruit.iter().enumerate() {
        parts[c.index()] = Part::Fruit(i);
    }
    for (side, finger) in handle.colliders.fingers.iter().enumerate() {
        for c in finger {
            parts[c.index()] = Part::Finger(side);
        }
    }
    parts
}

/// Parts that press on one fruit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct FruitTouch {
    pub ground: bool,
    pub fingers: [bool; 2],
    /// The hand without fingers and cup.
    pub hand: bool,
    /// The lip of the suction cup.
    pub cup: bool,
    /// The vacuum of the suction cup holds on to it.
    pub sealed: bool,
}

impl FruitTouch {
    /// True if a finger or the lip of the cup presses on the fruit.
    pub fn by_finger(&self) -> bool {
        self.fingers[0] || self.fingers[1] || self.cup
    }

    /// Both of what a grip needs: one finger and the other, or the lip of the cup and its vacuum.
    pub fn grip(&self) -> [bool; 2] {
        [self.fingers[0] || self.cup, self.fingers[1] || (self.cup && self.sealed)]
    }
}

/// Contacts with a pressing force, per fruit; `sealed` is the fruit that the cup's vacuum holds on to.
pub(crate) fn fruit_touches(
    parts: &[Part],
    report: &StepReport,
    sealed: Option<usize>,
    touches: &mut [FruitTouch],
) {
    touches.fill(FruitTouch::default());
    for contact in &report.contacts {
        if contact.force_world.dot(&contact.n_world) == 0.0 {
            continue;
        }
        let (a, b) = (parts[contact.a.index()], parts[contact.b.index()]);
        for (one, other) in [(a, b), (b, a)] {
            match (one, other) {
                (Part::Fruit(i), Part::Ground) => touches[i].ground = true,
                (Part::Fruit(i), Part::Finger(side)) => touches[i].fingers[side] = true,
                (Part::Fruit(i), Part::Hand) => touches[i].hand = true,
                (Part::Fruit(i), Part::Cup(_)) => touches[i].cup = true,
                _ => {}
            }
        }
    }
    if let Some(touch) = sealed.and_then(|i| touches.get_mut(i)) {
        touch.sealed = true;
    }
}
