//! Tests of `orchard-robot` from outside, in one binary: a folder or file a subject.

mod grippers;
mod harvester;
mod kinematics;
mod loading;
mod moving_base;
mod qp;
mod servos;
mod urdf;
mod urdf_bounds;
