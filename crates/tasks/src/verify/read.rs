//! Trajectories as files: tables (CSV) and JSON lines.

use orchard_robot::RobotModel;
use serde::Deserialize;

use crate::verify::trajectory::{FIELDS, Row, Trajectory, TrajectoryError, bad};

/// A row in JSON.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonRow {
    time: f64,
    arm_q: [f64; 7],
    base_velocity: [f64; 3],
    finger_q: f64,
    finger_force: f64,
}

impl Trajectory {
    /// Reads a table with the columns [`FIELDS`] in any order.
    ///
    /// # Errors
    /// A column missing, unknown or given twice, a cell that is no number, and what [`Trajectory::new`] refuses.
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
                    format!("{len} cells, but the first line names {expected_len} columns")
                }
                _ => e.to_string(),
            };
            at(line, problem)
        };
        let header = reader.headers().map_err(broken)?.clone();
        if let Some(name) = header.iter().find(|name| !FIELDS.contains(name)) {
            return Err(at(1, format!("unknown column '{name}'; the columns are {}", FIELDS.join(","))));
        }
        let mut columns = [0; FIELDS.len()];
        for (column, field) in columns.iter_mut().zip(FIELDS) {
            let mut places = header.iter().enumerate().filter(|(_, name)| *name == field);
            match (places.next(), places.next()) {
                (Some((place, _)), None) => *column = place,
                (None, _) => return Err(at(1, format!("no column '{field}'"))),
                (Some(_), Some(_)) => return Err(at(1, format!("column '{field}' stands twice"))),
            }
        }
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(broken)?;
            let line = record.position().map_or(1, csv::Position::line);
            let mut values = [0.0; FIELDS.len()];
            for ((value, column), field) in values.iter_mut().zip(columns).zip(FIELDS) {
                let cell = record.get(column).unwrap_or_default();
                *value =
                    cell.parse().map_err(|_| bad(file, line, field, format!("'{cell}' is not a number")))?;
            }
            rows.push((line, Row::from_values(&values)));
        }
        Self::new(file, &rows, robot, longest)
    }

    /// Reads JSON lines: an object a line, empty lines left out.
    ///
    /// # Errors
    /// A line that is no such object, and what [`Trajectory::new`] refuses.
    pub fn from_json_lines(
        file: &str,
        text: &str,
        robot: &RobotModel,
        longest: f64,
    ) -> Result<Self, TrajectoryError> {
        let mut rows = Vec::new();
        for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
            let row: JsonRow = serde_json::from_str(line).map_err(|e| TrajectoryError {
                file: file.to_owned(),
                line: number,
                problem: e.to_string(),
            })?;
            let [vx, vy, wz] = row.base_velocity;
            let [q1, q2, q3, q4, q5, q6, q7] = row.arm_q;
            let values = [row.time, q1, q2, q3, q4, q5, q6, q7, vx, vy, wz, row.finger_q, row.finger_force];
            rows.push((number, Row::from_values(&values)));
        }
        Self::new(file, &rows, robot, longest)
    }

    /// The table as [`Trajectory::from_csv`] reads it.
    pub fn to_csv(&self) -> String {
        let mut text = FIELDS.join(",") + "\n";
        for row in self.rows() {
            // Numbers need no quotes, and their shortest digits give them back.
            text += &row.values().map(|value| value.to_string()).join(",");
            text.push('\n');
        }
        text
    }
}
