//! The steps and commands of an episode as tables.

use orchard_policy::{Field, Values};
use orchard_robot::{Command, JointValues};

use crate::images::Form;
use crate::record::ActionError;
use crate::table::{Column, Table, TableError};
use crate::take::StoredStep;

/// Value of a field in a step.
enum Seen {
    Numbers(usize, Vec<f32>),
    /// Paths of images; empty before the first.
    Images(Vec<String>),
    Derived,
}

/// The steps of an episode so far.
pub(crate) struct Steps {
    fields: Vec<(&'static str, Seen)>,
    frame: Vec<i32>,
    width: usize,
    action: Vec<f32>,
    error: Vec<f64>,
    reward: Vec<f64>,
    cost: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    phase: Vec<String>,
}

/// Reward, cost and end of a step.
pub(crate) struct Worth {
    pub reward: f64,
    pub cost: f64,
    pub terminated: bool,
    pub truncated: bool,
}

impl Steps {
    /// No steps of observations with these fields and actions of so many numbers.
    pub fn new(fields: &[Field], width: usize) -> Self {
        let seen = |field: &Field| match Form::of(field) {
            Form::Numbers => Seen::Numbers(field.shape[0], Vec::new()),
            Form::Depth | Form::Colour => Seen::Images(Vec::new()),
            Form::Derived => Seen::Derived,
        };
        Self {
            fields: fields.iter().map(|field| (field.key, seen(field))).collect(),
            frame: Vec::new(),
            width,
            action: Vec::new(),
            error: Vec::new(),
            reward: Vec::new(),
            cost: Vec::new(),
            terminated: Vec::new(),
            truncated: Vec::new(),
            phase: Vec::new(),
        }
    }

    /// Adds what is seen at the begin of a step in a frame; `images` has the paths of the fields that are images, by field.
    pub fn see(&mut self, frame: u32, values: &[Values], images: &[String]) {
        self.frame.push(frame as i32);
        for (((_, seen), values), path) in self.fields.iter_mut().zip(values).zip(images) {
            match (seen, values) {
                (Seen::Numbers(_, all), Values::F32(values)) => all.extend(values),
                (Seen::Images(paths), _) => paths.push(path.clone()),
                _ => {}
            }
        }
    }

    /// Adds what was done in the step, and its worth.
    pub fn act(&mut self, action: &[f32], error: &[f64], phase: String, worth: &Worth) {
        self.action.extend(action);
        // The table has errors as 32-bit numbers; so they are the same when they are read back.
        self.error.extend(error.iter().map(|e| f64::from(*e as f32)));
        self.phase.push(phase);
        self.reward.push(worth.reward);
        self.cost.push(worth.cost);
        self.terminated.push(worth.terminated);
        self.truncated.push(worth.truncated);
    }

    /// Error of the actions over all steps.
    pub fn action_error(&self) -> ActionError {
        let steps = self.frame.len().max(1) as f64;
        let mut all = ActionError {
            mean: vec![0.0; self.width],
            largest: vec![0.0; self.width],
            saturated: vec![0.0; self.width],
        };
        for (row, actions) in self.error.chunks_exact(self.width).zip(self.action.chunks_exact(self.width)) {
            for (i, (error, action)) in row.iter().zip(actions).enumerate() {
                all.mean[i] += error / steps;
                all.largest[i] = f64::max(all.largest[i], *error);
                all.saturated[i] += f64::from(u8::from(action.abs() >= 1.0)) / steps;
            }
        }
        all
    }

    /// The table.
    pub fn table(self) -> Table {
        let mut table = Table::default();
        let mut put = |name: &str, column: Column| table.columns.push((name.to_owned(), column));
        put("frame", Column::Int(self.frame));
        for (key, seen) in self.fields {
            match seen {
                Seen::Numbers(width, values) => put(key, Column::Floats(width, values)),
                Seen::Images(paths) => put(key, Column::Text(paths)),
                Seen::Derived => {}
            }
        }
        put("action", Column::Floats(self.width, self.action));
        put("action_error", Column::Floats(self.width, self.error.iter().map(|e| *e as f32).collect()));
        put("reward", Column::Number(self.reward));
        put("cost", Column::Number(self.cost));
        put("terminated", Column::Flag(self.terminated));
        put("truncated", Column::Flag(self.truncated));
        put("phase", Column::Text(self.phase));
        table
    }
}

/// The actions of a table of steps, with their errors and the controller's states.
pub(crate) fn stored_steps(table: &Table) -> Result<Vec<StoredStep>, TableError> {
    let (width, actions) = table.floats("action")?;
    let (_, errors) = table.floats("action_error")?;
    let rows = actions.chunks_exact(width.max(1)).zip(errors.chunks_exact(width.max(1)));
    let step = |((action, error), phase): ((&[f32], &[f32]), &String)| StoredStep {
        action: action.to_vec(),
        error: error.iter().map(|e| f64::from(*e)).collect(),
        phase: phase.clone(),
    };
    Ok(rows.zip(table.texts("phase")?).map(step).collect())
}

/// The commands of an episode as a table, one row a frame, with every bit.
pub(crate) fn commands_table(commands: &[Command]) -> Table {
    let joints = commands.first().map_or(1, |command| command.arm_q.len());
    let flat = |of: &dyn Fn(&Command) -> Vec<f64>| commands.iter().flat_map(of).collect::<Vec<f64>>();
    let columns = [
        ("arm_q", Column::Doubles(joints, flat(&|c| c.arm_q.to_vec()))),
        ("arm_v", Column::Doubles(joints, flat(&|c| c.arm_v.to_vec()))),
        ("base_velocity", Column::Doubles(3, flat(&|c| c.base_velocity.to_vec()))),
        ("finger_q", Column::Number(flat(&|c| vec![c.finger_q]))),
        ("finger_force", Column::Number(flat(&|c| vec![c.finger_force]))),
        ("vacuum", Column::Number(flat(&|c| vec![c.vacuum]))),
    ];
    Table { columns: columns.map(|(name, column)| (name.to_owned(), column)).to_vec() }
}

/// The commands of a table.
pub(crate) fn stored_commands(table: &Table) -> Result<Vec<Command>, TableError> {
    let (joints, arm_q) = table.doubles("arm_q")?;
    let (_, arm_v) = table.doubles("arm_v")?;
    let (_, base) = table.doubles("base_velocity")?;
    let (finger_q, finger_force) = (table.numbers("finger_q")?, table.numbers("finger_force")?);
    let vacuum = table.numbers("vacuum")?;
    let fits = [arm_v.len() / joints.max(1), base.len() / 3].iter().all(|rows| *rows == table.rows());
    if !fits || JointValues::try_from(arm_q.get(..joints).unwrap_or_default()).is_err() {
        return Err(TableError::Rows("arm_q".to_owned()));
    }
    let values = |all: &[f64], row: usize| JointValues::from_fn(joints, |i| all[row * joints + i]);
    let command = |row: usize| Command {
        arm_q: values(arm_q, row),
        arm_v: values(arm_v, row),
        base_velocity: [base[3 * row], base[3 * row + 1], base[3 * row + 2]],
        finger_q: finger_q[row],
        finger_force: finger_force[row],
        vacuum: vacuum[row],
    };
    Ok((0..table.rows()).map(command).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_come_back_from_their_table() {
        let command = Command {
            arm_q: [0.1, -0.0, 1e-310, 2.0, 3.0, -3.5].into(),
            arm_v: [1.0 / 3.0; 6].into(),
            base_velocity: [0.1 + 0.2, -0.0, 0.5],
            finger_q: 0.04,
            finger_force: 20.0,
            vacuum: 0.5,
        };
        let all = [command, Command { finger_q: 0.0, ..command }];
        let table = Table::from_parquet(commands_table(&all).to_parquet("commands").unwrap()).unwrap();
        assert_eq!(stored_commands(&table).unwrap(), all);
        let mut short = table.clone();
        short.columns[2].1 = Column::Doubles(1, vec![0.0; 2]);
        assert!(stored_commands(&short).is_err());
        short.columns.remove(0);
        assert_eq!(stored_commands(&short).unwrap_err().to_string(), "there is no column arm_q of this kind");
    }
}
