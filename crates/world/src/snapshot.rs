//! A world at one moment, in memory or as the bytes of a file.

use crate::World;
use crate::camera::{CameraTruth, Flight, Shot, Sight};
use crate::envelope;
use crate::event::{Status, WorldEvent};
use crate::identity::Identity;
use crate::load::WoodLoad;
use crate::sensing::Odometry;
use crate::snapshot_error::SnapshotError;
use crate::state::State;
use crate::suction;
use crate::touch::fruit_touches;
use orchard_fruit::{FruitLives, Partner};
use orchard_multibody::{Data, StepReport};
use orchard_robot::{Command, SetPoints, Suction};
use orchard_treephys::Rupture;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::Arc;

/// A world at one moment: all that its future depends on. Tree, model and robot are not in it; the caller who restores
/// it builds the same world first.
///
/// [`World::restore`] restores it, and the same commands then give the same bits as without the
/// interruption. So does a restored copy of [`Snapshot::to_bytes`] in another process or on another machine. The
/// checksum detects damage, not forgery.
#[derive(Debug, Clone)]
pub struct Snapshot {
    content: Content,
    /// Saves drawing the latest image again.
    image: Option<Arc<CameraTruth>>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct Content {
    identity: Identity,
    data: orchard_multibody::State,
    rupture: Rupture,
    fruit: FruitLives,
    servos: SetPoints,
    suction: Suction,
    frame: u32,
    status: Status,
    events: Vec<WorldEvent>,
    gripped: Vec<bool>,
    report: StepReport,
    /// Motion that the latest depth image was drawn from.
    shot: Option<Shot>,
    flight: Flight,
    load: WoodLoad,
    odometry: Odometry,
    /// Commands on their way to the robot.
    commands: VecDeque<Command>,
}

impl Snapshot {
    /// The bytes of a save file: magic, format version, what world it is, the state, checksum.
    pub fn to_bytes(&self) -> Vec<u8> {
        let body = postcard::to_stdvec(&self.content);
        envelope::seal(&body.unwrap_or_else(|e| unreachable!("lists of numbers serialise: {e}")))
    }

    /// Reads what [`Snapshot::to_bytes`] wrote.
    ///
    /// # Errors
    /// Not a snapshot, another format version, cut off, too long, damaged.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SnapshotError> {
        let body = envelope::open(bytes)?;
        let (content, rest) = postcard::take_from_bytes(body).map_err(SnapshotError::Unreadable)?;
        if !rest.is_empty() {
            return Err(SnapshotError::Content("length"));
        }
        Ok(Self { content, image: None })
    }

    /// Frame in which it was taken.
    pub fn frame(&self) -> u32 {
        self.content.frame
    }
}

impl World {
    /// Takes a snapshot.
    pub fn snapshot(&self) -> Snapshot {
        // No `..`: a new field must be sorted here into state or scratch.
        let State {
            data,
            rupture,
            fruit,
            servos,
            suction,
            frame,
            status,
            events,
            gripped,
            report,
            image,
            shot,
            flight,
            load,
            odometry,
            commands,
            touches: _,
            touches_before: _,
            touched: _,
            loose: _,
            before: _,
            vicinity: _,
            speeds: _,
            groups_beside: _,
            is_behind,
        } = &self.state;
        assert!(!is_behind, "wood and fruit are behind the robot");
        let content = Content {
            identity: self.identity,
            data: data.state(),
            rupture: rupture.clone(),
            fruit: fruit.clone(),
            servos: *servos.set_points(),
            suction: *suction,
            frame: *frame,
            status: status.clone(),
            events: events.clone(),
            gripped: gripped.clone(),
            report: report.clone(),
            shot: shot.clone(),
            flight: flight.clone(),
            load: *load,
            odometry: *odometry,
            commands: commands.clone(),
        };
        Snapshot { content, image: image.clone() }
    }

    /// Checks that [`World::restore`] would take a snapshot.
    ///
    /// # Errors
    /// It belongs to another world, or its content does not fit this one.
    pub fn check(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (content, parts) = (&snapshot.content, &*self.parts);
        self.identity.check(&content.identity)?;
        self.state.data.check(&content.data)?;
        let (fruit, segments, colliders) =
            (parts.fruit.len(), parts.tree.len(), parts.model.colliders().len());
        let event_fits = |event: &WorldEvent| match *event {
            WorldEvent::FruitGripped { fruit: i, .. }
            | WorldEvent::FruitDetached { fruit: i, .. }
            | WorldEvent::FruitDeposited { fruit: i, .. }
            | WorldEvent::FruitDropped { fruit: i, .. }
            | WorldEvent::FingerContactBegan { fruit: i, .. }
            | WorldEvent::SealLost { fruit: i, .. }
            | WorldEvent::FruitTakenAway { fruit: i, .. }
            | WorldEvent::FingerContactEnded { fruit: i, .. } => i < fruit,
            WorldEvent::FruitImpact { fruit: i, partner, .. } => {
                i < fruit && !matches!(partner, Partner::Fruit(k) if k >= fruit)
            }
            WorldEvent::BranchSnapped { segment, .. } => segment < segments,
        };
        let contacts = &content.report.contacts;
        let mut images = content.shot.iter().chain(content.flight.shots());
        let fits = [
            (content.rupture.fits(&parts.tree), "ruptures"),
            (content.fruit.fits(&parts.fruit) && content.gripped.len() == fruit, "fruit"),
            (content.events.iter().all(event_fits), "events"),
            (contacts.iter().all(|c| c.a.index() < colliders && c.b.index() < colliders), "contacts"),
            (content.load.fits(segments), "load"),
            (suction::fits(&content.suction, fruit), "suction"),
            (images.all(|shot| shot.motion.fits(&parts.model)), "image"),
            (
                parts.sensing.as_ref().map_or(content.commands.is_empty(), |s| s.fits(&content.commands)),
                "commands",
            ),
        ];
        match fits.into_iter().find(|(fits, _)| !fits) {
            Some((_, what)) => Err(SnapshotError::Content(what)),
            None => Ok(()),
        }
    }

    /// Restores a snapshot of this world or of one built from the same spec, robot, seed and index.
    ///
    /// # Errors
    /// As [`World::check`]; then nothing has changed.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.check(snapshot)?;
        let Content {
            identity: _,
            data,
            rupture,
            fruit,
            servos,
            suction,
            frame,
            status,
            events,
            gripped,
            report,
            shot,
            flight,
            load,
            odometry,
            commands,
        } = &snapshot.content;
        let state = &mut self.state;
        state.data.restore(&self.parts.model, data)?;
        state.rupture.clone_from(rupture);
        state.fruit.clone_from(fruit);
        state.servos.restore(servos);
        state.suction = *suction;
        state.frame = *frame;
        state.status.clone_from(status);
        state.events.clone_from(events);
        state.gripped.clone_from(gripped);
        // The buffer stays, so that the next frames find it grown.
        let mut contacts = std::mem::take(&mut state.report.contacts);
        contacts.clone_from(&report.contacts);
        state.report = StepReport { contacts, ..*report };
        state.shot.clone_from(shot);
        state.flight.clone_from(flight);
        state.load = *load;
        state.odometry = *odometry;
        state.commands.clone_from(commands);
        let sealed = suction::sealed(suction, &self.parts);
        fruit_touches(&self.parts.colliders, report, sealed, &mut state.touches);
        self.prepared = None;
        self.state.image = match (&snapshot.image, shot) {
            (None, Some(shot)) => Some(Arc::new(self.coloured(self.earlier(shot).take()))),
            (image, _) => image.clone(),
        };
        Ok(())
    }

    /// What the camera saw at an earlier moment.
    pub(crate) fn earlier(&self, shot: &Shot) -> Sight {
        self.sight(&self.at(shot), shot.frame)
    }

    /// Places of all bodies at an earlier moment.
    pub(crate) fn at(&self, shot: &Shot) -> Data {
        let mut then = Data::clone(&self.start);
        then.restore_motion(&shot.motion);
        orchard_multibody::forward_kinematics(&self.parts.model, &mut then);
        then
    }
}

#[cfg(test)]
#[path = "snapshot_tests.rs"]
mod tests;
