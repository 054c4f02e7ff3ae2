//! MuJoCo as a separate process that steps exported trees on request.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Stdio};

use anyhow::Context;
use orchard_bench::store::write_bytes;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::judge::SUITE;
use crate::python::{Environment, folder};

/// The worker of `tests/judge/speed.py`, which documents the protocol.
pub struct Peer {
    process: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    /// MuJoCo's version.
    pub version: String,
}

/// Schedule of a measurement on a loaded subject.
#[derive(Debug, Clone, Copy)]
pub struct Course {
    /// Untimed steps before the timed ones.
    pub lead: u32,
    /// Steps that are timed.
    pub steps: u32,
    /// Repeats of the timed steps, each from the same state.
    pub repeats: u32,
}

/// A timed course.
#[derive(Debug, Clone, Deserialize)]
pub struct Timed {
    /// Processor time of all repeats, all threads \[s\].
    pub seconds: f64,
    /// Largest velocity at the end of the course, in the slowest world \[rad/s, m/s\].
    pub fastest: f64,
}

/// Contacts of the timed part of a course.
#[derive(Debug, Clone, Deserialize)]
pub struct ContactCounts {
    /// Mean number.
    pub contacts: f64,
    /// Smallest number.
    pub fewest: u32,
    /// True if the state is still finite.
    pub finite: bool,
}

impl Peer {
    /// Starts MuJoCo. The error gives the reason why it is missing.
    pub fn start() -> Result<Self, String> {
        let environment = Environment::install(SUITE)?;
        let mut command = environment.script("speed.py");
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = command.spawn().map_err(|e| format!("cannot run Python: {e}"))?;
        let (requests, answers) = (process.stdin.take(), process.stdout.take());
        let answers = BufReader::new(answers.ok_or("the Python process has no output")?);
        let mut peer = Self { process, requests, answers, version: String::new() };
        let hello: Value = peer.answer().map_err(|e| format!("MuJoCo did not start: {e:#}"))?;
        peer.version = hello["version"].as_str().unwrap_or("of unknown version").to_owned();
        Ok(peer)
    }

    /// Loads models under a name, each from the text of its file. Returns the degrees of freedom of the first.
    pub fn load(&mut self, name: &str, models: &[String], threads: usize) -> anyhow::Result<u64> {
        let folder = folder(SUITE).join("speed");
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let write = |(index, text): (usize, &String)| -> anyhow::Result<PathBuf> {
            let file: PathBuf = folder.join(format!("{name}-{index}.xml"));
            write_bytes(&file, text.as_bytes())?;
            Ok(file)
        };
        let files = models.iter().enumerate().map(write).collect::<anyhow::Result<Vec<_>>>()?;
        let loaded: Value =
            self.ask(json!({ "do": "load", "name": name, "files": files, "threads": threads }))?;
        remove(&files, &folder);
        loaded["dofs"].as_u64().context("MuJoCo did not report its degrees of freedom")
    }

    /// Times a course.
    pub fn time(&mut self, name: &str, course: Course) -> anyhow::Result<Timed> {
        let Course { lead, steps, repeats } = course;
        self.ask(json!({ "do": "time", "name": name, "lead": lead, "steps": steps, "repeats": repeats }))
    }

    /// Counts the contacts on a course.
    pub fn watch(&mut self, name: &str, course: Course) -> anyhow::Result<ContactCounts> {
        self.ask(json!({ "do": "watch", "name": name, "lead": course.lead, "steps": course.steps }))
    }

    fn ask<T: DeserializeOwned>(&mut self, request: Value) -> anyhow::Result<T> {
        let requests = self.requests.as_mut().context("the MuJoCo process has ended")?;
        writeln!(requests, "{request}")
            .and_then(|()| requests.flush())
            .context("the MuJoCo process has ended")?;
        self.answer()
    }

    fn answer<T: DeserializeOwned>(&mut self) -> anyhow::Result<T> {
        let mut line = String::new();
        self.answers.read_line(&mut line).context("the MuJoCo process has ended")?;
        anyhow::ensure!(!line.is_empty(), "the MuJoCo process has ended");
        serde_json::from_str(&line).with_context(|| format!("unexpected answer of MuJoCo: {line}"))
    }
}

/// Deletes the model files, some 60 MB, after they are loaded.
fn remove(files: &[PathBuf], folder: &Path) {
    for file in files {
        // A file that remains does no harm.
        let _ = std::fs::remove_file(file);
    }
    let _ = std::fs::remove_dir(folder);
}

impl Drop for Peer {
    fn drop(&mut self) {
        // The end of its input ends the worker.
        self.requests = None;
        let _ = self.process.wait();
    }
}
