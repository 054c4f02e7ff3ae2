//! Tells how many trees of a seed fit into lanes that were made for the samples of a scenario.
use orchard_gpu::{Choice, Gpu};
use orchard_lockstep::{Lockstep, samples};
use orchard_scenario::Scenario;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scenario = Scenario::of(&[])?;
    let gpu = Gpu::open(Choice::Any)?;
    let mut lanes = Lockstep::new(&gpu, &samples(&scenario), 1, 1)?;
    let (trees, mut fit) = (200, 0);
    for index in 0..trees {
        lanes.enter(&[(0, &scenario.world(1, index, 0)?)])?;
        fit += u32::from(lanes.has_room(0));
    }
    println!("{fit} of {trees} trees fit; {} bytes a lane", lanes.bytes());
    Ok(())
}
