//! Computes where the hand is for given joint positions, and joint positions for where the hand should be.
use orchard_robot::{IkTarget, RobotModel};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The benchmark's robot: a Ridgeback base with an FR3 arm. `RobotModel::from_urdf` reads another one.
    let robot = RobotModel::paper();
    let arm = robot.kinematics();

    // Forward kinematics: pose of the point between the finger pads (TCP) in the base frame.
    let q_home = arm.home();
    let x_base_tcp = arm.tcp(&q_home);
    println!("TCP at {:.4?} m", x_base_tcp.translation.vector.as_slice());

    // Inverse kinematics: joint positions that bring the TCP 0.1 m higher with the same orientation.
    let mut x_goal = x_base_tcp;
    x_goal.translation.vector.z += 0.1;
    let q = arm.solve(&IkTarget::Pose(x_goal), &q_home)?;
    println!("joints {:.4?} rad", q.as_slice());

    let miss = (arm.tcp(&q).translation.vector - x_goal.translation.vector).norm();
    assert!(miss < 1e-3, "the solution misses the goal by {miss} m");
    Ok(())
}
