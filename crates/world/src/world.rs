//! The world: state, step order, observation.

mod visible;

use crate::build::{Parts, WorldError, build};
use crate::camera::{CameraTruth, Shot, Shutter, Sight};
use crate::event::{Status, WorldEvent};
use crate::identity::{Identity, Start};
use crate::load::WoodLoad;
use crate::planting::{Appearance, Planting};
use crate::state::State;
use orchard_camera::{ImageKey, MovingScene, Sensor};
use orchard_fruit::{FruitLives, FruitSet};
use orchard_geometry::{HeightField, Pose};
use orchard_multibody::{Data, Model, StepReport, accept_overlaps, equilibrium};
use orchard_robot::{Command, Observation, PictureRequest, RobotHandle, RobotModel, observe};
use orchard_spec::Spec;
use orchard_treegen::Skeleton;
use orchard_treephys::{Rupture, TreeBody};
use std::sync::{Arc, OnceLock};

/// Largest joint move \[rad\] of the last statics iteration: a few units in the last place of a bent joint.
const EQUILIBRIUM_TOLERANCE: f64 = 1e-14;

/// One orchard world. A clone continues with the same bits; [`World::snapshot`] is smaller and can be saved.
#[derive(Debug, Clone)]
pub struct World {
    /// Spec as given.
    config: Arc<Spec>,
    /// Spec with this world's own constants.
    pub(crate) spec: Arc<Spec>,
    robot: Arc<RobotModel>,
    pub(crate) appearance: Appearance,
    /// True if the tree grew from the seed.
    grown: bool,
    /// Number of the robot's start pose.
    repeat: u32,
    pub(crate) parts: Arc<Parts>,
    pub(crate) identity: Identity,
    pub(crate) sensor: Arc<Sensor>,
    /// Everything that can be seen.
    visible: Arc<MovingScene>,
    /// What pictures show, made when it is first asked for.
    pictured: Arc<OnceLock<Arc<MovingScene>>>,
    pub(crate) shutter: Shutter,
    pub(crate) start: Arc<Data>,
    pub(crate) state: State,
    /// Pictures that observations deliver.
    pub(crate) pictures: Option<Arc<PictureRequest>>,
    /// True if the camera takes a colour image with each depth image.
    pub(crate) takes_colour: bool,
    /// An image that was drawn elsewhere for the present frame.
    pub(crate) prepared: Option<Box<CameraTruth>>,
}

impl World {
    /// Builds the world of one index of one seed, at rest under gravity, the robot at its start.
    ///
    /// # Errors
    /// The tree does not grow, the robot lacks a part, or the loaded tree finds no rest.
    pub fn new(spec: Arc<Spec>, robot: Arc<RobotModel>, seed: u64, world: u32) -> Result<Self, WorldError> {
        Self::of_episode(spec, robot, seed, world, 0)
    }

    /// Builds the world of an episode: the first is 0, the next ones are those of [`Self::resampled`].
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_episode(
        spec: Arc<Spec>,
        robot: Arc<RobotModel>,
        seed: u64,
        world: u32,
        episode: u32,
    ) -> Result<Self, WorldError> {
        Self::grow(spec, robot, Start { seed, world, episode }, 0)
    }

    /// Builds the world of [`Self::new`] with another start pose of the robot; all else is the same, bit for bit. Repeat 0 is [`Self::new`].
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_repeat(
        spec: Arc<Spec>,
        robot: Arc<RobotModel>,
        seed: u64,
        world: u32,
        repeat: u32,
    ) -> Result<Self, WorldError> {
        Self::grow(spec, robot, Start { seed, world, episode: 0 }, repeat)
    }

    fn grow(spec: Arc<Spec>, robot: Arc<RobotModel>, start: Start, repeat: u32) -> Result<Self, WorldError> {
        let planting = Planting::draw(&spec, start.seed, start.world, start.episode)?;
        Ok(Self { grown: true, ..Self::around(spec, robot, planting, start, repeat)? })
    }

    /// Builds a world around a tree that was not grown from the seed: for example a digitised one. The
    /// randomisation does not change it. Seed and index draw all else: fruit, stems, the robot's start, of which every repeat has another.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_tree(
        spec: Arc<Spec>,
        robot: Arc<RobotModel>,
        skeleton: Skeleton,
        seed: u64,
        world: u32,
        repeat: u32,
    ) -> Result<Self, WorldError> {
        let planting = Planting::of_tree(spec.clone(), skeleton, seed, world);
        Self::around(spec, robot, planting, Start { seed, world, episode: 0 }, repeat)
    }

    fn around(
        config: Arc<Spec>,
        robot: Arc<RobotModel>,
        planting: Planting,
        start: Start,
        repeat: u32,
    ) -> Result<Self, WorldError> {
        let Planting { spec, skeleton, mut fruit, appearance } = planting;
        let (mut parts, data) = loop {
            let parts =
                build(&spec, &robot, skeleton.clone(), fruit.clone(), start.seed, start.world, repeat)?;
            let mut data = Data::new(&parts.model);
            parts.tree.reset(&parts.model, &mut data, &spec.wood);
            parts.fruit.reset(&parts.model, &mut data);
            robot.set_start(&parts.model, &mut data, &parts.handle);
            equilibrium(&parts.model, &mut data, &parts.settings.gravity, EQUILIBRIUM_TOLERANCE)?;
            // The tree sags under its crop, and fruit that hung clear of each other may not any more.
            let cluster = spec.fruit.cluster.as_ref();
            let inside = cluster.map(|law| parts.fruit.inside_others(&data, law.flat.si()));
            let inside = inside.unwrap_or_default();
            if inside.is_empty() {
                break (parts, data);
            }
            let mut index = 0..;
            fruit.retain(|_| index.next().is_some_and(|i| inside.binary_search(&i).is_err()));
        };
        parts.tree.strengthen_to_stand(&parts.model, &data, &spec.wood);
        parts.fruit.strengthen_to_hang(&parts.model, &data);
        accept_overlaps(&mut parts.model, &data);
        let sensor = Arc::new(Sensor::new(&spec.camera));
        let visible = Arc::new(visible::moving_scene(&spec, &parts, &robot));
        let shutter = Shutter::new(&spec);
        let state = State::new(&parts, &robot, data.clone(), shutter);
        let identity = Identity::new(&config, &robot, start, repeat, &parts);
        Ok(Self {
            config,
            spec,
            robot,
            appearance,
            grown: false,
            repeat,
            parts: Arc::new(parts),
            identity,
            sensor,
            visible,
            pictured: Arc::default(),
            shutter,
            start: Arc::new(data),
            state,
            pictures: None,
            takes_colour: false,
            prepared: None,
        })
    }

    /// Builds this world's next episode if the randomisation draws again at every reset; else returns `None`, and
    /// [`Self::reset`] begins the next episode.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn resampled(&self) -> Result<Option<Self>, WorldError> {
        if !(self.grown && self.config.randomisation.mode.resamples()) {
            return Ok(None);
        }
        let Start { seed, world, episode } = self.identity.start;
        let next = episode.wrapping_add(1);
        let start = Start { seed, world, episode: next };
        let next = Self::grow(self.config.clone(), self.robot.clone(), start, self.repeat)?;
        Ok(Some(Self { pictures: self.pictures.clone(), takes_colour: self.takes_colour, ..next }))
    }

    /// Brings the world back to the start of its episode.
    pub fn reset(&mut self) {
        self.state = State::new(&self.parts, &self.robot, Data::clone(&self.start), self.shutter);
        self.prepared = None;
    }

    /// Advances one frame under a command: servos, broken joints' friction and physics each substep, then
    /// rupture, stems and rest once. A quarantined world stands still.
    pub fn step(&mut self, command: &Command) {
        if self.state.status != Status::Running {
            return;
        }
        assert!(!self.state.is_behind, "wood and fruit are behind the robot");
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        state.advance(spec, parts, &self.start, command);
        self.end_of_frame();
    }

    /// Keeps what the camera will show, and tests if the world is plausible.
    pub(crate) fn end_of_frame(&mut self) {
        self.prepared = None;
        self.drop_limb();
        let state = &mut self.state;
        state.flight.end_frame(self.shutter, state.frame, &state.data);
        self.judge_extent();
    }

    /// Stops the world if a number is not finite or a part has left the plausible box.
    pub(crate) fn judge_extent(&mut self) {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        if let Some(reason) = state.implausible(&parts.model, spec.sim.plausible_extent.si()) {
            state.status = Status::Quarantined { frame: state.frame, reason };
        }
    }

    /// Breaks the joint at a segment's base now, as if its moment had passed the rupture moment.
    pub fn break_branch(&mut self, segment: usize) {
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        if !state.rupture.is_debris(segment) {
            let gravity = spec.sim.gravity.si();
            let State { rupture, data, .. } = state;
            rupture.break_joint(&parts.tree, &parts.model, data, &spec.wood, gravity, segment);
            state.events.push(WorldEvent::BranchSnapped { segment, frame: state.frame });
        }
    }

    /// Returns the robot's observation, with a depth image on the frames in which the camera delivers one. It shows the moment
    /// [`Observation::depth_time`], the camera's latency ago. The image is the latest one from now on ([`Self::camera_truth`]). Colour pictures
    /// are there in the frames of [`Self::deliver_pictures`], and a colour image with each depth image after [`Self::deliver_colour`].
    pub fn observe(&mut self) -> Observation {
        let delivered = match self.prepared.take().filter(|truth| self.is_due(truth)) {
            Some(prepared) => Some(*prepared),
            None => self.delivers().map(Sight::take),
        };
        self.observe_image(delivered)
    }

    /// [`Self::observe`] with an image of the sight of [`Self::delivers`] that was drawn elsewhere.
    pub fn observe_image(&mut self, delivered: Option<CameraTruth>) -> Observation {
        let delivered = delivered.map(|truth| self.coloured(truth));
        if let Some(truth) = &delivered {
            self.keep_motion(truth.sight.frame);
        }
        let observation = self.observation(delivered.as_ref());
        if let Some(truth) = delivered {
            self.state.image = Some(Arc::new(truth));
        }
        observation
    }

    /// Has [`Self::observe`] deliver an image that was drawn elsewhere, if it is called in this frame: one of the sight of [`Self::delivers`].
    pub fn prepare_image(&mut self, drawn: CameraTruth) {
        self.prepared = Some(Box::new(drawn));
    }

    /// True if an image is the one that the camera delivers now.
    fn is_due(&self, truth: &CameraTruth) -> bool {
        self.shutter.taken(self.state.frame) == Some(truth.sight.frame)
    }

    /// Takes the image that the camera delivers now ([`Self::delivers`]) as the latest one without its pixels: they are drawn elsewhere and stay there, and are drawn here only if someone asks ([`CameraTruth::measured`]).
    pub fn deliver_undrawn(&mut self, sight: Sight) {
        self.keep_motion(sight.frame);
        self.replace_image(sight.undrawn());
    }

    /// Replaces the latest image by one of the same sight that was drawn elsewhere.
    pub fn replace_image(&mut self, drawn: CameraTruth) {
        self.state.image = Some(Arc::new(drawn));
    }

    /// Returns the observation of [`Self::observe`] without keeping its image as the latest one. A controller beside a policy uses it, so that
    /// the policy's images stay as they are.
    pub fn peek(&self) -> Observation {
        let prepared = self.prepared.as_deref().filter(|truth| self.is_due(truth)).cloned();
        let delivered = prepared.or_else(|| self.delivers().map(Sight::take));
        let delivered = delivered.map(|truth| self.coloured(truth));
        self.observation(delivered.as_ref())
    }

    fn observation(&self, image: Option<&CameraTruth>) -> Observation {
        let due = self.pictures.as_ref().filter(|request| request.is_due(self.state.frame));
        let pictures = due.map(|request| Arc::new(self.take_pictures(request)));
        let sensed = Observation { pictures, ..self.sense() };
        let Some(truth) = image else { return sensed };
        let depth_time = f64::from(truth.sight.frame) * self.spec.sim.frame();
        let colour = truth.colour.clone();
        Observation { depth: Some(truth.measured().clone()), colour, depth_time, ..sensed }
    }

    /// Returns the observation of [`Self::observe`] without depth image and pictures, which are not drawn.
    pub fn sense(&self) -> Observation {
        let (now, intrinsics) = (self.state.frame, *self.sensor.intrinsics());
        let time = f64::from(now) * self.spec.sim.frame();
        let exact = Observation {
            cup_pressure: 0.0 - self.state.suction.vacuum,
            ..observe(&self.parts.model, &self.state.data, &self.parts.handle, time, intrinsics)
        };
        match &self.parts.sensing {
            None => exact,
            Some(sensing) => sensing.read(exact, &self.state.odometry, now),
        }
    }

    /// True if the camera delivers an image a number of frames from now.
    pub fn delivers_in(&self, frames: u32) -> bool {
        self.shutter.taken(self.state.frame.saturating_add(frames)).is_some()
    }

    /// The image that the camera delivers now, if any, before it is drawn.
    pub fn delivers(&self) -> Option<Sight> {
        let State { data, flight, frame, .. } = &self.state;
        let taken = self.shutter.taken(*frame)?;
        if taken == *frame {
            Some(self.sight(data, taken))
        } else {
            flight.taken_in(taken).map(|shot| self.earlier(shot))
        }
    }

    /// The motion of an image that was taken in an earlier frame, if it is still kept.
    pub(crate) fn taken_at(&self, frame: u32) -> Option<&Shot> {
        let State { shot, flight, frame: now, .. } = &self.state;
        let latest = shot.as_ref().filter(|shot| shot.frame == frame);
        flight.taken_in(frame).or(latest).filter(|_| frame != *now)
    }

    /// Keeps the motion that the image of a frame shows, to draw it again after a restore.
    fn keep_motion(&mut self, taken: u32) {
        let State { data, shot, flight, frame, .. } = &mut self.state;
        let shot = shot.get_or_insert_default();
        if taken == *frame {
            shot.frame = taken;
            data.save_motion(&mut shot.motion);
        } else if let Some(in_flight) = flight.taken_in(taken) {
            shot.clone_from(in_flight);
        }
    }

    /// What the camera would see in an image taken now.
    pub fn sight_now(&self) -> Sight {
        self.sight(&self.state.data, self.state.frame)
    }

    /// What the camera sees in a state.
    pub(crate) fn sight(&self, data: &Data, frame: u32) -> Sight {
        assert!(!self.state.is_behind, "wood and fruit are behind the robot");
        let x_world_camera = self.parts.handle.x_world_camera(data);
        let Start { seed, world, .. } = self.identity.start;
        Sight {
            frame,
            visible: self.visible.clone(),
            x_world_body: self.x_world_visible(data),
            x_world_camera,
            key: ImageKey { seed, world, frame },
            sensor: self.sensor.clone(),
        }
    }

    /// Pose of the wrist camera's optical frame.
    pub fn x_world_camera(&self) -> Pose {
        self.parts.handle.x_world_camera(&self.state.data)
    }

    /// Takes the events since the last call.
    pub fn drain_events(&mut self) -> Vec<WorldEvent> {
        std::mem::take(&mut self.state.events)
    }

    /// Frames so far.
    pub fn frame(&self) -> u32 {
        self.state.frame
    }

    /// Index of the world under its seed.
    pub fn index(&self) -> u32 {
        self.identity.start.world
    }

    /// Number of the episode, from 0, in modes of randomisation that draw again at every reset; else 0.
    pub fn episode(&self) -> u32 {
        self.identity.start.episode
    }

    /// State of the world: running or quarantined.
    pub fn status(&self) -> &Status {
        &self.state.status
    }

    /// The spec that it was built from, with the wood and foliage that this world's randomisation drew.
    pub fn spec(&self) -> &Spec {
        &self.spec
    }

    /// [`Self::spec`], shared.
    pub fn shared_spec(&self) -> &Arc<Spec> {
        &self.spec
    }

    /// The grown tree.
    pub fn skeleton(&self) -> &Skeleton {
        &self.parts.skeleton
    }

    /// The bumps of the ground; `None` where it is the plane z = 0.
    pub fn terrain(&self) -> Option<&HeightField> {
        self.parts.ground.field()
    }

    /// The multibody model.
    pub fn model(&self) -> &Model {
        &self.parts.model
    }

    /// The multibody state.
    pub fn data(&self) -> &Data {
        &self.state.data
    }

    /// The multibody state, for tests that apply forces.
    pub fn data_mut(&mut self) -> &mut Data {
        self.prepared = None;
        &mut self.state.data
    }

    /// The tree's links.
    pub fn tree(&self) -> &TreeBody {
        &self.parts.tree
    }

    /// Broken joints and sub-trees.
    pub fn rupture(&self) -> &Rupture {
        &self.state.rupture
    }

    /// The fruit that grew.
    pub fn fruit(&self) -> &FruitSet {
        &self.parts.fruit
    }

    /// The fruit's state.
    pub fn fruit_lives(&self) -> &FruitLives {
        &self.state.fruit
    }

    /// Handles of the robot's parts in the model.
    pub fn handle(&self) -> &RobotHandle {
        &self.parts.handle
    }

    /// Pose of the odom frame: the robot's base at the start. It drifts with the odometry's errors: in it the base is where the
    /// wheels say that it is.
    pub fn x_world_odom(&self) -> Pose {
        let start = self.parts.x_world_odom;
        if self.parts.sensing.is_none() { start } else { start * self.state.odometry.drift() }
    }

    /// Pose of the odom frame at the start, before any drift.
    pub fn x_world_start(&self) -> Pose {
        self.parts.x_world_odom
    }

    /// Contacts of the latest substep.
    pub fn report(&self) -> &StepReport {
        &self.state.report
    }

    /// The truth behind the latest depth image.
    pub fn camera_truth(&self) -> Option<&CameraTruth> {
        self.state.image.as_deref()
    }

    /// True if both fingers press on a fruit, or the suction cup touches it and its vacuum holds.
    pub fn is_held(&self, fruit: usize) -> bool {
        self.state.touches[fruit].grip() == [true, true]
    }

    /// The state at the start of the episode.
    pub fn start(&self) -> &Data {
        &self.start
    }

    /// The robot.
    pub fn robot(&self) -> &RobotModel {
        &self.robot
    }

    /// Loads of the robot on the wood since the start of the episode.
    pub fn wood_load(&self) -> &WoodLoad {
        &self.state.load
    }
}
