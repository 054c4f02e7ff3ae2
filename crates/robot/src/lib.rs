//! Mobile manipulators from URDF: servos, kinematics, observations and commands.

pub mod io;
