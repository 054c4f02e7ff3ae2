//! Rows of robots alone on the graphics device.

use orchard_gpu::{Gpu, RobotBatch};
use orchard_robot::{Command, JointValues, RobotModel};
use orchard_spec::{Purpose, Spec, Stream};

use super::super::timing::Rounds;
use super::{MANY, ROUNDS, SEED, WARM_UP};
use orchard_program::rows::Row;

/// Frames of a round with [`MANY`] worlds or more; fewer worlds take more, so that a round is long beside the time in which the device's clock rises.
const FRAMES: u32 = 1200;
/// Largest ways of the arm's joints from the start \[rad\], and velocities of the base [m/s, m/s, rad/s].
const TURN: f64 = 0.35;
const SPEEDS: [f64; 3] = [0.3, 0.3, 0.5];

/// Substeps of one world per second, and memory, with `worlds` of the paper's robots, each under commands of its own that change every round.
pub fn rows(gpu: &Gpu, worlds: usize) -> anyhow::Result<Vec<Row>> {
    let (robot, sim) = (RobotModel::paper(), Spec::paper().sim);
    let mut batch = RobotBatch::new(gpu, &robot, &sim, worlds as u32)?;
    let frames = if gpu.info().is_software { WARM_UP } else { FRAMES * (MANY / worlds).max(1) as u32 };
    let mut streams: Vec<Stream> =
        (0..worlds).map(|world| Stream::new(SEED, world as u32, Purpose::Test)).collect();
    let mut rates = Vec::with_capacity(ROUNDS);
    // The first round warms up.
    for round in 0..=ROUNDS {
        for (world, stream) in streams.iter_mut().enumerate() {
            batch.command(world, &motion(&robot, stream))?;
        }
        // Sends the commands.
        batch.advance(1);
        batch.wait()?;
        let start = std::time::Instant::now();
        batch.advance(frames);
        batch.wait()?;
        if round > 0 {
            let substeps = f64::from(frames) * f64::from(sim.substeps.get()) * worlds as f64;
            rates.push(substeps / start.elapsed().as_secs_f64());
        }
    }
    let (rates, name) = (Rounds::new(rates), format!("gpu.robot_{worlds}"));
    let rate = Row::measured(&name, rates.median(), "substeps/s");
    let memory = Row::measured(&format!("{name}.memory"), batch.bytes() as f64, "bytes");
    let note = format!("robots {}, each alone, without contact", RobotModel::PAPER);
    Ok(vec![Row { spread: Some(rates.spread()), note: Some(note), ..rate }, memory])
}

/// A command away from the start.
fn motion(robot: &RobotModel, stream: &mut Stream) -> Command {
    let start = robot.start_command();
    Command {
        arm_q: JointValues::from_fn(start.arm_q.len(), |i| start.arm_q[i] + stream.uniform(-TURN, TURN)),
        base_velocity: SPEEDS.map(|most| stream.uniform(-most, most)),
        finger_q: stream.uniform(0.0, start.finger_q),
        ..start
    }
}
