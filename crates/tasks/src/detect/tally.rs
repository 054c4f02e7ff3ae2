//! Counts behind the metrics, for one tree.

use std::collections::{BTreeMap, BTreeSet};

use crate::detect::record::{DetectRecord, DetectionRecord, FruitSeen, SitsOn, TrackRecord};
use crate::zones::{ZoneTable, zone_table};

/// Counts over the images of one tree by one detector.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    pub(crate) images: u32,
    pub(crate) detections: u32,
    pub(crate) true_positives: u32,
    pub(crate) false_positives: BTreeMap<SitsOn, u32>,
    /// Fruit that should be found, and of these found, summed over images.
    pub(crate) expected: Found,
    /// Fruit with a visible pixel, and of these found, summed over images.
    pub(crate) visible: Found,
    /// Fruit in range with a visible pixel, and of these found, by bins of the visible fraction.
    pub(crate) bins: Vec<Found>,
    pub(crate) zones: ZoneTable<ZoneTally>,
    /// Centre errors of true positives \[m\].
    pub(crate) centre_errors: Vec<f64>,
    /// Radius errors of true positives \[m\].
    pub(crate) radius_errors: Vec<f64>,
    /// Detected and true radius of true positives \[m\].
    pub(crate) radii: Vec<[f64; 2]>,
    /// Fruit of the tree that should be found in some image, and of these found in some image.
    pub(crate) survey: Found,
    /// All fruit of the tree, and of these found in some image.
    pub(crate) survey_all: Found,
    /// Confirmed tracks, and of these matched to a fruit.
    pub(crate) tracks: Found,
    /// Fruit of the tree that should be found in some image, and of these matched to a confirmed track.
    pub(crate) tracked: Found,
}

/// Number found, out of a total.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Found {
    pub(crate) of: u32,
    pub(crate) found: u32,
}

impl Found {
    fn count(&mut self, found: bool) {
        self.of += 1;
        self.found += u32::from(found);
    }

    pub(crate) fn add(&mut self, other: Found) {
        self.of += other.of;
        self.found += other.found;
    }
}

/// Counts of a zone: detections by their own zone, fruit by the fruit's zone.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct ZoneTally {
    /// Detections, and of these true positives.
    pub(crate) detections: Found,
    /// Fruit that should be found, and of these found.
    pub(crate) expected: Found,
}

impl Tally {
    /// Counts images: the fruit that each shows and the detections in it. `bins` is the number of bins.
    pub(crate) fn of<'a>(
        tree: &DetectRecord,
        images: impl Iterator<Item = (&'a [FruitSeen], &'a [DetectionRecord])>,
        tracks: &[TrackRecord],
        bins: u32,
    ) -> Self {
        let mut tally = Self::nothing(bins);
        let (mut expected, mut found) = (BTreeSet::new(), BTreeSet::new());
        for (fruit, detections) in images {
            tally.images += 1;
            detections.iter().for_each(|d| tally.detection(d));
            let matched: BTreeSet<u32> = detections.iter().filter_map(|d| d.fruit).collect();
            for seen in fruit {
                tally.fruit(tree, seen, matched.contains(&seen.fruit));
            }
            expected.extend(fruit.iter().filter(|f| f.expected).map(|f| f.fruit));
            found.extend(matched);
        }
        let tracked: BTreeSet<u32> = tracks.iter().filter(|t| t.confirmed).filter_map(|t| t.fruit).collect();
        for fruit in &expected {
            tally.survey.count(found.contains(fruit));
            tally.tracked.count(tracked.contains(fruit));
        }
        tree.fruit.iter().for_each(|f| tally.survey_all.count(found.contains(&f.id)));
        tracks.iter().filter(|t| t.confirmed).for_each(|t| tally.tracks.count(t.fruit.is_some()));
        tally
    }

    /// Nothing counted.
    pub(crate) fn nothing(bins: u32) -> Self {
        Self {
            images: 0,
            detections: 0,
            true_positives: 0,
            false_positives: BTreeMap::new(),
            expected: Found::default(),
            visible: Found::default(),
            bins: vec![Found::default(); bins as usize],
            zones: zone_table(ZoneTally::default()),
            centre_errors: Vec::new(),
            radius_errors: Vec::new(),
            radii: Vec::new(),
            survey: Found::default(),
            survey_all: Found::default(),
            tracks: Found::default(),
            tracked: Found::default(),
        }
    }

    fn detection(&mut self, d: &DetectionRecord) {
        let right = d.fruit.is_some();
        self.detections += 1;
        self.true_positives += u32::from(right);
        if !right {
            *self.false_positives.entry(d.on).or_default() += 1;
        }
        self.centre_errors.extend(d.centre_error);
        self.radius_errors.extend(d.radius_error);
        self.radii.extend(d.radius_error.map(|error| [d.radius, d.radius - error]));
        if let Some(zone) = d.zone {
            self.zones.entry(zone).or_default().detections.count(right);
        }
    }

    fn fruit(&mut self, tree: &DetectRecord, seen: &FruitSeen, found: bool) {
        self.visible.count(found);
        if seen.in_range {
            let bin = seen.fraction_bin(self.bins.len() as u32);
            self.bins[bin as usize].count(found);
        }
        if seen.expected {
            self.expected.count(found);
            let zone = tree.fruit.get(seen.fruit as usize).and_then(|fruit| fruit.zone);
            if let Some(zone) = zone {
                self.zones.entry(zone).or_default().expected.count(found);
            }
        }
    }

    /// False positives on one thing.
    pub(crate) fn false_positives_on(&self, on: SitsOn) -> u32 {
        self.false_positives.get(&on).copied().unwrap_or(0)
    }
}
