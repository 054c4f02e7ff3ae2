//! Loads of the robot on the wood: impulses and forces of its contacts, and moment ratios of the joints.
//!
//! With f the force of a contact point between robot and live wood, normal and friction together, over a substep h, and
//! r_j = |M_j| / M_max,j the ratio of a joint's bending moment, |M| = Kp |theta|, to its rupture moment:
//!
//! - contact impulse `J = sum over substeps of h sum |f|` [N s];
//! - peak contact force `max over substeps of sum |f|` \[N\];
//! - peak moment ratio `max over frames and joints of r_j`, the start's included;
//! - excess `e(t) = max over joints of max(0, r_j(t) - r_j(0))`, and its integral `sum over frames of e dt` \[s\].
//!
//! The moment is that of the rupture test ([`orchard_treephys::Rupture`]), once a frame. The root's joint, which
//! cannot break, and broken sub-trees are left out: their load at the break stays in the peaks. The excess is taken
//! joint by joint, so that a load on a branch that gravity spares counts although another joint bears more. Wood that swings
//! freely or was relieved of its fruit has an excess too where it bends further than at rest.

use crate::touch::Part;
use orchard_multibody::{Data, Model, StepReport};
use orchard_treephys::{Rupture, TreeBody};
use serde::{Deserialize, Serialize};

/// Loads on the wood since the start of the episode.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct WoodLoad {
    /// Impulse of all contacts of the robot with live wood [N s].
    pub contact_impulse: f64,
    /// Impulse of the latest frame [N s].
    pub frame_impulse: f64,
    /// Largest sum of the contact forces of a substep \[N\].
    pub peak_contact_force: f64,
    /// Largest bending moment over rupture moment of any joint.
    pub peak_ratio: f64,
    /// Segment at whose base it was; `None` where no joint bore anything.
    pub peak_segment: Option<usize>,
    /// Largest excess of the ratio over its value at the start, now.
    pub excess: f64,
    /// Largest excess so far.
    pub peak_excess: f64,
    /// Integral of the excess over time \[s\].
    pub excess_integral: f64,
}

impl WoodLoad {
    /// The loads at the start of an episode.
    pub(crate) fn at_start(tree: &TreeBody, model: &Model, data: &Data) -> Self {
        let mut load = Self::default();
        for segment in joints(tree) {
            load.keep_peak(segment, moment_ratio(tree, model, data, segment));
        }
        load
    }

    pub(crate) fn begin_frame(&mut self) {
        self.frame_impulse = 0.0;
    }

    /// Adds the contacts of a substep of length `h` \[s\].
    pub(crate) fn add_substep(&mut self, parts: &[Part], report: &StepReport, h: f64) {
        let mut force = 0.0;
        for contact in &report.contacts {
            let pair = (parts[contact.a.index()], parts[contact.b.index()]);
            if matches!(pair, (Part::Wood, other) | (other, Part::Wood) if other.is_robot()) {
                force += contact.force_world.norm();
            }
        }
        self.frame_impulse += force * h;
        self.contact_impulse += force * h;
        self.peak_contact_force = self.peak_contact_force.max(force);
    }

    /// Adds the contacts of a frame: their impulse [N s], and the largest sum of the forces of a substep so far \[N\].
    pub(crate) fn add_frame(&mut self, impulse: f64, peak_force: f64) {
        self.frame_impulse += impulse;
        self.contact_impulse += impulse;
        self.peak_contact_force = self.peak_contact_force.max(peak_force);
    }

    /// Adds the bending of a frame of length `frame` \[s\]; `start` is the state at the start of the episode.
    pub(crate) fn end_frame(
        &mut self,
        tree: &TreeBody,
        model: &Model,
        data: &Data,
        start: &Data,
        rupture: &Rupture,
        frame: f64,
    ) {
        self.excess = 0.0;
        for segment in joints(tree).filter(|&segment| !rupture.is_debris(segment)) {
            let ratio = moment_ratio(tree, model, data, segment);
            self.keep_peak(segment, ratio);
            // Most joints bear less than the largest excess so far; their start value is not needed.
            if ratio > self.excess {
                let excess = ratio - moment_ratio(tree, model, start, segment);
                self.excess = self.excess.max(excess);
            }
        }
        self.end_excess(frame);
    }

    /// Adds the bending of a frame of length `frame` \[s\] in which no joint bore more than the largest ratio so far, from the excess at its end.
    pub(crate) fn end_calm_frame(&mut self, excess: f64, frame: f64) {
        self.excess = excess;
        self.end_excess(frame);
    }

    fn end_excess(&mut self, frame: f64) {
        self.peak_excess = self.peak_excess.max(self.excess);
        self.excess_integral += self.excess * frame;
    }

    fn keep_peak(&mut self, segment: usize, ratio: f64) {
        if ratio > self.peak_ratio {
            self.peak_ratio = ratio;
            self.peak_segment = Some(segment);
        }
    }

    /// True if its segment is below the number of segments.
    pub(crate) fn fits(&self, segments: usize) -> bool {
        self.peak_segment.is_none_or(|segment| segment < segments)
    }
}

/// Segments whose base joint can break.
fn joints(tree: &TreeBody) -> impl Iterator<Item = usize> {
    (0..tree.len()).filter(|&segment| tree.parent[segment].is_some())
}

/// |M| / M_max of the joint at a segment's base.
fn moment_ratio(tree: &TreeBody, model: &Model, data: &Data, segment: usize) -> f64 {
    tree.stiffness[segment] * tree.bending_angle(model, data, segment) / tree.rupture_moment[segment]
}

#[cfg(test)]
#[path = "load_tests.rs"]
mod tests;
