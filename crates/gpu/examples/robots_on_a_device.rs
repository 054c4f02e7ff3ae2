//! Turns the arms of many robots on a graphics device, each to another side, and says how fast they were stepped.
//!
//! `cargo run --release -p orchard-gpu --example robots_on_a_device [WORLDS]`

use orchard_gpu::{Choice, Gpu, GpuError, RobotBatch};
use orchard_multibody::{Data, Groups, ModelBuilder, forward_kinematics};
use orchard_robot::{PartGroups, RobotModel};
use orchard_spec::Spec;
use std::error::Error;
use std::time::Instant;

/// Number of robots if none is given.
const WORLDS: u32 = 64;
/// Frames: 2 s.
const FRAMES: u32 = 120;

fn main() -> Result<(), Box<dyn Error>> {
    let worlds = std::env::args().nth(1).map_or(Ok(WORLDS), |given| given.parse())?;
    let gpu = match Gpu::open(Choice::Any) {
        Ok(gpu) => gpu,
        Err(e @ GpuError::NoAdapter(_)) => {
            println!("This example needs a graphics adapter: {e}.");
            return Ok(());
        }
        Err(e) => return Err(e.into()),
    };
    let (robot, sim) = (RobotModel::paper(), Spec::paper().sim);
    let mut batch = RobotBatch::new(&gpu, &robot, &sim, worlds)?;
    for world in 0..worlds {
        let mut command = robot.start_command();
        command.arm_q[0] = -1.0 + 2.0 * f64::from(world) / f64::from(worlds);
        batch.command(world as usize, &command)?;
    }
    // The first frame compiles the kernels.
    batch.advance(1);
    batch.wait()?;
    let start = Instant::now();
    batch.advance(FRAMES);
    batch.wait()?;
    let substeps = f64::from(worlds) * f64::from(FRAMES * sim.substeps.get());
    println!("{}: {:.3e} substeps/s", gpu.info().name, substeps / start.elapsed().as_secs_f64());

    // A model of the robot, to which the state is copied; nothing touches it.
    let none = Groups::NONE;
    let groups = PartGroups { base: none, arm: none, finger: none, bucket: none, self_contact: None };
    let mut builder = ModelBuilder::new();
    let handle = robot.add_to(&mut builder, &Default::default(), &groups);
    let model = builder.build()?;
    let mut data = Data::new(&model);
    for world in [0, worlds.saturating_sub(1)].into_iter().filter(|&world| world < worlds) {
        batch.store(world as usize, &model, &handle, &mut data)?;
        forward_kinematics(&model, &mut data);
        let p_odom = handle.x_world_tcp(&data).translation.vector;
        println!("world {world}: {:?}, tool at {p_odom:.3?} m", batch.status(world as usize)?);
    }
    Ok(())
}
