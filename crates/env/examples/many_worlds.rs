//! Steps four worlds of a trained orchard for a second, the robots holding still.
use orchard_env::{Backend, Env};
use orchard_scenario::Scenario;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scenario = Scenario::of(&[("preset", "tall-spindle")])?;
    let hold = scenario.robot().start_command();
    let mut env = Env::new(&scenario, 1, 0..4, Backend::Cpu)?;
    for _ in 0..60 {
        let observations = env.observe()?;
        env.step(&vec![hold; observations.len()])?;
    }
    Ok(())
}
