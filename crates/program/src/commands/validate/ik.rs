//! Suite `ik`: the inverse kinematics of every robot, on random tool poses that it can reach.

use indicatif::{ProgressBar, ProgressStyle};
use orchard_robot::{ArmKinematics, IkTrial, JointVector, RobotModel};
use orchard_spec::{Purpose, Stream};
use rayon::prelude::*;

use crate::rows::{Effort, Measured, Row};

/// Poses of a robot, in full and quick.
const POSES: [u32; 2] = [10_000, 200];

/// Seed of the postures; posture i is drawn from the stream of world i.
const SEED: u64 = 1;

/// Share of the poses that each solver must solve \[1\].
const SHARE: f64 = 0.99;

/// Most draws of a posture whose links do not overlap.
const DRAWS: u32 = 1000;

/// Number of poses that each solver solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Solved {
    /// Number of poses.
    pub poses: u32,
    /// Poses solved by damped least squares.
    pub least_squares: u32,
    /// Poses solved by quadratic programs.
    pub programs: u32,
}

/// Tries the tool poses of random postures without self-collision, drawn evenly over the joint ranges.
pub fn solved(arm: &ArmKinematics, poses: u32, done: impl Fn() + Sync) -> Solved {
    let trial = |n| {
        let trial = arm.try_pose_of(&posture(arm, n));
        done();
        trial
    };
    let trials: Vec<IkTrial> = (0..poses).into_par_iter().map(trial).collect();
    let count = |is_solved: fn(&IkTrial) -> bool| trials.iter().filter(|t| is_solved(t)).count() as u32;
    Solved { poses, least_squares: count(|t| t.least_squares), programs: count(|t| t.program) }
}

/// A random posture whose links do not overlap; the home posture if there are none in [`DRAWS`] draws.
fn posture(arm: &ArmKinematics, n: u32) -> JointVector {
    let mut stream = Stream::new(SEED, n, Purpose::Kinematics);
    let mut drawn = (0..DRAWS).map(|_| arm.posture_at(|| stream.unit()));
    drawn.find(|q| arm.self_distance(q).distance > 0.0).unwrap_or_else(|| arm.home())
}

/// Tries the poses of every robot that comes with the program.
pub fn measure(effort: Effort) -> anyhow::Result<Measured> {
    let poses = POSES[usize::from(effort == Effort::Quick)];
    let names = RobotModel::names();
    let style = ProgressStyle::with_template("{msg:20} [{bar:30}] {pos}/{len} poses")?;
    let bar = ProgressBar::new(names.len() as u64 * u64::from(poses)).with_style(style);
    let mut rows = Vec::new();
    for name in names {
        bar.set_message(name);
        let robot = RobotModel::named(name).map_err(anyhow::Error::msg)?;
        let solved = solved(robot.kinematics(), poses, || bar.inc(1));
        for (solver, count) in [("least_squares", solved.least_squares), ("programs", solved.programs)] {
            let share = f64::from(count) / f64::from(poses);
            rows.push(Row::measured(&format!("{name}.{solver}"), share, "1").at_least(SHARE));
        }
    }
    bar.finish_and_clear();
    Ok(rows.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The command takes 10,000 poses a robot; these are the first of them.
    #[test]
    fn both_solvers_solve_nearly_all_reachable_poses_of_every_robot() {
        let measured = measure(Effort::Quick).unwrap();
        assert_eq!(measured.rows.len(), 2 * RobotModel::names().len());
        for row in measured.rows {
            assert_eq!(row.pass, Some(true), "{}: {:?}", row.name, row.value);
        }
    }
}
