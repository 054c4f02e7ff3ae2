//! Figures over time, for plots.

use std::collections::VecDeque;

use orchard_multibody::ContactReport;
use orchard_robot::RobotHandle;
use orchard_world::World;

use crate::session::Session;

/// Frames of the world in a sample.
const FRAMES: u32 = 6;
/// Samples that are kept.
const KEPT: usize = 750;

/// Figures of some frames.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sample {
    /// Time at their end \[s\].
    pub time: f64,
    /// Largest force of the robot on living wood \[N\], the mean over a frame.
    pub on_wood: f64,
    /// Largest sum of the contact forces on fingers or cup \[N\].
    pub in_hand: f64,
    /// Fruit in the bucket.
    pub picked: u32,
    /// Fruit on the ground.
    pub dropped: u32,
}

/// The latest samples.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    samples: VecDeque<Sample>,
    open: Sample,
}

/// Contacts of the latest step whose force is felt \[N\].
pub fn contacts(world: &World) -> impl Iterator<Item = &ContactReport> {
    const FELT: f64 = 0.02;
    world.report().contacts.iter().filter(|contact| contact.force_world.norm() > FELT)
}

/// True for a contact of a finger or of the lip of a suction cup.
fn is_in_hand(contact: &ContactReport, handle: &RobotHandle) -> bool {
    let colliders = &handle.colliders;
    let of_hand = |id| colliders.fingers.iter().flatten().chain(&colliders.cup).any(|own| *own == id);
    of_hand(contact.a) || of_hand(contact.b)
}

impl Trace {
    /// Takes the figures of the frame that a session has just stepped.
    pub fn take(&mut self, session: &Session) {
        let world = session.world();
        let frame = world.spec().sim.frame();
        let in_hand = contacts(world).filter(|contact| is_in_hand(contact, world.handle()));
        let in_hand: f64 = in_hand.map(|contact| contact.force_world.norm()).sum();
        self.open.on_wood = self.open.on_wood.max(world.wood_load().frame_impulse / frame);
        self.open.in_hand = self.open.in_hand.max(in_hand);
        if world.frame().is_multiple_of(FRAMES) {
            let told = session.told();
            let (picked, dropped) = (told.picked, told.dropped);
            self.samples.push_back(Sample { time: told.time, picked, dropped, ..self.open });
            self.open = Sample::default();
            while self.samples.len() > KEPT {
                self.samples.pop_front();
            }
        }
    }

    /// Forgets all samples.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// The samples, oldest first.
    pub fn samples(&self) -> impl ExactSizeIterator<Item = &Sample> {
        self.samples.iter()
    }
}
