//! Changes two constants of a preset and draws random numbers that belong to one world.

use orchard_spec::{Purpose, Spec, Stream};

const STIFF: &str = r#"
preset = "stiff"
base = "paper"

[sim]
gravity = { value = 0.0, range = [0.0, 30.0], unit = "m/s2", source = "si_standard_gravity" }

[wood]
youngs_modulus = { value = 10.0, range = [0.05, 20.0], unit = "GPa", source = "niklas2011green" }
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (paper, stiff) = (Spec::paper(), Spec::from_toml("stiff.toml", STIFF)?);
    for spec in [&paper, &stiff] {
        let wood = &spec.wood;
        println!(
            "{}: E = {} Pa, density {} kg/m^3",
            spec.preset,
            wood.youngs_modulus.si(),
            wood.density.si()
        );
    }

    // One stream for each (seed, world, purpose): the same numbers on every platform.
    let (seed, world) = (7, 0);
    let mut fruit = Stream::new(seed, world, Purpose::FruitSize);
    let radius = fruit.within(paper.fruit.radius.si());
    println!("fruit radius {radius:.4} m");
    Ok(())
}
