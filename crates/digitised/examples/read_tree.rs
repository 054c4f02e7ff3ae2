//! Writes a grown tree as MTG and reads the file back, as a digitised tree is read; then shows the error of a bad one.

use orchard_digitised::{TreeFile, mtg};
use orchard_spec::Spec;
use orchard_treegen::grow;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let spec = Spec::paper();
    let grown = grow(&spec, 7, 0)?;
    let bytes = mtg::write(&grown).into_bytes();
    let file = TreeFile::of_bytes("tree.mtg", bytes, None, None)?;
    // An MTG file holds wood only: fruit sites and leaves follow the config's rules.
    let tree = file.skeleton(&spec, 7, 0);
    println!("{} segments, {} fruit sites", tree.segments.len(), tree.fruit_sites.len());
    if let Err(problem) = TreeFile::of_bytes("tree.json", b"{}".to_vec(), None, None) {
        println!("tree.json: {problem}");
    }
    Ok(())
}
