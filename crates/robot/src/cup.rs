//! Suction cup: seal of its lip on a ball, vacuum behind it, and force.
//!
//! Points on the circle of the lip are small balls of the last arm link: contact and friction act there as everywhere. The seal follows from
//! the gaps between these points and the ball, the vacuum from the seal, and the force from the vacuum. Equations:
//! `docs/computation/suction.md`.

use crate::config::CupConfig;
use orchard_geometry::{Pose, Vec3, math};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// A suction cup on the last arm link.
#[derive(Debug, Clone, PartialEq)]
pub struct Cup {
    /// Centre of the lip in the frame of the last arm link; z is the cup's axis, away from the arm.
    pub x_wrist_lip: Pose,
    /// Points of the lip in the lip's frame \[m\].
    pub lip_p_lip: Vec<Vec3>,
    /// Radius of the circle on which the lip seals \[m\].
    pub lip_radius: f64,
    /// Half the thickness of the lip \[m\].
    pub half_thickness: f64,
    /// Distance that the lip bends to stay on a fruit \[m\].
    pub follow: f64,
    /// Radius below which a fruit folds the lip \[m\].
    pub curve_radius_min: f64,
    /// Gap that a leaf under the lip leaves \[m\].
    pub leaf_gap: f64,
    /// Vacuum of the pump with the cup closed \[Pa\].
    pub vacuum_max: f64,
    /// Open area at which half of it is left [m^2].
    pub leak_half: f64,
    /// Time in which the vacuum of a closed cup builds up \[s\].
    pub rise_time: f64,
    grip_vacuum: f64,
}

/// Vacuum of a suction cup, and the fruit on which its lip lies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Suction {
    /// Vacuum below the pressure of the air \[Pa\].
    pub vacuum: f64,
    /// Fruit on which the lip lies.
    pub fruit: Option<usize>,
    /// Points of the lip that are closed on that fruit, a bit each, of the first 64: nothing gets under them.
    pub closed: u64,
}

/// Points of a lip that something other than its fruit keeps open: one bit for each of the first 64 points.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct UnderLip {
    /// Points over a leaf.
    pub leaves: u64,
    /// Points on which wood, another fruit or anything else presses.
    pub pressed: u64,
}

impl UnderLip {
    /// The same without some points, given by their bits.
    #[must_use]
    pub fn without(self, points: u64) -> Self {
        Self { leaves: self.leaves & !points, pressed: self.pressed & !points }
    }
}

/// Seal between a lip and a ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seal {
    /// Open area around the lip [m^2].
    pub leak: f64,
    /// Share of the lip that lies on the ball.
    pub closed: f64,
}

impl Cup {
    pub(crate) fn new(config: &CupConfig, x_wrist_lip: Pose) -> Self {
        let (radius, count) = (config.lip_radius.si(), config.lip_points.get());
        let at = |k: u32| {
            let (sin, cos) = math::sin_cos(TAU * f64::from(k) / f64::from(count));
            Vec3::new(radius * cos, radius * sin, 0.0)
        };
        Self {
            x_wrist_lip,
            lip_p_lip: (0..count).map(at).collect(),
            lip_radius: radius,
            half_thickness: config.lip_half_thickness.si(),
            follow: config.follow.si(),
            curve_radius_min: config.curve_radius_min.si(),
            leaf_gap: config.leaf_gap.si(),
            vacuum_max: config.vacuum_max.si(),
            leak_half: config.leak_half.si(),
            rise_time: config.rise_time.si(),
            grip_vacuum: config.grip_vacuum.si(),
        }
    }

    /// Area that the lip encloses [m^2].
    pub fn area(&self) -> f64 {
        PI * self.lip_radius * self.lip_radius
    }

    /// Length of the lip between two of its points \[m\].
    pub fn spacing(&self) -> f64 {
        TAU * self.lip_radius / self.lip_p_lip.len() as f64
    }

    /// Bit of a point of the lip; 0 beyond the 64th.
    pub fn bit(point: usize) -> u64 {
        u32::try_from(point).ok().and_then(|point| 1_u64.checked_shl(point)).unwrap_or(0)
    }

    /// Gap at a point of the lip \[m\]: the lip's thickness where something presses, `leaf_gap` over a leaf, 0 elsewhere.
    pub fn gap_over(&self, under: &UnderLip, point: usize) -> f64 {
        let gap = |points: u64, gap: f64| if points & Self::bit(point) == 0 { 0.0 } else { gap };
        gap(under.pressed, 2.0 * self.half_thickness).max(gap(under.leaves, self.leaf_gap))
    }

    /// Seal of a cup that touches nothing.
    pub fn open(&self) -> Seal {
        Seal { leak: self.area(), closed: 0.0 }
    }

    /// Gaps between the points of the lip and a ball \[m\], negative where they overlap. The ball's centre is in the lip's frame.
    pub fn gaps(&self, p_lip: &Vec3, radius: f64) -> impl Iterator<Item = f64> + use<'_> {
        let (p, reach) = (*p_lip, radius + self.half_thickness);
        self.lip_p_lip.iter().map(move |lip| (p - lip).norm() - reach)
    }

    /// True if the lip lies on a ball whose centre is given in the lip's frame \[m\]: it touches it, or it did before (`lay`) and still follows
    /// it somewhere. The cup is open on one side only.
    pub fn lies_on(&self, p_lip: &Vec3, radius: f64, lay: bool) -> bool {
        let within = if lay { self.follow } else { 0.0 };
        p_lip.z > 0.0 && self.gaps(p_lip, radius).any(|gap| gap <= within)
    }

    /// Openings of the lip at its points \[m\], 0 where it is closed, on a ball that it lies on; the ball's centre is given in the lip's frame
    /// \[m\]. `under` gives the gap \[m\] that something under each point leaves.
    pub fn openings(
        &self,
        p_lip: &Vec3,
        radius: f64,
        under: impl Fn(usize) -> f64,
    ) -> impl Iterator<Item = f64> {
        // Height of the ball's cap within the lip, beyond that to which the lip bends without folds.
        let height = |radius: f64| 0.5 * self.lip_radius * self.lip_radius / radius;
        let folds = (height(radius) - height(self.curve_radius_min)).max(0.0);
        let gaps = self.gaps(p_lip, radius).enumerate();
        gaps.map(move |(i, gap)| (gap - self.follow).max(0.0) + folds + under(i))
    }

    /// Seal of a lip with these openings at its points \[m\].
    pub fn seal(&self, openings: impl Iterator<Item = f64>) -> Seal {
        let (mut open, mut closed) = (0.0, 0_u32);
        for opening in openings {
            open += opening;
            closed += u32::from(opening == 0.0);
        }
        let leak = (open * self.spacing()).min(self.area());
        Seal { leak, closed: f64::from(closed) / self.lip_p_lip.len() as f64 }
    }

    /// Vacuum after a time `h` \[s\] from `vacuum` \[Pa\]. `valve` is the commanded opening; one that is not finite vents the cup.
    pub fn vacuum_after(&self, vacuum: f64, valve: f64, seal: &Seal, h: f64) -> f64 {
        let valve = if valve.is_finite() { valve.clamp(0.0, 1.0) } else { 0.0 };
        let share = 1.0 / (1.0 + seal.leak / self.leak_half);
        let reached = valve * self.vacuum_max * share;
        reached + (vacuum - reached) * math::exp(-h / (self.rise_time * share))
    }

    /// Force between cup and ball along the cup's axis at a vacuum \[Pa\] \[N\].
    pub fn force(&self, vacuum: f64, seal: &Seal) -> f64 {
        vacuum * self.area() * seal.closed
    }

    /// True if a vacuum \[Pa\] counts as sealed.
    pub fn is_sealed(&self, vacuum: f64) -> bool {
        vacuum >= self.grip_vacuum
    }
}

#[cfg(test)]
#[path = "cup_tests.rs"]
mod tests;
