//! Depth and label images of a scene, rendered on the CPU.
