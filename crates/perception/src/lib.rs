//! Finds fruit-sized spheres in depth images, simulated or real.
