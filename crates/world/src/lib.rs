//! One simulated orchard world: tree, fruit, leaves, ground, robot and camera.
