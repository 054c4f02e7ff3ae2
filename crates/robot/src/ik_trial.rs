//! Trials of the inverse kinematics: poses that a posture reaches, solved from the home posture.

use crate::arm::ArmKinematics;
use crate::ik::{IkFailure, IkTarget};
use crate::joint_values::{JointValues, JointVector};

/// Result of one pose: true for each solver that found a posture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IkTrial {
    /// Damped least squares ([`ArmKinematics::solve`]).
    pub least_squares: bool,
    /// Quadratic programs ([`ArmKinematics::solve_qp`]).
    pub program: bool,
}

impl ArmKinematics {
    /// Returns the posture at the given share of each joint's range, from 0 for the lowest position to 1 for the highest.
    pub fn posture_at(&self, mut share: impl FnMut() -> f64) -> JointVector {
        let limits = self.limits();
        JointValues::from_fn(self.dof(), |i| {
            let limit = limits[i];
            limit.lower + share() * (limit.upper - limit.lower)
        })
        .vector()
    }

    /// Lets both solvers seek the tool pose of a posture from the home posture, with their restarts. A pose counts as solved if the answer
    /// meets it within the tolerances and lies within the joint limits; that of the programs must keep links from overlapping, too. The
    /// given posture shows that there is a solution.
    pub fn try_pose_of(&self, q: &JointVector) -> IkTrial {
        let target = IkTarget::Pose(self.tcp(q));
        let solves = |found: Result<JointVector, IkFailure>, keeps_clear: bool| {
            found.is_ok_and(|q| {
                q == self.clamped(&q)
                    && self.meets(&self.residual(&target, &q))
                    && (!keeps_clear || self.self_distance(&q).distance >= 0.0)
            })
        };
        IkTrial {
            least_squares: solves(self.solve(&target, &self.home), false),
            program: solves(self.solve_qp(&target, &self.home), true),
        }
    }
}
