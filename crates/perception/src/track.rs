//! Tracker: merges detections of several images into tracks of fruit.

use crate::DetectorConfig;
use orchard_geometry::Vec3;

/// A detection in a fixed frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Centre in the fixed (odom) frame \[m\].
    pub p_odom: Vec3,
    /// Radius \[m\].
    pub radius: f64,
    /// Probability that it is a fruit; 1 from a detector that tells none.
    pub score: f64,
}

/// A fruit that has been seen in one or more images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    /// Number of the track; it never changes and is never used again.
    pub id: u32,
    /// Centre in the fixed (odom) frame, averaged over the sightings \[m\].
    pub p_odom: Vec3,
    /// Radius, averaged over the sightings \[m\].
    pub radius: f64,
    /// Score, averaged over the sightings.
    pub score: f64,
    /// Number of images that showed the fruit.
    pub hits: u32,
    /// Time of the last sighting \[s\].
    pub last_seen: f64,
    /// True once the track has enough hits to act on.
    pub confirmed: bool,
}

/// Merges sightings over images into tracks.
#[derive(Debug, Clone)]
pub struct Tracker {
    config: TrackerLimits,
    tracks: Vec<Track>,
    next_id: u32,
}

/// The tracker's config in SI units.
#[derive(Debug, Clone, Copy)]
struct TrackerLimits {
    merge_distance: f64,
    hits: u32,
    memory: u32,
    tentative_life: f64,
    confirmed_life: f64,
}

impl Tracker {
    /// Makes a tracker without tracks.
    pub fn new(config: &DetectorConfig) -> Self {
        let c = &config.tracking;
        let config = TrackerLimits {
            merge_distance: c.merge_distance.si(),
            hits: c.hits.get(),
            memory: c.memory.get(),
            tentative_life: c.tentative_life.si(),
            confirmed_life: c.confirmed_life.si(),
        };
        Self { config, tracks: Vec::new(), next_id: 0 }
    }

    /// Adds the sightings of one image, taken at `time` \[s\]. Sightings are matched to tracks one to one, nearest pairs first. Sightings
    /// that are not finite are ignored.
    pub fn update(&mut self, time: f64, sightings: &[Sighting]) {
        let is_finite = |s: &Sighting| s.p_odom.iter().all(|x| x.is_finite()) && s.radius.is_finite();
        let sightings: Vec<Sighting> = sightings.iter().copied().filter(is_finite).collect();
        let mut pairs = Vec::new();
        for (t, track) in self.tracks.iter().enumerate() {
            for (s, sighting) in sightings.iter().enumerate() {
                let distance = (track.p_odom - sighting.p_odom).norm();
                if distance <= self.config.merge_distance {
                    pairs.push((distance, t, s));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut track_taken = vec![false; self.tracks.len()];
        let mut sighting_taken = vec![false; sightings.len()];
        for (_, t, s) in pairs {
            if !track_taken[t] && !sighting_taken[s] {
                track_taken[t] = true;
                sighting_taken[s] = true;
                self.tracks[t].absorb(&sightings[s], time, &self.config);
            }
        }
        for (sighting, _) in sightings.iter().zip(&sighting_taken).filter(|(_, taken)| !**taken) {
            self.tracks.push(Track {
                id: self.next_id,
                p_odom: sighting.p_odom,
                radius: sighting.radius,
                score: sighting.score,
                hits: 1,
                last_seen: time,
                confirmed: self.config.hits <= 1,
            });
            self.next_id = self.next_id.wrapping_add(1);
        }
        let limits = self.config;
        self.tracks.retain(|t| {
            let life = if t.confirmed { limits.confirmed_life } else { limits.tentative_life };
            time - t.last_seen <= life
        });
    }

    /// Returns all tracks, oldest first.
    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// Returns the tracks with enough hits to act on, oldest first.
    pub fn confirmed(&self) -> impl Iterator<Item = &Track> {
        self.tracks.iter().filter(|t| t.confirmed)
    }

    /// Drops one track, as when its fruit has been picked or is gone.
    pub fn forget(&mut self, id: u32) {
        self.tracks.retain(|t| t.id != id);
    }
}

impl Track {
    /// Updates the running mean: a plain mean over the first `memory` hits, then an exponential mean of weight 1 / `memory`.
    fn absorb(&mut self, sighting: &Sighting, time: f64, limits: &TrackerLimits) {
        self.hits = self.hits.saturating_add(1);
        let weight = 1.0 / f64::from(self.hits.min(limits.memory.max(1)));
        self.p_odom += (sighting.p_odom - self.p_odom) * weight;
        self.radius += (sighting.radius - self.radius) * weight;
        self.score += (sighting.score - self.score) * weight;
        self.last_seen = time;
        self.confirmed |= self.hits >= limits.hits;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sighting(x: f64) -> Sighting {
        Sighting { p_odom: Vec3::new(x, 0.0, 1.0), radius: 0.03, score: 1.0 }
    }

    #[test]
    fn three_hits_confirm_and_the_position_is_their_mean() {
        let mut tracker = Tracker::new(&DetectorConfig::paper());
        for (i, x) in [0.50, 0.53, 0.47].into_iter().enumerate() {
            assert_eq!(tracker.confirmed().count(), 0);
            tracker.update(0.2 * i as f64, &[sighting(x)]);
        }
        let tracks: Vec<_> = tracker.confirmed().collect();
        assert_eq!((tracks.len(), tracks[0].hits, tracks[0].id), (1, 3, 0));
        assert!((tracks[0].p_odom.x - 0.5).abs() < 1e-15);
    }

    #[test]
    fn neighbours_closer_than_the_merge_distance_stay_apart() {
        let mut tracker = Tracker::new(&DetectorConfig::paper());
        for _ in 0..3 {
            tracker.update(0.0, &[sighting(0.0), sighting(0.06)]);
        }
        let xs: Vec<f64> = tracker.confirmed().map(|t| t.p_odom.x).collect();
        assert_eq!(xs, [0.0, 0.06]);
    }

    #[test]
    fn tracks_that_are_not_seen_again_fade() {
        let config = DetectorConfig::paper();
        let mut tracker = Tracker::new(&config);
        for _ in 0..3 {
            tracker.update(0.0, &[sighting(0.0)]);
        }
        tracker.update(1.0, &[sighting(1.0)]);
        assert_eq!(tracker.tracks().len(), 2);
        tracker.update(1.0 + config.tracking.tentative_life.si() + 1e-9, &[]);
        assert_eq!(tracker.tracks().iter().map(|t| t.id).collect::<Vec<_>>(), [0]);
        tracker.update(config.tracking.confirmed_life.si() + 1e-9, &[]);
        assert!(tracker.tracks().is_empty());
        tracker.update(50.0, &[sighting(0.0)]);
        assert_eq!(tracker.tracks()[0].id, 2, "numbers are never used again");
        tracker.forget(2);
        assert!(tracker.tracks().is_empty());
    }

    #[test]
    fn fruit_that_sways_past_another_keeps_its_number() {
        let mut tracker = Tracker::new(&DetectorConfig::paper());
        // Two fruit 80 mm apart, nearer than the merge distance, swinging 15 mm against each other.
        for i in 0..20 {
            let swing = if i % 2 == 0 { 0.0 } else { 0.015 };
            tracker.update(0.2 * f64::from(i), &[sighting(0.08 - swing), sighting(swing)]);
        }
        let tracks: Vec<(u32, u32)> = tracker.tracks().iter().map(|t| (t.id, t.hits)).collect();
        assert_eq!(tracks, [(0, 20), (1, 20)]);
        let x = |i: usize| tracker.tracks()[i].p_odom.x;
        assert!((x(0) - 0.0725).abs() < 1e-3 && (x(1) - 0.0075).abs() < 1e-3);
    }

    #[test]
    fn missed_images_delay_but_do_not_forget() {
        let mut tracker = Tracker::new(&DetectorConfig::paper());
        for (time, seen) in [(0.0, true), (0.2, false), (0.4, true), (0.6, false), (0.8, true)] {
            assert_eq!(tracker.confirmed().count(), 0);
            let sightings = [sighting(0.0)];
            tracker.update(time, if seen { &sightings } else { &[] });
        }
        assert_eq!(tracker.confirmed().count(), 1);
    }

    #[test]
    fn a_second_sighting_of_one_fruit_in_an_image_counts_no_hit() {
        let mut tracker = Tracker::new(&DetectorConfig::paper());
        tracker.update(0.0, &[sighting(0.0)]);
        tracker.update(0.2, &[sighting(0.001), sighting(0.002)]);
        let hits: Vec<u32> = tracker.tracks().iter().map(|t| t.hits).collect();
        assert_eq!(hits, [2, 1]);
        // The second sighting is a track of its own, which is dropped if nothing confirms it.
        for i in 0..20 {
            tracker.update(0.4 + 0.2 * f64::from(i), &[sighting(0.0)]);
        }
        assert_eq!(tracker.tracks().iter().map(|t| t.id).collect::<Vec<_>>(), [0]);
    }

    #[test]
    fn a_sighting_that_is_not_finite_is_ignored() {
        let mut tracker = Tracker::new(&DetectorConfig::paper());
        for x in [f64::NAN, f64::INFINITY] {
            tracker.update(0.0, &[sighting(x), Sighting { p_odom: Vec3::zeros(), radius: x, score: 1.0 }]);
        }
        assert!(tracker.tracks().is_empty());
        tracker.update(0.0, &[sighting(f64::NAN), sighting(0.0)]);
        assert_eq!(tracker.tracks().len(), 1);
    }
}
