//! Collision groups: the paper's filter of pairs that may touch.
//!
//! The robot touches wood, fruit and ground, and its links each other where they share no joint; tree and fruit never touch each
//! other, hanging fruit touch each other in configs with clusters only; a broken sub-tree meets the ground only; loose fruit in the coupled solve meets the ground, the robot, other such fruit,
//! and fruit that the rigid-body engine moves or that is at rest (the engine computes the contacts
//! of those). The posts and wires of a row,
//! which the paper lacks, meet all that the ground meets, and the chassis.

use orchard_fruit::FruitGroups;
use orchard_multibody::Groups;

const GROUND: u32 = 1;
const WOOD: u32 = 1 << 1;
const DEBRIS: u32 = 1 << 2;
const HANGING: u32 = 1 << 3;
const LOOSE: u32 = 1 << 4;
const PASSED: u32 = 1 << 5;
const ROBOT: u32 = 1 << 6;
const SCENERY: u32 = 1 << 7;

/// The lowest of the nine bits by which the robot's links, from the base to the wrist, meet each other.
pub const ROBOT_LINKS: u32 = 16;

/// The ground.
pub const GROUND_GROUPS: Groups = Groups { member: GROUND, filter: DEBRIS | LOOSE | ROBOT };
/// Live wood.
pub const WOOD_GROUPS: Groups = Groups { member: WOOD, filter: ROBOT };
/// Broken sub-trees.
pub const DEBRIS_GROUPS: Groups = Groups { member: DEBRIS, filter: GROUND | SCENERY };
/// Fruit on its stem.
pub const HANGING_GROUPS: Groups = Groups { member: HANGING, filter: ROBOT };
/// Fruit on its stem in clusters, which touch each other and fruit at the hand.
pub const CLUSTER_GROUPS: Groups = Groups { member: HANGING, filter: ROBOT | HANGING | LOOSE };
/// Fruit off its stem, at the hand.
pub const LOOSE_GROUPS: Groups = Groups { member: LOOSE, filter: GROUND | ROBOT | LOOSE | PASSED | SCENERY };
/// Groups of fruit off its stem, among clusters.
pub const LOOSE_CLUSTER_GROUPS: Groups =
    Groups { member: LOOSE, filter: GROUND | ROBOT | HANGING | LOOSE | PASSED | SCENERY };
/// Fruit that the rigid-body engine moves, or at rest: an obstacle for fruit at the hand.
pub const PASSED_GROUPS: Groups = Groups { member: PASSED, filter: LOOSE };
/// Arm and fingers.
pub const ROBOT_GROUPS: Groups = Groups { member: ROBOT, filter: GROUND | WOOD | HANGING | LOOSE | SCENERY };
/// Chassis and bucket: the height servo holds them over the ground, so they do not touch it.
pub const BASE_GROUPS: Groups = Groups { member: ROBOT, filter: WOOD | HANGING | LOOSE | SCENERY };
/// Posts and wires.
pub const SCENERY_GROUPS: Groups = Groups { member: SCENERY, filter: DEBRIS | LOOSE | ROBOT };

/// Groups of a fruit without the robot and, on its stem, without other such fruit: what a fruit in the hand may meet besides.
pub fn beside_robot(groups: Groups) -> Groups {
    let filter = if groups.member & HANGING != 0 { groups.filter & LOOSE } else { groups.filter & !ROBOT };
    Groups { filter, ..groups }
}

/// Groups of a part of the robot, with nothing but the ground.
pub fn on_ground(groups: Groups) -> Groups {
    Groups { filter: groups.filter & GROUND, ..groups }
}

/// Groups of fruit, with or without clusters.
pub fn fruit(in_clusters: bool) -> FruitGroups {
    let (hanging, loose) =
        if in_clusters { (CLUSTER_GROUPS, LOOSE_CLUSTER_GROUPS) } else { (HANGING_GROUPS, LOOSE_GROUPS) };
    FruitGroups { hanging, loose, passed: PASSED_GROUPS }
}
