//! Observes an episode and turns its frames into messages.

use foxglove::Encode;
use orchard_robot::Observation;
use orchard_tasks::harvest::observe::{FrameInput, Observer};
use orchard_world::World;
use orchard_world::WorldEvent;
use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::camera;
use crate::channel::Channel;
use crate::clock::{Clock, nanoseconds};
use crate::command::CommandMessage;
use crate::config::{RecordingConfig, hexadecimal};
use crate::cup::CupMessage;
use crate::event::{EventMessage, StateHashMessage, world_line};
use crate::joints::Joints;
use crate::picker::{ControllerMessages, Notes};
use crate::scene::{self, Crop, Wood};
use crate::sink::{Message, Sink, json, protobuf};
use crate::transforms::Transforms;

/// Turns the frames of one episode into messages. The messages depend on its inputs only: it reads no clock.
#[derive(Debug)]
pub struct Recorder<S> {
    sink: S,
    config: RecordingConfig,
    clock: Clock,
    transforms: Transforms,
    joints: Joints,
    /// True if the robot has a suction cup.
    cup: bool,
    wood: Wood,
    crop: Crop,
    notes: Notes,
}

impl<S: Sink> Recorder<S> {
    /// Begins with a world, in a recording at the start of its episode; `frame` is the length of a frame \[s\].
    pub fn begin(sink: S, config: RecordingConfig, frame: f64, world: &World) -> Self {
        let mut recorder = Self {
            sink,
            config,
            clock: Clock { frame, frames: world.frame() },
            transforms: Transforms::of(world),
            joints: Joints::of(world),
            cup: world.handle().cup.is_some(),
            wood: Wood::default(),
            crop: Crop::default(),
            notes: Notes::default(),
        };
        let now = recorder.clock.now();
        recorder.protobuf(Channel::Ground, &scene::ground(now, world));
        recorder.protobuf(Channel::Leaves, &scene::leaves(now, world));
        recorder.protobuf(Channel::Robot, &scene::robot(now, world));
        recorder
    }

    /// Returns the sink, with what was recorded so far.
    pub fn into_sink(self) -> S {
        self.sink
    }

    /// Time of the present frame \[ns\].
    pub fn now(&self) -> u64 {
        self.clock.now()
    }

    /// Records the world as the episode left it, and returns the sink.
    pub fn end(mut self, world: &World) -> S {
        self.scenery(world);
        let transforms = self.transforms.all(world, &self.clock);
        self.protobuf(Channel::Transforms, &transforms);
        self.state(world);
        self.sink
    }

    /// Writes a message to the sink at the current time.
    fn put(&mut self, channel: Channel, data: Vec<u8>) {
        self.sink.put(Message { channel, log_time: self.clock.now(), data });
    }

    fn protobuf(&mut self, channel: Channel, message: &impl Encode) {
        self.put(channel, protobuf(message));
    }

    fn json(&mut self, channel: Channel, message: &impl Serialize) {
        self.put(channel, json(message));
    }

    /// Writes the wood and the fruit that have to be redrawn.
    fn scenery(&mut self, world: &World) {
        let now = self.clock.now();
        if let Some(wood) = self.wood.due(now, world) {
            self.protobuf(Channel::Wood, &wood);
        }
        if let Some(fruit) = self.crop.due(now, world) {
            self.protobuf(Channel::Fruit, &fruit);
        }
    }

    fn state(&mut self, world: &World) {
        let sha256 = hexadecimal(&Sha256::digest(world.snapshot().to_bytes()));
        self.json(Channel::StateHash, &StateHashMessage { frame: self.clock.frames, sha256 });
    }

    fn seen(&mut self, seen: &Observation) {
        let now = self.clock.now();
        let joints = self.joints.message(now, seen);
        self.protobuf(Channel::JointStates, &joints);
        if self.cup {
            self.json(Channel::Cup, &CupMessage::from(seen));
        }
        if let Some(depth) = &seen.depth {
            let taken = nanoseconds(seen.depth_time);
            let stride = self.config.points.stride.get() as usize;
            self.protobuf(Channel::Calibration, &camera::calibration(taken, &seen.intrinsics));
            self.protobuf(Channel::Depth, &camera::image(taken, depth));
            self.protobuf(Channel::Points, &camera::points(taken, depth, &seen.intrinsics, stride));
        }
    }

    fn controller_messages(&mut self, ControllerMessages { detections, picker, target }: ControllerMessages) {
        if let Some((message, drawn)) = detections {
            self.json(Channel::Detections, &message);
            self.protobuf(Channel::DetectionSpheres, &drawn);
        }
        if let Some((message, line)) = picker {
            self.json(Channel::Picker, &message);
            self.protobuf(Channel::Log, &line);
        }
        if let Some(target) = target {
            self.protobuf(Channel::Target, &target);
        }
    }
}

impl<S: Sink> Observer<World> for Recorder<S> {
    fn before_step(&mut self, world: &World, frame: &FrameInput<'_>) {
        let now = self.clock.now();
        self.scenery(world);
        if let Some(transforms) = self.transforms.due(world, &self.clock, &self.config.transforms) {
            self.protobuf(Channel::Transforms, &transforms);
        }
        if self.clock.is_due(self.config.state.rate.si()) {
            self.state(world);
        }
        let depth_time = frame.observation.map_or(0.0, |seen| seen.depth_time);
        if let Some(seen) = frame.observation {
            self.seen(seen);
        }
        for event in frame.controller_events {
            let messages = self.notes.take(now, depth_time, event);
            self.controller_messages(messages);
        }
        self.json(Channel::Command, &CommandMessage::from(frame.command));
    }

    fn after_step(&mut self, _: &World, events: &[WorldEvent]) {
        self.clock.frames += 1;
        let now = self.clock.now();
        for event in events {
            if let Some(message) = EventMessage::of(event) {
                self.json(Channel::Events, &message);
            }
            if let Some(line) = world_line(now, event) {
                self.protobuf(Channel::Log, &line);
            }
        }
    }
}
