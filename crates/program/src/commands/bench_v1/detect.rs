//! The detection task: scores a detector on single depth images.

mod tables;

use anyhow::Context;
use orchard_bench::store::Store;
use orchard_report::{detection, precision_recall};
use orchard_scenario::Scenario;
use orchard_tasks::detect::{DetectPlan, DetectRecord, DetectSummary, Views};
use orchard_tasks::plan_file::TreeExtent;

use super::bar::RecordProgress;
use super::task::PresentedTask;
use crate::failure::Failure;

/// Names of the figures under the result folder.
const FIGURE: &str = "detect.svg";
const CURVES: &str = "detect-precision-recall.svg";

/// The detection task of a camera and a detector on some trees.
pub struct Detecting {
    scenario: Scenario,
    plan: DetectPlan,
}

impl Detecting {
    /// Plans the task. A scenario whose detector nobody named gets that of `orchard detect` for images with colour.
    pub fn new(scenario: &Scenario, trees: &TreeExtent) -> Result<Self, Failure> {
        let scenario = scenario.for_images().map_err(|e| Failure::BadInput(e.to_string()))?;
        let plan = DetectPlan::new(&scenario, &trees.profile, trees.seeds.clone(), trees.trees)?;
        plan.check()?;
        Ok(Self { scenario, plan })
    }
}

impl PresentedTask for Detecting {
    type Record = DetectRecord;
    type Summary = DetectSummary;
    type Task<'a> = Views<'a, Scenario>;

    fn task(&self) -> Views<'_, Scenario> {
        Views::new(&self.plan, &self.scenario)
    }

    fn steps(&self) -> u64 {
        self.plan.keys().iter().map(|key| self.plan.steps(key)).max().unwrap_or(0)
    }

    fn shown(record: &DetectRecord) -> RecordProgress {
        let images = record.densities.iter().flat_map(|density| &density.images);
        let detections = || images.clone().flat_map(|image| &image.detections);
        let outcome_text = match &record.quarantined {
            Some(reason) => format!("quarantined: {reason}"),
            None => format!(
                "{} images, {} detections, {} of them true positives",
                images.clone().count(),
                detections().count(),
                detections().filter(|d| d.fruit.is_some()).count()
            ),
        };
        let ablation: usize = record.variants.iter().map(|variant| variant.images.len()).sum();
        RecordProgress {
            steps: (images.count() + ablation) as u64,
            line: format!("seed {} tree {}: {outcome_text}", record.key.seed, record.key.world),
        }
    }

    fn report(&self, summary: &DetectSummary, store: &Store) -> Result<(), Failure> {
        let figures =
            [(FIGURE, detection(summary, &self.plan.protocol.detect)), (CURVES, precision_recall(summary))];
        for (name, figure) in figures {
            let svg = figure.context("cannot draw the figure")?.svg;
            store.write_bytes(name, svg.as_bytes()).map_err(|e| Failure::Failed(e.to_string()))?;
        }
        say!("{}", tables::report(summary, &self.plan).trim_end());
        for name in [FIGURE, CURVES] {
            say!("figure: {}", store.path().join(name).display());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orchard_bench::Session;
    use orchard_tasks::detect::run as run_plan;
    use std::sync::atomic::AtomicBool;

    /// One real tree, one view: all tables and the figure show precision and recall side by side.
    #[test]
    fn what_people_get_to_see() {
        let scenario = Scenario::of(&[]).unwrap();
        let mut plan = DetectPlan::new(&scenario, "quick", vec![20250704], 1).unwrap();
        plan.protocol.detect.views = plan.protocol.detect.views.with_value(1).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let stop = AtomicBool::new(false);
        let session = Session::whole(&store, 1, &stop);
        let result = run_plan(&plan, &scenario, &session, &orchard_bench::NoProgress).unwrap();
        let summary = result.summary.unwrap();
        let text = tables::report(&summary, &plan);
        for part in [
            "foliage  precision",
            "upper outer",
            "without cylinder",
            "AP 0.5 radius",
            "of detections alone, since gates decide",
            "average precision within 1 radius by visible fraction and canopy zone",
            "requirements over the tuning seeds are not judged",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        for line in text.lines().filter(|line| line.contains("precision") && line.starts_with("foliage")) {
            assert!(line.contains("recall"), "{line}");
        }
        let svg = detection(&summary, &plan.protocol.detect).unwrap().svg;
        assert!(svg.contains("foliage density") && svg.contains("precision, published"));
        let curves = precision_recall(&summary).unwrap().svg;
        assert!(curves.contains("recall") && curves.contains("foliage 1.5"));
        assert!([&svg, &curves, &text].iter().all(|text| !text.contains("NaN")));
    }
}
