//! Rewards that cannot be hacked: who does not work earns less than the baseline controller on the same trees.

use orchard_env::{Settings, Task, TaskEnv, Via};
use orchard_geometry::{Vec3, math};
use orchard_picker::{Goal, Kind};
use orchard_policy::{Control, Spaces, Values};
use orchard_robot::RobotModel;
use orchard_scenario::Scenario;

const SEED: u64 = 20250704;
const WORLDS: u32 = 3;
/// Time in which all of them try \[s\].
const TIME: u32 = 30;

/// Environments of a task at 10 Hz with the truth beside the state.
fn env(task: Task, control: Control) -> TaskEnv {
    let spaces = Spaces { control, ..Spaces::default() };
    let settings = Settings { spaces, privileged: true, ..Settings::of(task) };
    let mut env = TaskEnv::new(&Scenario::of(&[]).unwrap(), &settings, 0..WORLDS).unwrap();
    env.reset(&[Some(SEED); WORLDS as usize], &[true; WORLDS as usize]).unwrap();
    env
}

fn over(env: &TaskEnv, k: usize) -> bool {
    env.report(k).terminated || env.report(k).truncated
}

fn earned(env: &TaskEnv) -> f64 {
    (0..env.len()).map(|k| env.report(k).statistics.total_reward).sum::<f64>() / f64::from(WORLDS)
}

/// Returns of the environments under a function from observation and number of the step to an action.
fn paid(task: Task, control: Control, act: impl Fn(&Seen, u32) -> Vec<f32>) -> f64 {
    let mut env = env(task, control);
    let robot = RobotModel::named("ridgeback-fr3").unwrap();
    for step in 0..10 * TIME {
        let mask: Vec<bool> = (0..env.len()).map(|k| !over(&env, k)).collect();
        let actions: Vec<f32> = (0..env.len()).flat_map(|k| act(&Seen::of(&env, k, &robot), step)).collect();
        env.step(&actions, &mask).unwrap();
    }
    earned(&env)
}

/// Returns of the environments under the baseline's commands.
fn baseline(task: Task) -> f64 {
    let mut env = env(task, Control::JointDelta);
    let scenario = Scenario::of(&[]).unwrap();
    for k in 0..env.len() {
        let (robot, detector) = (scenario.robot(), scenario.detector().clone());
        let mut controller = match task {
            Task::Reach => {
                let told = numbers(&env, k, "target");
                let p_odom = Vec3::new(told[0], told[1], told[2]);
                Kind::Baseline.with_goal(&Goal::Grasp { p_odom, radius: told[3] }, robot, detector)
            }
            _ => Kind::Baseline.controller(robot, detector),
        };
        for _ in 0..10 * TIME {
            if !over(&env, k) {
                env.drive(k, &mut *controller, Via::Commands).unwrap();
            }
        }
    }
    earned(&env)
}

fn numbers(env: &TaskEnv, k: usize, key: &str) -> Vec<f64> {
    let fields = &env.interface().policy.observation;
    let i = fields.iter().position(|field| field.key == key).unwrap();
    match &env.observation(k)[i] {
        Values::F32(values) => values.iter().map(|x| f64::from(*x)).collect(),
        other => panic!("{other:?}"),
    }
}

/// The goal and the way to it from the tool, base frame \[m\], and the number of channels of an action.
struct Seen {
    goal_base: Vec3,
    to_goal_base: Vec3,
    channels: usize,
}

impl Seen {
    fn of(env: &TaskEnv, k: usize, robot: &RobotModel) -> Self {
        let (at, goal) = (numbers(env, k, "agent_pos"), numbers(env, k, "privileged"));
        let mut q = robot.kinematics().home();
        (0..7).for_each(|i| q[i] = at[i]);
        let (x, y, yaw, height) = (at[9], at[10], at[11], at[12]);
        let (sin, cos) = math::sin_cos(yaw);
        let (dx, dy) = (goal[0] - x, goal[1] - y);
        let goal_base = Vec3::new(cos * dx + sin * dy, cos * dy - sin * dx, goal[2] - height);
        let tool_base = robot.kinematics().tcp(&q).translation.vector;
        let channels = env.interface().policy.action.len();
        Self { goal_base, to_goal_base: goal_base - tool_base, channels }
    }

    /// Drives and reaches to the goal and stays there, with the gripper at a number. Control `ee_delta`.
    fn go(&self, gripper: f32) -> Vec<f32> {
        let (mut action, n) = (vec![0.0; self.channels], self.channels);
        // The base stops within the arm's reach of the goal; then the hand goes on and comes to rest there.
        let (reach, step) = (0.7, 0.05);
        let away = self.goal_base.xy().norm();
        let drive = (away - reach).clamp(0.0, 1.0) / away.max(reach);
        action[n - 4] = (drive * self.goal_base.x) as f32;
        action[n - 3] = (drive * self.goal_base.y) as f32;
        if away < 1.2 * reach {
            for (number, way) in action.iter_mut().zip(self.to_goal_base.iter()) {
                *number = (0.5 * way / step).clamp(-0.5, 0.5) as f32;
            }
        }
        action[n - 1] = gripper;
        action
    }
}

/// Stretches the arm forwards and back with the same motion everywhere, and closes the fingers when it is out.
fn blind(seen: &Seen, step: u32) -> Vec<f32> {
    let mut action = vec![0.0; seen.channels];
    let (n, phase) = (seen.channels, step % 60);
    action[n - 4] = if step < 15 { 0.5 } else { 0.0 };
    let out = if phase < 20 {
        0.5
    } else if phase < 40 {
        0.0
    } else {
        -0.5
    };
    (action[1], action[3]) = (out, out);
    action[n - 1] = if (15..45).contains(&phase) { -1.0 } else { 1.0 };
    action
}

/// Goes to the fruit with the fingers closed, then shakes to and fro.
fn shaker(seen: &Seen, step: u32) -> Vec<f32> {
    let mut action = seen.go(-1.0);
    if seen.to_goal_base.norm() < 0.15 {
        let sign = if step % 4 < 2 { 1.0 } else { -1.0 };
        (action[0], action[1], action[2]) = (sign, -sign, sign);
    }
    action
}

fn hacks_earn_less_in(task: Task) {
    let worker = baseline(task);
    let hacks = [
        ("blind", paid(task, Control::JointDelta, blind)),
        ("mean position", paid(task, Control::JointAbsolute, |seen, _| vec![0.0; seen.channels])),
        ("shaker", paid(task, Control::EeDelta, shaker)),
        ("rests on the fruit", paid(task, Control::EeDelta, |seen, _| seen.go(-1.0))),
        ("rests with open fingers", paid(task, Control::EeDelta, |seen, _| seen.go(1.0))),
    ];
    println!("{task:?}: baseline {worker:.3}, {hacks:.3?}");
    for (name, paid) in hacks {
        assert!(paid < worker, "{name} earns {paid}, the baseline {worker}");
    }
}

#[test]
fn hacks_earn_less_than_the_baseline_in_the_harvest() {
    hacks_earn_less_in(Task::Harvest);
}

#[test]
fn hacks_earn_less_than_the_baseline_in_reaching() {
    hacks_earn_less_in(Task::Reach);
}
