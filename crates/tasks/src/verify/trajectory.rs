//! A trajectory of joints, base and fingers.

use orchard_robot::{Command, JointValues, RobotModel};

/// Columns of a table for an arm with `dof` joints, in the order in which they are written. SI units; the base's velocity is in the base
/// frame.
pub fn fields(dof: usize) -> Vec<String> {
    let joints = (1..=dof).map(|joint| format!("q{joint}"));
    let rest = ["vx", "vy", "wz", "finger_q", "finger_force"].map(str::to_owned);
    std::iter::once("time".to_owned()).chain(joints).chain(rest).collect()
}

/// Column of the valve of a suction cup, which a table may leave out.
pub const VACUUM: &str = "vacuum";

/// A trajectory that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}: line {line}: {problem}")]
pub struct TrajectoryError {
    /// The file.
    pub file: String,
    /// Line, from 1.
    pub line: u64,
    /// Problem, with the field.
    pub problem: String,
}

pub(crate) fn bad(file: &str, line: u64, field: &str, problem: String) -> TrajectoryError {
    TrajectoryError { file: file.to_owned(), line, problem: format!("{field}: {problem}") }
}

/// One row: the command at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Time since the start \[s\].
    pub time: f64,
    /// The command.
    pub command: Command,
}

impl Row {
    /// The numbers in the order of [`fields`], then the opening of the valve.
    pub fn values(&self) -> Vec<f64> {
        let Command { arm_q, base_velocity, finger_q, finger_force, vacuum, .. } = &self.command;
        let joints = [&[self.time], &arm_q[..], base_velocity].concat();
        joints.into_iter().chain([*finger_q, *finger_force, *vacuum]).collect()
    }

    /// A row of numbers in the order of [`Row::values`] for an arm with `dof` joints; missing ones are 0.
    pub fn from_values(values: &[f64], dof: usize) -> Self {
        let at = |i: usize| values.get(i).copied().unwrap_or_default();
        let command = Command {
            arm_q: JointValues::from_fn(dof, |i| at(1 + i)),
            arm_v: JointValues::zeros(dof),
            base_velocity: std::array::from_fn(|i| at(1 + dof + i)),
            finger_q: at(4 + dof),
            finger_force: at(5 + dof),
            vacuum: at(6 + dof),
        };
        Self { time: at(0), command }
    }
}

/// Rows in ascending order of time, within the robot's limits.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    rows: Vec<Row>,
    warnings: Vec<String>,
}

impl Trajectory {
    /// Checks rows, given with their line numbers in `file`; `longest` is the longest duration \[s\].
    ///
    /// # Errors
    /// No row, a non-finite number, a number outside the limits of the robot's joints and drives, or a time that does not ascend.
    pub fn new(
        file: &str,
        lines: &[(u64, Row)],
        robot: &RobotModel,
        longest: f64,
    ) -> Result<Self, TrajectoryError> {
        if lines.is_empty() {
            return Err(TrajectoryError { file: file.to_owned(), line: 1, problem: "no rows".to_owned() });
        }
        let arm = robot.kinematics();
        let (dof, mut fields) = (arm.dof(), fields(arm.dof()));
        fields.push(VACUUM.to_owned());
        let mut ranges = vec![(f64::NEG_INFINITY, f64::INFINITY, ""); fields.len()];
        ranges[0] = (0.0, longest, " s");
        for (range, limit) in ranges[1..].iter_mut().zip(arm.limits()) {
            *range = (limit.lower, limit.upper, " rad");
        }
        ranges[4 + dof] = (0.0, arm.finger_stroke(), " m");
        ranges[5 + dof] = (0.0, arm.finger_force(), " N");
        ranges[6 + dof] = (0.0, 1.0, "");
        let mut before: Option<&Row> = None;
        for (line, row) in lines {
            for ((value, name), (low, high, unit)) in row.values().into_iter().zip(&fields).zip(&ranges) {
                if !value.is_finite() {
                    return Err(bad(file, *line, name, format!("{value} is not a finite number")));
                }
                if !(*low..=*high).contains(&value) {
                    let problem = format!("{value} is outside the allowed range [{low}, {high}]{unit}");
                    return Err(bad(file, *line, name, problem));
                }
            }
            if let Some(before) = before
                && row.time <= before.time
            {
                let problem =
                    format!("{} s is not greater than the previous time {} s", row.time, before.time);
                return Err(bad(file, *line, &fields[0], problem));
            }
            before = Some(row);
        }
        let rows: Vec<Row> = lines.iter().map(|(_, row)| *row).collect();
        let warnings = warnings(file, lines, robot);
        Ok(Self { rows, warnings })
    }

    /// The rows.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Returns the commands that exceed the robot's limits, one line per field.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Time of the last row \[s\].
    pub fn duration(&self) -> f64 {
        self.rows.last().map_or(0.0, |row| row.time)
    }

    /// Command at a time: linear interpolation between rows. Before the first and after the last row: the arm and fingers of that
    /// row, with the base at rest.
    pub fn at(&self, time: f64) -> Command {
        let next = self.rows.partition_point(|row| row.time <= time);
        let standing = |row: &Row| Command { base_velocity: [0.0; 3], ..row.command };
        match (next.checked_sub(1).map(|k| &self.rows[k]), self.rows.get(next)) {
            (Some(a), Some(b)) => {
                let share = (time - a.time) / (b.time - a.time);
                let (qa, qb) = (&a.command.arm_q, &b.command.arm_q);
                let arm_v = JointValues::from_fn(qa.len(), |i| (qb[i] - qa[i]) / (b.time - a.time));
                let between = a.values().into_iter().zip(b.values()).map(|(a, b)| a + (b - a) * share);
                let row = Row::from_values(&between.collect::<Vec<_>>(), qa.len());
                Command { arm_v, ..row.command }
            }
            (Some(last), None) => standing(last),
            (None, Some(first)) => standing(first),
            // There is always a row.
            (None, None) => Row::from_values(&[], 0).command,
        }
    }
}

/// Returns a warning for each field that exceeds the robot's speed limits, for its worst row.
fn warnings(file: &str, lines: &[(u64, Row)], robot: &RobotModel) -> Vec<String> {
    let arm = robot.kinematics();
    let drive = robot.config().drive.as_ref();
    let [speed, turn] = drive.map_or([0.0; 2], |base| [base.speed_max.si(), base.turn_speed_max.si()]);
    let mut warnings = Vec::new();
    let mut warn = |field: &str, unit: &str, limit: f64, worst: Option<(u64, f64)>| {
        if let Some((line, value)) = worst
            && value > limit
        {
            warnings.push(format!(
                "{file}: line {line}: {field}: {value:.3} {unit} exceeds the robot's limit of {limit} {unit}; the robot will lag"
            ));
        }
    };
    let worst = |speeds: Vec<(u64, f64)>| speeds.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    for (joint, limit) in arm.limits().iter().enumerate() {
        let step = |pair: &[(u64, Row)]| {
            let ((_, a), (line, b)) = (&pair[0], &pair[1]);
            let way = (b.command.arm_q[joint] - a.command.arm_q[joint]).abs();
            (*line, way / (b.time - a.time))
        };
        warn(
            &format!("q{}", joint + 1),
            "rad/s",
            limit.velocity,
            worst(lines.windows(2).map(step).collect()),
        );
    }
    let base = |of: fn(&[f64; 3]) -> f64| {
        worst(lines.iter().map(|(line, row)| (*line, of(&row.command.base_velocity))).collect())
    };
    warn("vx", "m/s", speed, base(|v| v[0].abs()));
    warn("vy", "m/s", speed, base(|v| v[1].abs()));
    warn("wz", "rad/s", turn, base(|v| v[2].abs()));
    let start = robot.start_command().arm_q;
    let (line, first) = &lines[0];
    let off = first.command.arm_q.iter().zip(&start).map(|(q, q0)| (q - q0).abs()).fold(0.0, f64::max);
    if off > START_TOLERANCE {
        warnings.push(format!(
            "{file}: line {line}: the first posture is {off:.3} rad from the robot's start posture {start:?}; the arm will jump"
        ));
    }
    warnings
}

/// Largest joint distance of the first row from the start posture without a warning \[rad\]: 3 degrees, above any rounding error.
const START_TOLERANCE: f64 = 0.05;
