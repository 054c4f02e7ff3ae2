//! A third controller: it holds the arm still, turns to the nearest fruit that it sees and drives up to it.
use orchard_perception::{DetectorConfig, detect};
use orchard_picker::{Controller, Record, custom};
use orchard_robot::{Command, Observation, RobotModel};
use orchard_scenario::Scenario;
use orchard_tasks::harvest::trial;

struct Greeter {
    command: Command,
    record: Record,
}

impl Controller for Greeter {
    fn act(&mut self, seen: &Observation) -> Command {
        if let Some(depth) = &seen.depth {
            let fruit = detect(depth, &seen.intrinsics, None, &DetectorConfig::paper()).unwrap_or_default();
            let nearest = fruit.iter().map(|f| f.p_camera).min_by(|a, b| a.z.total_cmp(&b.z));
            // Optical frame: x right, z ahead. Base: forward [m/s], left [m/s], turn to the left [rad/s].
            self.command.base_velocity = nearest.map_or([0.2, 0.0, 0.0], |p| [p.z - 0.6, 0.0, -p.x]);
        }
        self.command
    }
    fn record(&self) -> &Record {
        &self.record
    }
}

/// Lets it try for ten seconds.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let greeter = custom("greeter", "1", |robot: &RobotModel, _: &DetectorConfig| Greeter {
        command: robot.start_command(),
        record: Record::default(),
    });
    let scenario = Scenario::of(&[])?.with_controller(greeter);
    let episode = trial(&scenario, 20250704, 0, 10.0)?;
    println!("{} fruit, {} detached", episode.fruit_total, episode.fruit_detached.len());
    Ok(())
}
