//! `cargo xtask check-web`: the page in a browser, and its bits against those here.

use std::path::{Path, PathBuf};

use orchard_bench::store::write_bytes;
use orchard_digitised::mtg;
use orchard_program::{Failure, Verdict};
use orchard_spec::{Preset, Spec};
use orchard_web::{Ask, Files, PolicyFiles, Tab, grow};
use orchard_web_batch::{Asked, Stand};
use serde::{Deserialize, Serialize};

use crate::{browser, python, web, workspace};

/// Builds the page of docs/web.md, runs an episode of the expert in a worker of headless Chromium, compares every frame's digest with this
/// processor's, and opens the page at 1280 and 390 px.
#[derive(clap::Args)]
#[command(
    after_help = "A digest covers the depth image that the controller saw, its command, and the state of the world; so do those of a short episode of a policy. On the\n\
                  page: it draws, steps, pulls a branch by mouse and by touch, shows the wrist camera, is driven by keys, touch and a made-up gamepad, opens a policy and digitised trees,\n                  shows many trees by WebGPU, whose joint angles are those of f64 but for rounding,\n\
                  grows another tree, and says what is wrong with a bad link, bad files, and a browser that lacks WebGL2 or WebAssembly; nothing is wider than the\n\
                  window, every control has a label, the console is empty. Screenshots are written to target/web/*.png.\n\n\
                  Needs Rust's target wasm32-unknown-unknown, Chromium (Debian: chromium), python3 with venv, and the network on the first run: the driver\n\
                  goes into target/web/venv. What is missing is named and the check is skipped; with CI=true in the environment it fails."
)]
pub struct Args {
    /// Length of the episode \[s\]
    #[arg(long, value_name = "S", default_value_t = 75.0, value_parser = seconds)]
    seconds: f64,
}

/// The policy whose frames are compared, in the folder of policies, and their number: it has looked three times by then.
const POLICY: (&str, u32) = ("harvest-clone", 180);

/// Number of frames of a batch that are compared.
const BATCH_FRAMES: u32 = 12;
/// Trees of the first batch: a tile of the kernels with one to spare, so that there are two; and of the batch of each preset.
const BATCH_TREES: [u32; 2] = [33, 2];
/// Shake of the batch of each preset \[rad/s\]: harder ones throw off fruit and turn twigs so fast that f64 takes velocity products otherwise (docs/web.md).
const GENTLE: f64 = 0.05;
/// Largest error of a joint angle in a batch over the largest angle: the bound of `validate gpu`.
const ANGLE: f64 = 5e-5;
/// Least angle that counts as the largest \[rad\]: at rest, single precision leaves errors of 2e-7 rad.
const LEAST_ANGLE: f64 = 0.02;

/// Seed of the digitised trees that the page opens.
const TREE_SEED: u64 = 7;

/// Folder of the script, of the page and of the screenshots.
const SUITE: &str = "web";

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.1..=600.0).contains(seconds));
    seconds.ok_or_else(|| "must be a time from 0.1 to 600 s".to_owned())
}

/// An episode that both sides run.
#[derive(Serialize)]
struct Episode {
    ask: Ask,
    frames: u32,
    /// Length of the episode \[s\].
    seconds: f64,
    policy: PolicyEpisode,
    trees: [PathBuf; 2],
    batches: Vec<BatchRun>,
}

/// Frames of a batch of trees, after which both sides have joint angles.
#[derive(Clone, Serialize)]
struct BatchRun {
    asked: Asked,
    frames: u32,
    /// Trees whose angles are compared.
    trees: Vec<usize>,
}

/// A short episode of a policy that both sides run.
#[derive(Serialize)]
struct PolicyEpisode {
    ask: Ask,
    frames: u32,
    /// File name of the network.
    name: String,
    network: PathBuf,
    spec: PathBuf,
}

/// Findings of the browser.
#[derive(Deserialize)]
struct Found {
    /// Digest of every frame, hexadecimal.
    digests: Vec<String>,
    /// The same of the policy's episode.
    policy_digests: Vec<String>,
    /// Joint angles of each batch's trees \[rad\].
    angles: Vec<Vec<Vec<f64>>>,
    /// Substeps of a tree per second of the batch that the page shows.
    batch_rate: f64,
    /// Wall time of the same episode without digests \[s\].
    seconds: f64,
    /// Time from the request of the page to its first picture \[s\].
    first_picture: f64,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    match check(args.seconds)? {
        Verdict::Agreed => say!("screenshots: {}", python::folder(SUITE).display()),
        Verdict::Skipped(reason) => eprintln!("SKIPPED: the page is not run in a browser: {reason}"),
    }
    Ok(())
}

/// Runs the page in a browser; `Skipped` gives the reason why it cannot.
fn check(seconds: f64) -> Result<Verdict, Failure> {
    let chromium = match browser::find()? {
        Ok(chromium) => chromium,
        Err(skipped) => return Ok(skipped),
    };
    if !web::can_build() {
        return browser::lacking(web::missing());
    }
    let environment = match python::environment(SUITE)? {
        Ok(environment) => environment,
        Err(skipped) => return Ok(skipped),
    };
    let folder = python::folder(SUITE);
    let weight = web::build(&folder.join("page"))?;
    let ask = Ask::default();
    let tab = grow(&ask, &Files::default()).map_err(|e| Failure::Failed(e.to_string()))?;
    let frames = (seconds * tab.told().told.frame_rate).round() as u32;
    let (policy, policy_tab) = of_policy()?;
    let policy_frames = policy.frames;
    let trees = trees(&folder)?;
    let batches = batches();
    let stepped = batches.iter().map(stepped).collect::<Result<Vec<_>, _>>()?;
    let episode = Episode { ask, frames, seconds, policy, trees, batches: batches.clone() };
    let (asked, found) = (folder.join("episode.json"), folder.join("found.json"));
    let text = serde_json::to_vec(&episode).map_err(|e| Failure::Failed(e.to_string()))?;
    write_bytes(&asked, &text).map_err(|e| Failure::Failed(e.to_string()))?;
    let here = std::thread::spawn(move || (digests(tab, frames), digests(policy_tab, policy_frames)));
    let page = folder.join("page");
    environment.compare("check.py", &[chromium, page, asked, found.clone(), folder])?;
    let (here, by_policy) =
        here.join().map_err(|_| Failure::Failed("the episode panicked on this processor".into()))?;
    let there = read(&found)?;
    compare(&here, &there.digests)?;
    compare(&by_policy, &there.policy_digests)?;
    let error = angle_errors(&batches, &stepped, &there.angles)?;
    let [factor, first] = [seconds / there.seconds, there.first_picture];
    say!(
        "{frames} frames of the expert and {policy_frames} of {}: the same bits in the browser; {factor:.1} times real time, first picture after {first:.1} s, {weight}",
        POLICY.0
    );
    say!(
        "trees of {} presets by WebGPU: joint angles after {BATCH_FRAMES} frames within {error:.1e} of the largest; the page of many trees steps {:.0} substeps of a tree per second",
        Preset::ALL.len(),
        there.batch_rate
    );
    Ok(Verdict::Agreed)
}

/// The episode of the policy, and its start here.
fn of_policy() -> Result<(PolicyEpisode, Tab), Failure> {
    let (stem, frames) = POLICY;
    let [network, spec] =
        ["onnx", "json"].map(|ending| workspace::root().join("policies").join(format!("{stem}.{ending}")));
    let name = format!("{stem}.onnx");
    let failed = |path: &Path, e: std::io::Error| Failure::Failed(format!("{}: {e}", path.display()));
    let files = PolicyFiles {
        name: name.clone(),
        network: std::fs::read(&network).map_err(|e| failed(&network, e))?,
        spec: std::fs::read_to_string(&spec).map_err(|e| failed(&spec, e))?,
    };
    let ask = Ask { driver: format!("onnx:{name}"), ..Ask::default() };
    let files = Files { policy: Some(files), ..Files::default() };
    let tab = grow(&ask, &files).map_err(|e| Failure::Failed(e.to_string()))?;
    Ok((PolicyEpisode { ask, frames, name, network, spec }, tab))
}

/// Writes the files of two digitised trees: one in JSON, and one as an MTG file that does not state its units.
fn trees(folder: &Path) -> Result<[PathBuf; 2], Failure> {
    let grown = orchard_treegen::grow(&Spec::paper(), TREE_SEED, 0);
    let grown = grown.map_err(|e| Failure::Failed(e.to_string()))?;
    let bare: String = mtg::write(&grown)
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| format!("{line}\n"))
        .collect();
    let files = [("tree.json", orchard_digitised::json::write(&grown)), ("tree.mtg", bare)];
    for (name, text) in &files {
        write_bytes(&folder.join(name), text.as_bytes()).map_err(|e| Failure::Failed(e.to_string()))?;
    }
    Ok(files.map(|(name, _)| folder.join(name)))
}

/// A batch of the page's first choice, shaken hard, and one of every preset, shaken gently.
fn batches() -> Vec<BatchRun> {
    let run = |asked: Asked| {
        let trees = vec![0, 1, asked.worlds as usize - 1];
        BatchRun { asked, frames: BATCH_FRAMES, trees }
    };
    let [many, few] = BATCH_TREES;
    let hard = Asked { worlds: many, ..Asked::default() };
    let gentle = |preset: &Preset| Asked {
        preset: preset.name().to_owned(),
        worlds: few,
        shake: GENTLE,
        ..Asked::default()
    };
    [hard].into_iter().chain(Preset::ALL.iter().map(gentle)).map(run).collect()
}

/// Joint angles of a batch's trees in f64 \[rad\].
fn stepped(batch: &BatchRun) -> Result<Vec<Vec<f64>>, Failure> {
    let mut stand = Stand::new(&batch.asked).map_err(Failure::Failed)?;
    while stand.grow_one().map_err(Failure::Failed)? {}
    let of = |&index: &usize| {
        let mut world = stand.worlds()[index].clone();
        (0..batch.frames).for_each(|_| drop(world.step()));
        world.data().q.clone()
    };
    Ok(batch.trees.iter().map(of).collect())
}

/// Largest difference of joint angles of all batches, each over the largest angle of its batch.
fn angle_errors(
    batches: &[BatchRun],
    here: &[Vec<Vec<f64>>],
    there: &[Vec<Vec<f64>>],
) -> Result<f64, Failure> {
    if here.len() != there.len() {
        return Err(Failure::Failed(format!(
            "{} batches of trees by WebGPU instead of {}",
            there.len(),
            here.len()
        )));
    }
    let mut errors = batches.iter().zip(here.iter().zip(there)).map(|(batch, (here, there))| {
        angle_error(here, there).map_err(|e| Failure::Failed(format!("preset {}: {e}", batch.asked.preset)))
    });
    errors.try_fold(0.0_f64, |most, error| Ok(most.max(error?)))
}

/// Largest difference of joint angles over the largest angle.
fn angle_error(here: &[Vec<f64>], there: &[Vec<f64>]) -> Result<f64, Failure> {
    let (a, b): (Vec<f64>, Vec<f64>) =
        (here.iter().flatten().copied().collect(), there.iter().flatten().copied().collect());
    let largest = a.iter().fold(LEAST_ANGLE, |most, x| most.max(x.abs()));
    let off = a.iter().zip(&b).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    let error = off / largest;
    if a.len() != b.len() || b.iter().any(|x| !x.is_finite()) || error >= ANGLE {
        return Err(Failure::Failed(format!(
            "{} joint angles by WebGPU differ from the {} in f64 by {error:.1e} of the largest; the bound is {ANGLE:.0e}",
            b.len(),
            a.len()
        )));
    }
    Ok(error)
}

/// Digest of every frame on this processor, hexadecimal.
fn digests(mut tab: Tab, frames: u32) -> Vec<String> {
    let hex = |digest: [u8; 32]| digest.iter().map(|byte| format!("{byte:02x}")).collect();
    (0..frames).map(|_| hex(tab.step_watched())).collect()
}

fn read(path: &PathBuf) -> Result<Found, Failure> {
    let failed = |e: String| Failure::Failed(format!("{}: {e}", Path::display(path)));
    let text = std::fs::read(path).map_err(|e| failed(e.to_string()))?;
    serde_json::from_slice(&text).map_err(|e| failed(e.to_string()))
}

/// Compares digests frame by frame.
fn compare(here: &[String], there: &[String]) -> Result<(), Failure> {
    if here.len() != there.len() {
        let (here, there) = (here.len(), there.len());
        return Err(Failure::Failed(format!("the browser ran {there} frames, this processor {here}")));
    }
    match here.iter().zip(there).position(|(here, there)| here != there) {
        None => Ok(()),
        Some(frame) => Err(Failure::Failed(format!(
            "the browser gives other bits than this processor from frame {frame} of {} on",
            here.len()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_frame_that_differs_is_named() {
        let list = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
        assert!(compare(&list(&["a", "b"]), &list(&["a", "b"])).is_ok());
        let e = compare(&list(&["a", "b", "c"]), &list(&["a", "x", "y"])).unwrap_err().to_string();
        assert!(e.contains("from frame 1 of 3 on"), "{e}");
        assert!(compare(&list(&["a"]), &[]).unwrap_err().to_string().contains("ran 0 frames"));
    }

    #[test]
    fn angles_that_differ_are_refused() {
        let here = [vec![0.5, -1.0]];
        assert!(angle_error(&here, &[vec![0.5, -1.000_01]]).unwrap() < ANGLE);
        for bad in [vec![0.5, -1.01], vec![0.5], vec![f64::NAN, -1.0]] {
            assert!(angle_error(&here, &[bad]).is_err());
        }
    }
}
