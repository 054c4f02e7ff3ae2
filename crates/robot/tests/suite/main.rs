//! Tests of `orchard-robot` from outside, in one binary: a folder or file a subject.

mod fidelity;
mod harvester;
mod ik;
mod kinematics;
mod loading;
mod qp;
mod servos;
mod urdf;
mod urdf_bounds;
