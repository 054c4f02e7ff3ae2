//! Grows an apple tree and prints its figures.

use orchard_spec::Spec;
use orchard_treegen::{TreegenError, grow};

fn main() -> Result<(), TreegenError> {
    let (seed, world) = (7, 0);
    let tree = grow(&Spec::paper(), seed, world)?;

    let height = tree.segments.iter().map(|segment| segment.p_tip_world().z).fold(0.0, f64::max);
    let wood: f64 = tree.segments.iter().map(|segment| segment.length).sum();
    let leaf_area: f64 = tree.leaves.iter().map(|leaf| leaf.area()).sum();
    println!("{} segments, {wood:.1} m of wood, {height:.2} m tall", tree.segments.len());
    println!("{} fruit sites, {} leaves of {leaf_area:.2} m^2", tree.fruit_sites.len(), tree.leaves.len());

    // Parents come before children: the limbs stand on the leader.
    for limb in tree.segments.iter().filter(|segment| segment.order == 1) {
        let on_leader = limb.parent.is_some_and(|parent| tree.segments[parent].order == 0);
        if on_leader {
            println!("limb at {:.2} m, radius {:.1} mm", limb.p_base_world.z, 1e3 * limb.radius);
        }
    }
    Ok(())
}
