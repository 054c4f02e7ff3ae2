//! The detection task: what a detector finds in single depth images.

mod tables;

use anyhow::Context;
use orchard_bench::detect::{DetectPlan, DetectRecord, DetectSummary, PaperTrees, Views};
use orchard_bench::order::Trees;
use orchard_bench::protocol::Protocol;
use orchard_bench::store::{Store, write_bytes};
use orchard_perception::DetectorConfig;
use orchard_report::detection;
use orchard_spec::camera::CameraSpec;

use super::bar::Shown;
use super::job::{Ready, unwritten};
use crate::failure::Failure;

/// Name of the figure under the result folder.
const FIGURE: &str = "detect.svg";

/// A camera and a detector before some trees.
pub struct Detecting {
    trees: PaperTrees,
    plan: DetectPlan,
}

impl Detecting {
    /// Plans it.
    pub fn new(
        of: &Trees,
        camera: &CameraSpec,
        detector_name: &str,
        detector: &DetectorConfig,
    ) -> Result<Self, Failure> {
        let trees = PaperTrees::new();
        let plan = DetectPlan {
            preset: trees.preset().to_owned(),
            profile: of.profile.clone(),
            seeds: of.seeds.clone(),
            trees: of.trees,
            camera: camera.clone(),
            detector_name: detector_name.to_owned(),
            detector: detector.clone(),
            protocol: Protocol::paper(),
            texts: PaperTrees::texts(),
        };
        plan.check()?;
        Ok(Self { trees, plan })
    }
}

impl Ready for Detecting {
    type Record = DetectRecord;
    type Summary = DetectSummary;
    type Task<'a> = Views<'a, PaperTrees>;

    fn task(&self) -> Views<'_, PaperTrees> {
        Views::new(&self.plan, &self.trees)
    }

    fn steps(&self) -> u64 {
        self.plan.keys().iter().map(|key| self.plan.steps(key)).max().unwrap_or(0)
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

    fn report(&self, summary: &DetectSummary, store: &Store) -> Result<(), Failure> {
        let svg = detection(summary, &self.plan.protocol.detect).context("cannot draw the figure")?.svg;
        let path = store.path().join(FIGURE);
        write_bytes(&path, svg.as_bytes()).map_err(|e| unwritten(&path, e))?;
        say!("{}", tables::report(summary, &self.plan).trim_end());
        say!("figure: {}", path.display());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_bench::Session;
    use orchard_bench::detect::run as run_plan;
    use orchard_spec::Spec;
    use std::sync::atomic::AtomicBool;

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
        let session = Session::whole(&store, 1, &stop);
        let result = run_plan(&plan, &PaperTrees::new(), &session, &orchard_bench::Silent).unwrap();
        let summary = result.summary.unwrap();
        let text = tables::report(&summary, &plan);
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
        let svg = detection(&summary, &plan.protocol.detect).unwrap().svg;
        assert!(svg.contains("foliage density") && svg.contains("precision, published"));
        assert!(!svg.contains("NaN") && !text.contains("NaN"));
    }
}
