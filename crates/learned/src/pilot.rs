//! A learned controller under way.

use std::sync::Arc;

use orchard_geometry::DepthImage;
use orchard_network::Tensor;
use orchard_picker::{Controller, Record};
use orchard_policy::{DepthReading, Motion, Reading};
use orchard_robot::{Command, JointValues, Observation};

use crate::policy::Policy;

/// Reads the sensors, asks the network, and carries out its actions frame by frame. It declares no attempts.
pub(crate) struct Pilot {
    policy: Arc<Policy>,
    /// Target as it is told: centre (odom) and radius \[m\].
    target: Option<[f64; 4]>,
    /// The latest image and its time \[s\].
    depth: Option<(DepthImage, f64)>,
    states: Vec<Tensor>,
    /// Actions that are still to be carried out, number by number, and the place of the next.
    actions: Vec<f32>,
    next: usize,
    /// The action under way and the frame in it.
    motion: Option<Motion>,
    frame: u32,
    /// The arm's set points at the end of the action under way \[rad\].
    set: JointValues,
    /// True once the network gave no usable action: the robot keeps still from then on.
    failed: bool,
    record: Record,
}

impl Pilot {
    pub fn new(policy: Arc<Policy>, target: Option<[f64; 4]>) -> Self {
        let (states, set) = (policy.wiring.start(), policy.encoding.start());
        let failed = policy.spec.spaces.target.is_some() && target.is_none();
        Self {
            policy,
            target,
            depth: None,
            states,
            actions: Vec::new(),
            next: 0,
            motion: None,
            frame: 0,
            set,
            failed,
            record: Record::default(),
        }
    }

    /// The next action; `None` if the network gives none that can be carried out.
    fn action(&mut self, sensed: &Observation) -> Option<Motion> {
        let Policy { network, wiring, encoding, spec } = &*self.policy;
        let size = encoding.interface().action.len();
        if self.next >= self.actions.len() {
            let depth = self.depth.as_ref().map(|(image, time)| DepthReading { image, time: *time });
            let seen = encoding.read(&Reading {
                sensed,
                depth,
                pixels: None,
                target: self.target,
                description: None,
            });
            self.actions = wiring.run(network, &seen, &mut self.states).ok()?;
            self.actions.truncate(spec.execute.map_or(usize::MAX, |n| (n as usize).saturating_mul(size)));
            self.next = 0;
        }
        let action = self.actions.get(self.next..self.next + size)?;
        self.next += size;
        match encoding.refused(action) {
            Some(_) => None,
            None => Some(encoding.motion(action, &self.set)),
        }
    }
}

impl Controller for Pilot {
    fn act(&mut self, observation: &Observation) -> Command {
        if let Some(image) = &observation.depth {
            self.depth = Some((image.clone(), observation.depth_time));
        }
        if self.frame == 0 && !self.failed {
            match self.action(observation) {
                Some(motion) => {
                    self.set = motion.end();
                    self.motion = Some(motion);
                }
                None => self.failed = true,
            }
        }
        let last = self.motion.as_ref().map(|motion| motion.command(self.frame));
        if self.failed {
            let held = last.unwrap_or_else(|| Command::still(observation));
            let arm_v = JointValues::zeros(self.set.len());
            return Command { arm_q: self.set, arm_v, base_velocity: [0.0; 3], ..held };
        }
        self.frame = (self.frame + 1) % self.policy.encoding.interface().frames;
        last.unwrap_or_else(|| Command::still(observation))
    }

    fn record(&self) -> &Record {
        &self.record
    }
}
