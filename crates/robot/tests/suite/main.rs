//! Tests of `orchard-robot` from outside, in one binary: a folder or file a subject.

mod bench;
mod fidelity;
mod grippers;
mod harvester;
mod ik;
mod kinematics;
mod loading;
mod moving_base;
mod qp;
mod servos;
mod urdf;
mod urdf_bounds;
