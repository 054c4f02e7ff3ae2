//! Reads and writes trajectory files: tables (CSV) and JSON lines.

use orchard_robot::{Command, JointValues, RobotModel};
use serde::Deserialize;

use crate::verify::trajectory::{Row, Trajectory, TrajectoryError, VACUUM, bad, fields};

/// A row in JSON.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonRow {
    time: f64,
    arm_q: Vec<f64>,
    base_velocity: [f64; 3],
    finger_q: f64,
    finger_force: f64,
    #[serde(default)]
    vacuum: f64,
}

impl Trajectory {
    /// Reads a table with the columns [`fields`] of the robot and, if it likes, `vacuum`, in any order.
    ///
    /// # Errors
    /// A missing, unknown or duplicate column, a cell that is not a number, or an error of [`Trajectory::new`].
    pub fn from_csv(
        file: &str,
        text: &str,
        robot: &RobotModel,
        longest: f64,
    ) -> Result<Self, TrajectoryError> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
        let at = |line, problem| TrajectoryError { file: file.to_owned(), line, problem };
        let broken = |e: csv::Error| {
            let line = e.position().map_or(1, csv::Position::line);
            let problem = match e.kind() {
                csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
                    format!("{len} cells, but the header has {expected_len} columns")
                }
                _ => e.to_string(),
            };
            at(line, problem)
        };
        let (dof, mut fields) = (robot.kinematics().dof(), fields(robot.kinematics().dof()));
        let header = reader.headers().map_err(broken)?.clone();
        if header.iter().any(|name| name == VACUUM) {
            fields.push(VACUUM.to_owned());
        }
        if let Some(name) = header.iter().find(|name| !fields.iter().any(|field| field == name)) {
            return Err(at(1, format!("unknown column '{name}'; the columns are {}", fields.join(","))));
        }
        let mut columns = vec![0; fields.len()];
        for (column, field) in columns.iter_mut().zip(&fields) {
            let mut places = header.iter().enumerate().filter(|(_, name)| name == field);
            match (places.next(), places.next()) {
                (Some((place, _)), None) => *column = place,
                (None, _) => return Err(at(1, format!("column '{field}' is missing"))),
                (Some(_), Some(_)) => return Err(at(1, format!("column '{field}' occurs twice"))),
            }
        }
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(broken)?;
            let line = record.position().map_or(1, csv::Position::line);
            let mut values = vec![0.0; fields.len()];
            for ((value, column), field) in values.iter_mut().zip(&columns).zip(&fields) {
                let cell = record.get(*column).unwrap_or_default();
                *value =
                    cell.parse().map_err(|_| bad(file, line, field, format!("'{cell}' is not a number")))?;
            }
            rows.push((line, Row::from_values(&values, dof)));
        }
        Self::new(file, &rows, robot, longest)
    }

    /// Reads JSON lines: one object per line; empty lines are ignored.
    ///
    /// # Errors
    /// A line that is not such an object, or an error of [`Trajectory::new`].
    pub fn from_json_lines(
        file: &str,
        text: &str,
        robot: &RobotModel,
        longest: f64,
    ) -> Result<Self, TrajectoryError> {
        let mut rows = Vec::new();
        for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
            let at = |problem| TrajectoryError { file: file.to_owned(), line: number, problem };
            let row: JsonRow = serde_json::from_str(line).map_err(|e| at(e.to_string()))?;
            let dof = robot.kinematics().dof();
            let arm_q = JointValues::try_from(row.arm_q).ok().filter(|q| q.len() == dof);
            let arm_q = arm_q.ok_or_else(|| at(format!("arm_q: the robot's arm has {dof} joints")))?;
            let command = Command {
                arm_q,
                arm_v: JointValues::zeros(dof),
                base_velocity: row.base_velocity,
                finger_q: row.finger_q,
                finger_force: row.finger_force,
                vacuum: row.vacuum,
            };
            rows.push((number, Row { time: row.time, command }));
        }
        Self::new(file, &rows, robot, longest)
    }

    /// The table as [`Trajectory::from_csv`] reads it.
    pub fn to_csv(&self) -> String {
        let dof = self.rows().first().map_or(0, |row| row.command.arm_q.len());
        let mut fields = fields(dof);
        if self.rows().iter().any(|row| row.command.vacuum != 0.0) {
            fields.push(VACUUM.to_owned());
        }
        let mut text = fields.join(",") + "\n";
        for row in self.rows() {
            // Numbers need no quotes; the shortest digits identify them exactly.
            text += &row.values().iter().take(fields.len()).map(f64::to_string).collect::<Vec<_>>().join(",");
            text.push('\n');
        }
        text
    }
}
