//! MuJoCo-Warp as a separate process: the same tree, as many worlds at once, on the same device.

use std::path::{Path, PathBuf};
use std::process::Stdio;

use anyhow::Context;
use orchard_bench::store::write_bytes;
use serde::Deserialize;

use crate::judge::SUITE;
use crate::python::{Environment, folder};
use orchard_program::rows::Row;

/// Name of the separate package set, in addition to the judge's.
const PART: &str = "warp";

/// Approximate time of a round \[s\].
const ROUND: &str = "0.4";

/// Results of `tests/judge/warp_speed.py`.
pub struct Peer {
    header: Header,
    cells: Vec<Cell>,
}

/// First line of the script's output.
#[derive(Debug, Deserialize)]
struct Header {
    mujoco_warp: String,
    warp: String,
    mujoco: String,
    device: String,
    nv: u64,
}

/// A variant of running the model, in a number of worlds.
#[derive(Debug, Deserialize)]
struct Cell {
    worlds: usize,
    variant: String,
    about: String,
    #[serde(flatten)]
    outcome: Outcome,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Outcome {
    Timed(Timed),
    Failed { error: String },
}

#[derive(Debug, Deserialize)]
struct Timed {
    /// Substeps of one world per second, and the slowest and fastest round.
    rate: f64,
    spread: [f64; 2],
    /// Device memory \[bytes\].
    bytes: Option<f64>,
    /// Largest difference of a coordinate of the first world from MuJoCo's after the lead, relative to its displacement.
    gap: Option<f64>,
    finite: bool,
    agrees: bool,
}

/// Writes the model text to a file and returns its path.
pub fn leave(model: &str) -> anyhow::Result<PathBuf> {
    let folder = folder(&format!("{SUITE}-{PART}"));
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let file = folder.join("tree.xml");
    write_bytes(&file, model.as_bytes())?;
    Ok(file)
}

impl Peer {
    /// Runs MuJoCo-Warp on a model. The error gives the reason why there is no comparison.
    pub fn measure(model: &Path, worlds: &[usize]) -> Result<Self, String> {
        let mut command = Environment::install_part(SUITE, PART)?.script("warp_speed.py");
        let worlds: Vec<String> = worlds.iter().map(usize::to_string).collect();
        command.arg(model).args(["--worlds", &worlds.join(","), "--seconds", ROUND]).stderr(Stdio::inherit());
        let output = command.output().map_err(|e| format!("cannot run Python: {e}"))?;
        // Cells measured before an early end of the script are used.
        Self::read(&String::from_utf8_lossy(&output.stdout)).map_err(|e| format!("{e} ({})", output.status))
    }

    fn read(answers: &str) -> Result<Self, String> {
        let mut lines = answers.lines();
        let first = lines.next().ok_or("MuJoCo-Warp did not start")?;
        let header =
            serde_json::from_str(first).map_err(|_| format!("unexpected output of MuJoCo-Warp: {first}"))?;
        let cells = lines.map(|line| serde_json::from_str(line).map_err(|e| format!("{line}: {e}")));
        Ok(Self { header, cells: cells.collect::<Result<_, _>>()? })
    }

    /// Versions and device.
    pub fn about(&self) -> String {
        let Header { mujoco_warp, warp, mujoco, device, nv } = &self.header;
        format!("{mujoco_warp}, Warp {warp}, MuJoCo {mujoco}, {device}; {nv} degrees of freedom")
    }

    /// Adds the peer's fastest correct variant to our row.
    pub fn beside(&self, row: Row, worlds: usize) -> Row {
        let sound = self.cells.iter().filter(|cell| cell.worlds == worlds).filter_map(|cell| {
            let timed = cell.sound()?;
            Some((cell, timed))
        });
        let Some((cell, best)) = sound.max_by(|(_, a), (_, b)| a.rate.total_cmp(&b.rate)) else {
            return row;
        };
        let name = format!("MuJoCo-Warp {}, {}", self.header.mujoco_warp, cell.variant);
        Row { peer_spread: Some(best.spread), ..row.beside(&name, best.rate) }
    }

    /// Rows of all variants of the peer.
    pub fn rows(&self) -> impl Iterator<Item = Row> {
        self.cells.iter().map(Cell::row)
    }
}

impl Cell {
    fn sound(&self) -> Option<&Timed> {
        match &self.outcome {
            Outcome::Timed(timed) if timed.finite && timed.agrees => Some(timed),
            _ => None,
        }
    }

    fn row(&self) -> Row {
        let name = format!("gpu.mujoco_warp_{}.{}", self.worlds, self.variant);
        let rate = self.sound().map_or(f64::NAN, |timed| timed.rate);
        let outcome = match &self.outcome {
            Outcome::Timed(timed) => {
                let gap = timed.gap.map_or("not finite".to_owned(), |gap| {
                    format!("relative difference from MuJoCo {gap:.0e}")
                });
                let memory = timed.bytes.map(|bytes| format!("{:.0} MB, ", bytes / 1e6)).unwrap_or_default();
                let verdict = if self.sound().is_some() { "" } else { "WRONG: " };
                format!("{verdict}{memory}{gap}")
            }
            Outcome::Failed { error } => error.clone(),
        };
        let spread = self.sound().map(|timed| timed.spread);
        let note = Some(format!("{}; {outcome}", self.about));
        Row { spread, note, ..Row::measured(&name, rate, "substeps/s") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = r#"{"mujoco_warp": "4.0.0", "warp": "1.19.0", "mujoco": "4.0.0", "device": "CPU", "nv": 392, "seed": 1}"#;

    fn cell(variant: &str, rate: f64, agrees: bool) -> String {
        format!(
            r#"{{"worlds": 512, "variant": "{variant}", "about": "", "rate": {rate}, "spread": [1.0, {rate}], "bytes": 1e9, "finite": true, "gap": 1e-6, "agrees": {agrees}}}"#
        )
    }

    #[test]
    fn the_fastest_way_that_is_right_counts() {
        let lines = [
            HEADER.to_owned(),
            cell("slow", 10.0, true),
            cell("fast", 20.0, true),
            cell("wrong", 30.0, false),
            r#"{"worlds": 4096, "variant": "large", "about": "", "error": "no memory"}"#.to_owned(),
        ];
        let peer = Peer::read(&lines.join("\n")).unwrap();
        let row = peer.beside(Row::measured("a", 40.0, "substeps/s"), 512);
        assert_eq!((row.peer.as_deref(), row.ratio), (Some("MuJoCo-Warp 4.0.0, fast"), Some(2.0)));
        let alone = peer.beside(Row::measured("a", 40.0, "substeps/s"), 4096);
        assert_eq!((alone.peer, alone.ratio), (None, None));
        let rows: Vec<Row> = peer.rows().collect();
        assert_eq!(rows.iter().filter(|row| row.value.is_some()).count(), 2);
        assert!(rows[3].note.as_ref().is_some_and(|note| note.ends_with("no memory")));
    }

    #[test]
    fn no_device_is_told() {
        let line = r#"{"error": "Warp finds no CUDA device"}"#;
        assert!(Peer::read(line).is_err_and(|e| e.contains("no CUDA device")));
        assert!(Peer::read("").is_err());
    }
}
