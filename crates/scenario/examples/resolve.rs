//! A scenario from options, its figures, and one of its worlds.
use orchard_scenario::Scenario;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scenario =
        Scenario::of(&[("preset", "tall-spindle"), ("camera", "d435i"), ("controller", "expert")])?;
    println!("{}", scenario.differences().unwrap_or_default());
    for figure in scenario.figures().iter().filter(|figure| figure.path.starts_with("world.wood.")).take(3) {
        println!(
            "{} = {} {} ({}, set by {})",
            figure.path, figure.value, figure.unit, figure.source, figure.from
        );
    }
    let world = scenario.world(20250704, 0, 0)?;
    println!("{} segments, {} fruit", world.skeleton().segments.len(), world.fruit().len());
    Ok(())
}
