//! The world: state, step order, observation.

use crate::build::{Parts, WorldError, build};
use crate::camera::{CameraTruth, Flight, Shot, Shutter};
use crate::event::{Status, WorldEvent};
use crate::identity::{Identity, Start};
use crate::load::WoodLoad;
use crate::loose::Loose;
use crate::planting::{Appearance, Planting};
use crate::scene;
use crate::touch::{FruitTouch, fruit_touches};
use orchard_camera::{Scene, Sensor};
use orchard_fruit::{FruitEvent, FruitLives, FruitSet, Impact, RestRule, Touch};
use orchard_geometry::{HeightField, Pose, Shape, Vec3};
use orchard_multibody::{Data, Model, Motion, StepReport, equilibrium, step};
use orchard_robot::{Command, Observation, RobotHandle, RobotModel, Servos, observe};
use orchard_spec::Spec;
use orchard_treegen::Skeleton;
use orchard_treephys::{Rupture, TreeBody};
use std::sync::Arc;

/// Pose of the bucket's frame, the base, and the velocity of its points.
fn bucket_motion(data: &Data, handle: &RobotHandle) -> (Pose, impl Fn(&Vec3) -> Vec3 + use<>) {
    let twist = data.velocity(handle.base);
    let p_body = data.x_world_body(handle.base).translation.vector;
    let velocity = move |p_world: &Vec3| twist.linear + twist.angular.cross(&(p_world - p_body));
    (handle.x_world_base(data), velocity)
}

/// Largest joint move [rad] of the last statics iteration: a few units in the last place of a bent joint.
const EQUILIBRIUM_TOLERANCE: f64 = 1e-14;

/// One orchard world. A clone goes on with the same bits; [`World::snapshot`] is smaller and can be written down.
#[derive(Debug, Clone)]
pub struct World {
    /// What was asked for.
    config: Arc<Spec>,
    /// The same with this world's own constants.
    spec: Arc<Spec>,
    robot: Arc<RobotModel>,
    appearance: Appearance,
    /// Whether the tree grew from the seed.
    grown: bool,
    /// Which of its start poses the robot has.
    repeat: u32,
    pub(crate) parts: Arc<Parts>,
    pub(crate) identity: Identity,
    pub(crate) sensor: Sensor,
    pub(crate) shutter: Shutter,
    pub(crate) start: Arc<Data>,
    pub(crate) state: State,
}

/// Everything that a frame changes.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub data: Data,
    pub rupture: Rupture,
    pub fruit: FruitLives,
    pub servos: Servos,
    pub frame: u32,
    pub status: Status,
    pub events: Vec<WorldEvent>,
    pub gripped: Vec<bool>,
    /// Who presses on each fruit, by the report.
    pub touches: Vec<FruitTouch>,
    /// The same for the rules of the fruit; scratch of the end of a frame.
    pub touched: Vec<Touch>,
    pub report: StepReport,
    /// Scratch of loose fruit.
    pub loose: Loose,
    /// Where the latest substep began.
    pub before: Motion,
    pub image: Option<Arc<CameraTruth>>,
    /// What the image was drawn from.
    pub shot: Option<Shot>,
    /// What the next images will be drawn from.
    pub flight: Flight,
    /// What the robot has done to the wood.
    pub load: WoodLoad,
}

impl World {
    /// Builds the world of one index of one seed, at rest under gravity, the robot at its start.
    ///
    /// # Errors
    /// The tree does not grow, the robot lacks a part, or the loaded tree finds no rest.
    pub fn new(spec: Arc<Spec>, robot: Arc<RobotModel>, seed: u64, world: u32) -> Result<Self, WorldError> {
        Self::of_episode(spec, robot, seed, world, 0)
    }

    /// Builds the world as it is in some episode: the first is 0, the next ones are those of [`Self::resampled`].
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

    /// Builds a world around a tree that was not grown from the seed: a digitised one, say. It is taken as it is, whatever the
    /// randomisation says. Seed and index draw all else: fruit, stems, the robot's start.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_tree(
        spec: Arc<Spec>,
        robot: Arc<RobotModel>,
        skeleton: Skeleton,
        seed: u64,
        world: u32,
    ) -> Result<Self, WorldError> {
        let planting = Planting::of_tree(spec.clone(), skeleton, seed, world);
        Self::around(spec, robot, planting, Start { seed, world, episode: 0 }, 0)
    }

    fn around(
        config: Arc<Spec>,
        robot: Arc<RobotModel>,
        planting: Planting,
        start: Start,
        repeat: u32,
    ) -> Result<Self, WorldError> {
        let Planting { spec, skeleton, fruit, appearance } = planting;
        let parts = build(&spec, &robot, skeleton, fruit, start.seed, start.world, repeat)?;
        let mut data = Data::new(&parts.model);
        parts.tree.reset(&parts.model, &mut data, &spec.wood);
        parts.fruit.reset(&mut data);
        robot.set_start(&parts.model, &mut data, &parts.handle);
        equilibrium(&parts.model, &mut data, &parts.settings.gravity, EQUILIBRIUM_TOLERANCE)?;
        let sensor = Sensor::new(&spec.camera);
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
            shutter,
            start: Arc::new(data),
            state,
        })
    }

    /// This world in its next episode, where the randomisation samples anew at every reset; else none, and
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
        Self::grow(self.config.clone(), self.robot.clone(), start, self.repeat).map(Some)
    }

    /// Brings the world back to the start of its episode.
    pub fn reset(&mut self) {
        self.state = State::new(&self.parts, &self.robot, Data::clone(&self.start), self.shutter);
    }

    /// Advances one frame under a command: servos, broken joints' friction and physics each substep, then
    /// rupture, stems and rest once. A quarantined world stands still.
    pub fn step(&mut self, command: &Command) {
        if self.state.status != Status::Running {
            return;
        }
        let (spec, parts, state) = (&*self.spec, &*self.parts, &mut self.state);
        state.begin_loose(spec, parts);
        state.load.begin_frame();
        for left in (0..spec.sim.substeps.get()).rev() {
            if state.data.is_finite() {
                state.substep(spec, parts, command, f64::from(left) * parts.settings.h);
            }
        }
        state.frame += 1;
        let frame = spec.sim.frame();
        state.load.end_frame(&parts.tree, &parts.model, &state.data, &self.start, &state.rupture, frame);
        state.end_frame(spec, parts);
        state.flight.end_frame(self.shutter, state.frame, &state.data);
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

    /// What the robot senses now; with a depth image on the frames in which the camera delivers one. It shows the moment
    /// [`Observation::depth_time`], the camera's latency ago.
    pub fn observe(&mut self) -> Observation {
        let frame = self.spec.sim.frame();
        let time = |count: u32| f64::from(count) * frame;
        let (now, intrinsics) = (self.state.frame, *self.sensor.intrinsics());
        let proprioception =
            observe(&self.parts.model, &self.state.data, &self.parts.handle, time(now), intrinsics);
        let Some(truth) = self.delivered() else { return proprioception };
        let depth = Some(truth.capture.measured.clone());
        let depth_time = time(truth.frame);
        self.state.image = Some(Arc::new(truth));
        Observation { depth, depth_time, ..proprioception }
    }

    /// The visible scene of the present state.
    pub fn scene(&self) -> Scene {
        self.scene_of(&self.state.data)
    }

    pub(crate) fn scene_of(&self, data: &Data) -> Scene {
        let shapes = scene::wood_shapes(&self.parts.skeleton);
        let fruit_radius: Vec<f64> = self.parts.fruit.fruit.iter().map(|f| f.radius).collect();
        let visible = scene::Visible {
            tree: &self.parts.tree,
            shapes: &shapes,
            leaves: &self.parts.skeleton.leaves,
            fruit_radius: &fruit_radius,
            robot: self.robot_shapes(data),
            ground: self.parts.ground.shape(),
            struts: &self.parts.struts,
        };
        scene::build(&visible, data, &self.parts.fruit.points)
    }

    /// The scene as people expect it: in the tree's own colours, with spurs and stems, which are thinner than a pixel of the depth
    /// camera, and with a plain round the modelled part of bumpy ground.
    pub fn picture_scene(&self) -> Scene {
        let mut scene = self.scene();
        let data = &self.state.data;
        let bodies = &self.parts.tree.bodies;
        let anchors = self.parts.fruit.fruit.iter().map(|fruit| (fruit.segment, &fruit.p_segment));
        scene::push_fine_wood(&mut scene, &self.parts.skeleton, anchors, |i| *data.x_world_body(bodies[i]));
        self.appearance.paint(&mut scene);
        if let Some(field) = self.terrain() {
            scene::push_plain(&mut scene, field.bounds().min.z);
        }
        for (i, &point) in self.parts.fruit.points.iter().enumerate() {
            let anchor = data.anchor_p_world(&self.parts.model, point);
            if let (Some(p_anchor), true) = (anchor, data.tethered[point.index()]) {
                let radius = self.parts.fruit.fruit[i].radius;
                scene::push_stem(&mut scene, &p_anchor, &data.point_p_world[point.index()], radius);
            }
        }
        scene
    }

    /// The robot's shapes, posed in the world.
    fn robot_shapes(&self, data: &Data) -> Vec<(Shape, Pose)> {
        let links = &self.robot.articulation().links;
        let posed = links.iter().zip(&self.parts.handle.bodies).flat_map(|(link, &body)| {
            let x_world_link = *data.x_world_body(body);
            link.shapes.iter().map(move |s| (s.shape.clone(), x_world_link * s.x_link_shape))
        });
        posed.collect()
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

    /// Number of the episode, from 0, in modes of randomisation that sample anew at every reset; else 0.
    pub fn episode(&self) -> u32 {
        self.identity.start.episode
    }

    /// Whether it runs.
    pub fn status(&self) -> &Status {
        &self.state.status
    }

    /// The spec that it was built from, with the wood and foliage that this world's randomisation drew.
    pub fn spec(&self) -> &Spec {
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

    /// The multibody state, for tests that push.
    pub fn data_mut(&mut self) -> &mut Data {
        &mut self.state.data
    }

    /// The tree's links.
    pub fn tree(&self) -> &TreeBody {
        &self.parts.tree
    }

    /// What is broken.
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

    /// Where the robot's parts are in the model.
    pub fn handle(&self) -> &RobotHandle {
        &self.parts.handle
    }

    /// Pose of the odom frame: the robot's base at the start.
    pub fn x_world_odom(&self) -> Pose {
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

    /// Whether both fingers press on a fruit.
    pub fn is_held(&self, fruit: usize) -> bool {
        self.state.touches[fruit].fingers == [true, true]
    }

    /// The state at the start of the episode.
    pub(crate) fn start(&self) -> &Data {
        &self.start
    }

    /// The robot.
    pub(crate) fn robot(&self) -> &RobotModel {
        &self.robot
    }
}

impl State {
    fn new(parts: &Parts, robot: &RobotModel, data: Data, shutter: Shutter) -> Self {
        let n = parts.fruit.len();
        let mut flight = Flight::default();
        flight.end_frame(shutter, 0, &data);
        let load = WoodLoad::at_start(&parts.tree, &parts.model, &data);
        Self {
            rupture: Rupture::new(&parts.tree),
            fruit: FruitLives::new(&parts.fruit),
            servos: Servos::new(robot),
            data,
            frame: 0,
            status: Status::Running,
            events: Vec::new(),
            gripped: vec![false; n],
            touches: vec![FruitTouch::default(); n],
            touched: vec![Touch::default(); n],
            report: StepReport::default(),
            loose: Loose::default(),
            before: Motion::default(),
            image: None,
            shot: None,
            flight,
            load,
        }
    }

    /// `remaining`: what is left of the frame after it [s].
    fn substep(&mut self, spec: &Spec, parts: &Parts, command: &Command, remaining: f64) {
        let Parts { model, handle, settings, .. } = parts;
        let (h, gravity) = (settings.h, &settings.gravity);
        let twist = self.data.velocity(handle.base);
        let x_world_base = handle.x_world_base(&self.data);
        let ride_height = parts.ground.ride_height_ahead(&x_world_base, &twist.linear, twist.angular.z);
        let height = ride_height - parts.x_world_odom.translation.z;
        self.servos.apply(model, &mut self.data, handle, command, height, gravity, h, remaining);
        self.rupture.begin_substep(&parts.tree, model, &mut self.data, &spec.wood, h);
        self.data.save_motion(&mut self.before);
        self.keep_velocities(parts);
        step(model, &mut self.data, settings, &mut self.report);
        // Each repeat caps at least one more joint.
        while self.servos.cap_overshoot(model, &mut self.data, handle) {
            self.data.restore_motion(&self.before);
            step(model, &mut self.data, settings, &mut self.report);
        }
        self.load.add_substep(&parts.colliders, &self.report, h);
        let (x_world_base, velocity) = bucket_motion(&self.data, handle);
        self.fruit.end_substep(&parts.fruit, model, &mut self.data, &x_world_base, velocity);
        self.step_loose(parts);
    }

    fn end_frame(&mut self, spec: &Spec, parts: &Parts) {
        let frame = self.frame;
        let gravity = spec.sim.gravity.si();
        for segment in self.rupture.end_frame(&parts.tree, &parts.model, &mut self.data, &spec.wood, gravity)
        {
            self.events.push(WorldEvent::BranchSnapped { segment, frame });
        }
        parts.fruit.weigh_on(&mut self.data, |segment| self.rupture.is_debris(segment));

        fruit_touches(&parts.colliders, &self.report, &mut self.touches);
        let (x_world_base, base_velocity) = bucket_motion(&self.data, &parts.handle);
        self.end_touches(spec, parts, &x_world_base);
        for (i, t) in self.touches.iter().enumerate() {
            let gripped = t.fingers[0] && t.fingers[1];
            if gripped && !self.gripped[i] {
                self.events.push(WorldEvent::FruitGripped { fruit: i, frame });
            }
            self.gripped[i] = gripped || (self.gripped[i] && self.touched[i].finger);
        }
        let rest = RestRule {
            speed: spec.sim.sleep_speed.si(),
            frames: (spec.sim.sleep_time.si() * spec.sim.frame_rate.si()).round() as u32,
        };
        let events = self.fruit.end_frame(
            &parts.fruit,
            &parts.model,
            &mut self.data,
            &spec.fruit,
            &self.touched,
            rest,
            base_velocity,
        );
        self.fruit.hand_over(&parts.fruit, &mut self.data, &spec.fruit, &self.touched);
        self.end_loose(spec, parts, rest, &x_world_base);
        self.events.extend(events.into_iter().map(|e| match e {
            FruitEvent::Detached { fruit, tension } => WorldEvent::FruitDetached { fruit, frame, tension },
            FruitEvent::Deposited { fruit, drop_height, impact_energy } => {
                WorldEvent::FruitDeposited { fruit, frame, drop_height, impact_energy }
            }
            FruitEvent::Struck(Impact { fruit, partner, energy }) => {
                WorldEvent::FruitImpact { fruit, frame, energy, partner }
            }
            FruitEvent::Dropped { fruit, speed } => WorldEvent::FruitDropped { fruit, frame, speed },
        }));
    }

    /// What, if anything, is non-finite or out of the plausible box.
    fn implausible(&self, model: &Model, extent: f64) -> Option<String> {
        let data = &self.data;
        let state = data.q.iter().chain(&data.v);
        if let Some(i) = state.clone().position(|x| !x.is_finite()) {
            return Some(format!("joint state {i} is not finite"));
        }
        if !data.is_finite() {
            return Some("the motion of a fruit is not finite".to_owned());
        }
        let far = |p: &Vec3| !p.iter().all(|x| x.abs() <= extent);
        if let Some(i) = data.point_p_world.iter().position(far) {
            return Some(format!("fruit {i} left the plausible box of {extent} m"));
        }
        model
            .body_ids()
            .find(|&id| far(&data.x_world_body(id).translation.vector))
            .map(|id| format!("body {} left the plausible box of {extent} m", id.index()))
    }
}
