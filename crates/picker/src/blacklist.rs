//! Blacklist: positions of failed attempts, which are not tried again for a while.

use crate::config::BlacklistConfig;
use crate::record::FailureReason;
use orchard_geometry::Vec3;

#[derive(Debug, Clone, PartialEq)]
struct Entry {
    p_odom: Vec3,
    until: f64,
}

/// Positions of failed targets.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Blacklist {
    config: BlacklistConfig,
    entries: Vec<Entry>,
}

impl Blacklist {
    pub fn new(config: &BlacklistConfig) -> Self {
        Self { config: config.clone(), entries: Vec::new() }
    }

    /// Adds a position; a failure that would repeat stays longer on the list.
    pub fn add(&mut self, p_odom: Vec3, reason: FailureReason, time: f64) {
        use FailureReason as R;
        let duration = match reason {
            R::NoFruitAtDetection | R::StemTooStrong | R::Slipped | R::KnockedOffByArm | R::MissedBucket => {
                &self.config.long
            }
            R::Unreachable
            | R::ReachStalled
            | R::GraspUnreachable
            | R::GraspStalled
            | R::Blocked
            | R::AlignTimeout
            | R::RunEnded
            | R::NoSight
            | R::HandStuck
            | R::ArmLoaded => &self.config.short,
        };
        self.entries.retain(|e| e.until > time);
        self.entries.push(Entry { p_odom, until: time + duration.si() });
    }

    /// True if a position is on the list at a time \[s\].
    pub fn contains(&self, p_odom: &Vec3, time: f64) -> bool {
        let radius = self.config.radius.si();
        self.entries.iter().any(|e| e.until > time && (e.p_odom - p_odom).norm() <= radius)
    }
}
