//! Prints the digest of every frame of the expert's episode of 75 s, a line each.

use orchard_web::{Ask, Session};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut session = Session::grow(&Ask::default())?;
    for _ in 0..4500 {
        let hex: String = session.step_watched().iter().map(|byte| format!("{byte:02x}")).collect();
        println!("{hex}");
    }
    Ok(())
}
