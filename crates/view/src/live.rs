//! The world on show, live over Foxglove's websocket protocol: the channels of recordings.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use orchard_play::Sight;
use orchard_recording::live::{Live, LiveSink};
use orchard_recording::{Recorder, RecordingConfig};
use orchard_tasks::harvest::adapter::LogReader;
use orchard_tasks::harvest::observe::{FrameInput, Observer};
use orchard_world::{World, WorldEvent};

use crate::audience::Audience;
use crate::stage::Stage;

/// Clients of a server as the audience of a stage.
pub struct LiveAudience {
    live: Live,
    recorder: Option<Recorder<LiveSink>>,
    log: LogReader,
}

impl LiveAudience {
    /// The clients of a server.
    pub fn new(live: Live) -> Self {
        Self { live, recorder: None, log: LogReader::default() }
    }
}

impl Audience for LiveAudience {
    fn begin(&mut self, world: &World) {
        let frame = world.spec().sim.frame();
        self.log = LogReader::default();
        self.recorder = Some(Recorder::begin(self.live.begin(), RecordingConfig::paper(), frame, world));
    }

    fn before(&mut self, world: &World, sight: &Sight<'_>) {
        let Some(recorder) = &mut self.recorder else { return };
        self.live.tell_time(recorder.now());
        let events = sight.controller.map_or_else(Vec::new, |controller| self.log.read(controller.record()));
        let Sight { observation, command, .. } = *sight;
        recorder.before_step(world, &FrameInput { observation, controller_events: &events, command });
    }

    fn after(&mut self, world: &World, events: &[WorldEvent]) {
        if let Some(recorder) = &mut self.recorder {
            recorder.after_step(world, events);
        }
    }
}

/// Runs a stage in real time without a window, for so many frames or until `stop` is raised. A machine that is too slow falls behind, and does not
/// catch up.
pub fn run(stage: &mut Stage, frames: Option<u32>, stop: &AtomicBool) {
    let frame = Duration::from_secs_f64(stage.session().world().spec().sim.frame());
    let (mut due, mut left) = (Instant::now(), frames);
    while !stop.load(Ordering::Relaxed) && left != Some(0) {
        if !stage.step() {
            stage.reset();
        }
        left = left.map(|left| left - 1);
        due += frame;
        match due.checked_duration_since(Instant::now()) {
            Some(early) => std::thread::sleep(early),
            None => due = Instant::now(),
        }
    }
}
