//! A controller of its own, in a program with every command of `orchard`.

use orchardbench::{Command, Controller, Observation, Program, Record, custom};

/// Drives forward and never picks anything: put your own controller here.
struct Drive(Command, Record);

impl Controller for Drive {
    fn act(&mut self, _seen: &Observation) -> Command {
        Command { base_velocity: [0.1, 0.0, 0.0], ..self.0 }
    }
    fn record(&self) -> &Record {
        &self.1
    }
}

fn main() -> std::process::ExitCode {
    let drive = custom("drive", "1", |robot, _detector| Drive(robot.start_command(), Record::default()));
    Program::new().with(drive).main()
}
