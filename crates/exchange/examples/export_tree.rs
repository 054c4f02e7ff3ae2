//! Writes a grown tree as JSON, MTG, URDF, USD and glTF into the current folder and reads the MTG file back.

use orchard_exchange::{Wood, gltf, json, mtg, urdf, usd};
use orchard_spec::Spec;
use orchard_treegen::grow;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let spec = Spec::paper();
    let tree = grow(&spec, 7, 0)?;
    let wood = Wood::new(&tree, &spec.wood)?;
    std::fs::write("tree.json", json::write(&tree))?;
    std::fs::write("tree.mtg", mtg::write(&tree))?;
    std::fs::write("tree.urdf", urdf::write("tree", &wood)?)?;
    std::fs::write("tree.usda", usd::write(&wood))?;
    std::fs::write("tree.glb", gltf::write(&wood)?)?;

    let digitised = mtg::read(&std::fs::read_to_string("tree.mtg")?)?;
    println!("{} segments written, {} read", tree.segments.len(), digitised.segments().len());
    // An MTG file holds wood only: fruit sites and leaves follow the config's rules.
    let again = digitised.into_skeleton(&spec, 7, 0);
    println!("{} fruit sites, {} leaves", again.fruit_sites.len(), again.leaves.len());
    Ok(())
}
