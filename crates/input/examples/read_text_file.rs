//! Reads a text file of limited size, and shows the errors of a file that is too large and of a device.

use std::path::Path;

use orchard_input::{CONFIG, text};

fn main() {
    let manifest = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"));
    match text(manifest, CONFIG) {
        Ok(text) => println!("{} lines", text.lines().count()),
        Err(error) => println!("{error}"),
    }
    for (path, most) in [(manifest, 10), (Path::new("/dev/zero"), CONFIG)] {
        if let Err(error) = text(path, most) {
            println!("{}: {error}", path.display());
        }
    }
}
