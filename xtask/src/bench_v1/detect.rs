//! The detection task: what a detector finds in single depth images.

mod figure;
mod tables;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use anyhow::Context;
use orchard_bench::OtherPlan;
use orchard_bench::detect::{DetectPlan, DetectRecord, DetectResult, PaperTrees, run as run_plan};
use orchard_bench::protocol::Protocol;
use orchard_bench::store::{Store, write_bytes};
use orchard_perception::DetectorConfig;
use orchard_spec::Spec;

use super::bar::{Bar, Shown};
use super::{Args, Scope, ended};
use crate::failure::Failure;
use crate::sensing_args::{detector_for, read_camera, read_detector};

/// Name of the figure under the result folder.
const FIGURE: &str = "detect.svg";

/// What the command line asks for.
pub struct Asked {
    trees: PaperTrees,
    plan: DetectPlan,
}

impl Asked {
    /// Reads the command line.
    pub fn read(args: &Args, scope: &Scope, protocol: &Protocol) -> Result<Self, Failure> {
        let trees = PaperTrees::new();
        let camera = args.camera.as_deref().map_or_else(|| Ok(Spec::paper().camera), read_camera)?;
        let (detector_name, detector) =
            named_detector(args.detector.as_deref().unwrap_or(detector_for(&camera)))?;
        let plan = DetectPlan {
            preset: trees.preset().to_owned(),
            profile: args.profile.name().to_owned(),
            seeds: scope.seeds.clone(),
            trees: scope.trees,
            camera,
            detector_name,
            detector,
            protocol: protocol.clone(),
            texts: PaperTrees::texts(),
        };
        plan.check().map_err(|e| Failure::BadInput(e.to_string()))?;
        Ok(Self { trees, plan })
    }

    /// Whether the folder takes it.
    pub fn check(&self, store: &Store) -> Result<(), OtherPlan> {
        store.check_plan::<DetectRecord>(&self.plan.keys())
    }

    /// Runs it and reports.
    pub fn run(&self, scope: &Scope, store: &Store, stop: &AtomicBool) -> Result<(), Failure> {
        // Like the summary, a figure of other trees must not outlive the start of a run.
        store.remove(FIGURE).map_err(|e| Failure::Failed(e.to_string()))?;
        let keys = self.plan.keys();
        let steps = keys.iter().map(|key| self.plan.steps(key)).max().unwrap_or(0);
        let bar = Bar::new(keys.len(), steps, shown);
        let result = run_plan(&self.plan, &self.trees, store, scope.threads, stop, &bar);
        bar.clear();
        let DetectResult { summary, .. } = ended(result)?;
        let rules = &self.plan.protocol.detect;
        let svg = figure::svg(&summary, rules).context("cannot draw the figure")?;
        write_bytes(&scope.out.join(FIGURE), svg.as_bytes()).map_err(|e| Failure::Failed(e.to_string()))?;
        say!("{}", tables::report(&summary, &self.plan).trim_end());
        say!("results: {}, {FIGURE}", scope.out.join("detect.json").display());
        Ok(())
    }
}

fn shown(record: &DetectRecord) -> Shown {
    let images = record.densities.iter().flat_map(|density| &density.images);
    let detections = || images.clone().flat_map(|image| &image.detections);
    let told = match &record.quarantined {
        Some(reason) => format!("quarantined: {reason}"),
        None => format!(
            "{} images, {} detections, {} of them right",
            images.clone().count(),
            detections().count(),
            detections().filter(|d| d.fruit.is_some()).count()
        ),
    };
    let ablation: usize = record.variants.iter().map(|variant| variant.images.len()).sum();
    Shown {
        steps: (images.count() + ablation) as u64,
        line: format!("seed {} tree {}: {told}", record.key.seed, record.key.world),
    }
}

/// A detector by its name or from its file, with the name that results give it.
fn named_detector(detector: &str) -> Result<(String, DetectorConfig), Failure> {
    let config = read_detector("--detector", detector)?;
    // The folder is no part of a result: the same file elsewhere gives the same bytes.
    let name = Path::new(detector).file_name().map_or(detector.into(), |name| name.to_string_lossy());
    Ok((name.into_owned(), config))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;

    fn bad(detector: &str) -> String {
        match named_detector(detector) {
            Err(Failure::BadInput(line)) => line,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn detectors_by_name_and_file() {
        assert_eq!(named_detector("paper").unwrap(), ("paper".to_owned(), DetectorConfig::paper()));
        assert_eq!(bad("eagle"), "--detector: no detector 'eagle'; the detectors are: paper, d435i");
        assert!(bad("no/such.toml").starts_with("--detector no/such.toml: "));
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("mine.toml");
        let path = file.to_string_lossy().into_owned();
        let paper = orchard_perception::config::PAPER_TOML;
        std::fs::write(&file, paper.replacen("refine = true", "refine = false", 1)).unwrap();
        let (name, config) = named_detector(&path).unwrap();
        assert_eq!((&*name, config.fit.refine), ("mine.toml", false));
        std::fs::write(
            &file,
            paper.replacen("depth_jump = { value = 15.0", "depth_jump = { value = -1.0", 1),
        )
        .unwrap();
        let line = bad(&path);
        assert!(
            line.contains("mine.toml: segmentation.depth_jump") && line.contains("[0.1, 1000]"),
            "{line}"
        );
    }

    /// One real tree, one view: every table and the figure, with precision and recall side by side.
    #[test]
    fn what_people_get_to_see() {
        let mut protocol = Protocol::paper();
        protocol.detect.views = protocol.detect.views.with_value(1).unwrap();
        let plan = DetectPlan {
            preset: "paper".into(),
            profile: "quick".into(),
            seeds: vec![protocol.tuning_seeds[0]],
            trees: 1,
            camera: Spec::paper().camera,
            detector_name: "paper".into(),
            detector: DetectorConfig::paper(),
            protocol,
            texts: PaperTrees::texts(),
        };
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let stop = AtomicBool::new(false);
        let result = run_plan(&plan, &PaperTrees::new(), &store, 1, &stop, &orchard_bench::Silent).unwrap();
        let text = tables::report(&result.summary, &plan);
        for part in [
            "foliage  precision",
            "upper outer",
            "without cylinder",
            "is asked of the tuning seeds is not judged",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        for line in text.lines().filter(|line| line.contains("precision") && line.starts_with("foliage")) {
            assert!(line.contains("recall"), "{line}");
        }
        let svg = figure::svg(&result.summary, &plan.protocol.detect).unwrap();
        assert!(svg.contains("foliage density") && svg.contains("precision, published"));
        assert!(!svg.contains("NaN") && !text.contains("NaN"));
    }
}
