//! Reads and writes trajectory files: tables (CSV) and JSON lines.

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
        let header = reader.headers().map_err(broken)?.clone();
        if let Some(name) = header.iter().find(|name| !FIELDS.contains(name)) {
            return Err(at(1, format!("unknown column '{name}'; the columns are {}", FIELDS.join(","))));
        }
        let mut columns = [0; FIELDS.len()];
        for (column, field) in columns.iter_mut().zip(FIELDS) {
            let mut places = header.iter().enumerate().filter(|(_, name)| *name == field);
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
            // Numbers need no quotes; the shortest digits identify them exactly.
            text += &row.values().map(|value| value.to_string()).join(",");
            text.push('\n');
        }
        text
    }
}
