//! Reads constants with range, unit and source from TOML, in SI units, and shows the error of a value out of range.

use orchard_quantity::{ConfigError, Quantity, Span, from_toml};
use serde::Deserialize;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Wood {
    density: Quantity,
    crotch_angle: Span,
}

const WOOD: &str = r#"
density = { value = 850.0, range = [780.0, 1000.0], unit = "kg/m3", source = "fpl2010woodhandbook" }
crotch_angle = { low = 42.0, high = 65.0, range = [0.0, 90.0], unit = "deg", source = "orchardbench" }
"#;

fn main() -> Result<(), ConfigError> {
    let wood: Wood = from_toml("wood.toml", WOOD)?;
    let (low, high) = wood.crotch_angle.si();
    println!("density {} kg/m^3, from {}", wood.density.si(), wood.density.source());
    println!("crotch angle {low:.3} to {high:.3} rad");

    let error =
        from_toml::<Wood>("wood.toml", &WOOD.replace("850.0", "8.5")).expect_err("8.5 is out of range");
    println!("{error}");
    Ok(())
}
