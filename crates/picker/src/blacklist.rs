//! Blacklist: positions of failed attempts, which are not tried again for a while, and directions from which something stopped the hand there, which are tried last.

use crate::record::FailureReason;
use crate::section::section;
use orchard_geometry::{Pose, Vec3};
use orchard_quantity::Quantity;

section! {
    /// Blacklist of failed targets.
    BlacklistConfig {
        /// Duration after failures that may not repeat.
        short: Quantity,
        /// Duration after failures that would repeat.
        long: Quantity,
        /// Distance from a failed target within which detections count as the same fruit.
        radius: Quantity,
        /// Cost of an approach for each time that something stopped the hand on nearly the same one.
        refused_cost: Quantity,
        /// Angle within which two approaches are nearly the same.
        refused_angle: Quantity,
    }
}

#[derive(Debug, Clone, PartialEq)]
struct Entry {
    p_odom: Vec3,
    /// Distance within which a position counts as the same fruit \[m\].
    radius: f64,
    until: f64,
    /// True of a fruit that others hem in: those are tried, and it is remembered for good.
    hemmed_in: bool,
}

impl Entry {
    fn is_at(&self, p_odom: &Vec3) -> bool {
        (self.p_odom - p_odom).norm() <= self.radius
    }
}

/// An approach on which something stopped the hand: the target's position and the direction, odom.
#[derive(Debug, Clone, PartialEq)]
struct Refused {
    p_odom: Vec3,
    direction: Vec3,
}

/// Positions of failed targets.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Blacklist {
    config: BlacklistConfig,
    entries: Vec<Entry>,
    refused: Vec<Refused>,
}

impl Blacklist {
    pub fn new(config: &BlacklistConfig) -> Self {
        Self { config: config.clone(), entries: Vec::new(), refused: Vec::new() }
    }

    /// Adds a target by its centre (odom) and radius \[m\]; a failure that would repeat stays longer on the list.
    pub fn add(&mut self, p_odom: Vec3, radius: f64, reason: FailureReason, time: f64) {
        use FailureReason as R;
        let duration = match reason {
            R::NoFruitAtDetection
            | R::StemTooStrong
            | R::Slipped
            | R::KnockedOffByArm
            | R::MissedBucket
            | R::HemmedIn => &self.config.long,
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
        let hemmed_in = reason == R::HemmedIn;
        let radius = if hemmed_in { radius } else { self.config.radius.si() };
        self.entries.retain(|e| e.until > time || e.hemmed_in);
        self.entries.push(Entry { p_odom, radius, until: time + duration.si(), hemmed_in });
    }

    /// Adds an approach to a target along a direction, both odom, on which something stopped the hand.
    pub fn refuse(&mut self, p_odom: Vec3, direction: Vec3) {
        self.refused.push(Refused { p_odom, direction });
    }

    /// Directions from which something stopped the hand at a position (odom), in the frame of a base there.
    pub fn refused(&self, p_odom: &Vec3, x_odom_base: &Pose) -> Vec<Vec3> {
        let at = self.refused.iter().filter(|r| (r.p_odom - p_odom).norm() <= self.config.radius.si());
        at.map(|r| x_odom_base.rotation.inverse() * r.direction).collect()
    }

    /// Forgets the fruit that were hemmed in within a distance \[m\] of a fruit that is gone, and what stopped the hand there.
    pub fn free_around(&mut self, p_odom: &Vec3, distance: f64) {
        self.refused.retain(|r| (r.p_odom - p_odom).norm() > distance);
        self.entries.retain(|e| !e.hemmed_in || (e.p_odom - p_odom).norm() > distance);
    }

    /// True if a position is on the list at a time \[s\].
    pub fn contains(&self, p_odom: &Vec3, time: f64) -> bool {
        self.entries.iter().any(|e| e.until > time && e.is_at(p_odom))
    }

    /// True of a fruit that is still hemmed in, though the others had their turn.
    pub fn has_waited(&self, p_odom: &Vec3, time: f64) -> bool {
        self.entries.iter().any(|e| e.hemmed_in && e.until <= time && e.is_at(p_odom))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expert::ExpertConfig;
    use orchard_geometry::Rotation;
    use std::f64::consts::FRAC_PI_2;

    /// A fruit that others hem in waits while its neighbours do not; it is free once a neighbour is picked, and has waited once its time is over.
    #[test]
    fn a_fruit_that_is_hemmed_in_waits_for_its_neighbours() {
        let config = ExpertConfig::preset().shared.blacklist;
        let (p_inner, radius) = (Vec3::new(1.0, 0.0, 1.0), 0.03);
        let p_neighbour = p_inner + Vec3::y() * 0.065;
        let mut list = Blacklist::new(&config);
        list.add(p_inner, radius, FailureReason::HemmedIn, 10.0);
        assert!(list.contains(&p_inner, 11.0) && !list.contains(&p_neighbour, 11.0));
        assert!(!list.has_waited(&p_inner, 11.0));
        let late = 10.0 + config.long.si();
        assert!(!list.contains(&p_inner, late) && list.has_waited(&p_inner, late));
        list.free_around(&p_neighbour, 0.06);
        assert!(list.contains(&p_inner, 11.0), "too far away");
        list.free_around(&p_neighbour, 0.07);
        assert!(!list.contains(&p_inner, 11.0) && !list.has_waited(&p_inner, late));
        // Any other failure holds for the fruit beside it too.
        list.add(p_inner, radius, FailureReason::Slipped, 10.0);
        assert!(list.contains(&p_neighbour, 11.0) && !list.has_waited(&p_neighbour, late));
    }

    /// A refused direction is turned into the frame of the base that asks for it, and is forgotten once a fruit beside it is gone.
    #[test]
    fn a_refused_direction_is_told_in_the_frame_of_the_base() {
        let mut list = Blacklist::new(&ExpertConfig::preset().shared.blacklist);
        let p_odom = Vec3::new(1.0, 0.5, 1.0);
        list.refuse(p_odom, Vec3::x());
        let turned = Rotation::from_axis_angle(&Vec3::z_axis(), FRAC_PI_2);
        let x_odom_base = Pose::from_parts(Vec3::new(3.0, 0.0, 0.0).into(), turned);
        let told = list.refused(&(p_odom + Vec3::y() * 0.05), &x_odom_base);
        assert!(told.len() == 1 && (told[0] + Vec3::y()).norm() < 1e-12, "{told:?}");
        assert!(list.refused(&(p_odom + Vec3::y() * 0.1), &x_odom_base).is_empty());
        list.free_around(&(p_odom + Vec3::z() * 0.06), 0.07);
        assert!(list.refused(&p_odom, &x_odom_base).is_empty());
    }
}
