//! Propagation of unit impulses at contacts through the articulated-body factor, path by path.
//!
//! With `A^-1 = L^-T D^-1 L^-1` and `D^-1 = C C^T`, an impulse at a contact only passes through the joints
//! between its links and the world: its column of `Y = C^T L^-1 J^T` is as sparse as that path. Then
//! `J A^-1 J^T = Y^T Y`: in the coordinates `e = C^-1 L^T du` of a velocity change, A is the identity. The part
//! that all paths of a tree share is reduced to six coordinates ([`super::shared`]).

mod propagated;
mod shared;

use std::ops::Range;

use orchard_geometry::{Mat3, Vec3};

use super::block::{Block, Load, Turns};
use super::root::lower_root;
use super::shared::SharedPathFinder;
use crate::aba::factors::Factor;
use crate::kinematics::Kinematics;
use crate::model::{JointKind, Model};
use crate::spatial::Wrench;
use propagated::Propagated;
use shared::SharedPath;

/// A joint, point body, spin or shared path on a path.
#[derive(Debug, Clone)]
struct Node {
    /// Link (of a shared path: its upper end), or number of links + point body, or number of both + spin.
    key: usize,
    width: usize,
}

/// A piece of a path whose coordinates follow each other.
#[derive(Debug, Clone)]
struct Run {
    /// Coordinates of the piece; paths that share a joint share them.
    coordinates: Range<usize>,
    /// First entry of the piece in `y`.
    start: usize,
}

/// Y of all blocks.
#[derive(Debug, Clone, Default)]
pub(super) struct Paths {
    finder: SharedPathFinder,
    shared: Vec<SharedPath>,
    /// Nodes of each block.
    blocks: Vec<Range<usize>>,
    nodes: Vec<Node>,
    /// For each coordinate on a path, the values of the block's three rows.
    y: Vec<Vec3>,
    /// Degrees of freedom of each node that some path passes, 0 of the others.
    widths: Vec<usize>,
    /// C of these joints, lower triangles row after row, placed as the factor's `d_inverse`.
    roots: Vec<f64>,
    /// First coordinate of each of these nodes.
    first_coordinate: Vec<usize>,
    dimension: usize,
    runs: Vec<Run>,
    /// Runs of each block.
    block_runs: Vec<Range<usize>>,
}

impl Paths {
    /// Follows the paths of all blocks.
    pub fn assemble(&mut self, model: &Model, kinematics: &Kinematics, factor: &Factor, blocks: &[Block]) {
        self.clear(model, factor);
        let mut finder = std::mem::take(&mut self.finder);
        for link in finder.find(model, factor, blocks) {
            self.add_shared(model, kinematics, factor, link);
        }
        self.finder = finder;
        for block in blocks {
            self.push(model, kinematics, factor, &block.loads);
        }
        self.finish();
    }

    /// Forgets all blocks.
    fn clear(&mut self, model: &Model, factor: &Factor) {
        self.shared.clear();
        self.blocks.clear();
        self.nodes.clear();
        self.y.clear();
        self.widths.clear();
        self.widths.resize(model.bodies.len() + 2 * model.points.len(), 0);
        self.roots.resize(factor.d_inverse.len(), 0.0);
    }

    /// Numbers the coordinates once all blocks are there, leaves first: what follows each other on a path then
    /// mostly does so in memory.
    fn finish(&mut self) {
        self.dimension = 0;
        self.first_coordinate.resize(self.widths.len(), 0);
        for (first, width) in self.first_coordinate.iter_mut().zip(&self.widths).rev() {
            *first = self.dimension;
            self.dimension += width;
        }
        self.runs.clear();
        self.block_runs.clear();
        let mut entry = 0;
        for block in &self.blocks {
            let first_run = self.runs.len();
            for node in &self.nodes[block.clone()] {
                let start = self.first_coordinate[node.key];
                match self.runs[first_run..].last_mut() {
                    Some(run) if run.coordinates.end == start => run.coordinates.end += node.width,
                    _ => self.runs.push(Run { coordinates: start..start + node.width, start: entry }),
                }
                entry += node.width;
            }
            self.block_runs.push(first_run..self.runs.len());
        }
    }

    /// Number of coordinates that the paths pass.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Runs of a block: their coordinates and their parts of Y.
    fn runs(&self, block: usize) -> impl Iterator<Item = (&Range<usize>, &[Vec3])> {
        let runs = &self.runs[self.block_runs[block].clone()];
        runs.iter().map(|run| (&run.coordinates, &self.y[run.start..run.start + run.coordinates.len()]))
    }

    /// Velocity changes of a block's rows by a change of the coordinates: `Y^T e`.
    pub fn velocity(&self, block: usize, e: &[f64]) -> Vec3 {
        // Two sums, so that one addition need not wait for the other.
        let (mut even, mut odd) = (Vec3::zeros(), Vec3::zeros());
        for (coordinates, y) in self.runs(block) {
            let ((y, y_rest), (e, e_rest)) = (y.as_chunks(), e[coordinates.clone()].as_chunks());
            for ([y_even, y_odd], [e_even, e_odd]) in y.iter().zip(e) {
                even += y_even * *e_even;
                odd += y_odd * *e_odd;
            }
            for (y, e) in y_rest.iter().zip(e_rest) {
                even += y * *e;
            }
        }
        even + odd
    }

    /// Adds the change of the coordinates by impulses on a block's rows: `Y p`.
    pub fn add_impulse(&self, block: usize, p: &Vec3, e: &mut [f64]) {
        for (coordinates, y) in self.runs(block) {
            for (y, e) in y.iter().zip(&mut e[coordinates.clone()]) {
                *e += y.dot(p);
            }
        }
    }

    /// Block of `Y^T Y`: what impulses on block `column` change at block `row`, over the coordinates of both.
    pub fn inverse_inertia(&self, row: usize, column: usize) -> Mat3 {
        let mut sum = Mat3::zeros();
        for (r, y_r) in self.runs(row) {
            for (c, y_c) in self.runs(column) {
                let (start, end) = (r.start.max(c.start), r.end.min(c.end));
                if start < end {
                    let y_r = &y_r[start - r.start..end - r.start];
                    let y_c = &y_c[start - c.start..end - c.start];
                    for (a, b) in y_r.iter().zip(y_c) {
                        sum += a * b.transpose();
                    }
                }
            }
        }
        sum
    }

    /// Adds a block of three rows, with its load on each side.
    fn push(&mut self, model: &Model, kinematics: &Kinematics, factor: &Factor, loads: &[Load; 2]) {
        let first = self.nodes.len();
        let mut sides = [Propagated { body: None, wrenches: [Wrench::ZERO; 3] }; 2];
        for (side, load) in sides.iter_mut().zip(loads) {
            match load {
                Load::None => {}
                Load::Body { body, wrenches } => {
                    *side = Propagated { body: Some(*body), wrenches: *wrenches }
                }
                Load::Dof { body, .. } => side.body = Some(*body),
                Load::Point { point, impulses, r, turns } => {
                    if *turns == Turns::Ball {
                        self.pass_spin(model, *point, impulses, r);
                    }
                    *side = self.pass_point(model, factor, *point, impulses);
                    if let Turns::Link(link) = turns {
                        side.body = Some(*link);
                        for (wrench, impulse) in side.wrenches.iter_mut().zip(impulses.column_iter()) {
                            wrench.torque += r.cross(&impulse);
                        }
                    }
                }
            }
        }
        // Parents have smaller indices, so the larger of two links is never above the other.
        while let Some(body) = sides[0].body.max(sides[1].body) {
            let [one, other] = &mut sides;
            let side = if one.body == Some(body) {
                if other.body == Some(body) {
                    one.merge(other);
                }
                one
            } else {
                other
            };
            let wrenches = &mut side.wrenches;
            if let Some(shared) = self.shared.iter().position(|shared| shared.link == body) {
                self.pass_shared(shared, wrenches);
                side.body = None;
                continue;
            }
            match model.bodies[body].joint {
                JointKind::Weld => {}
                JointKind::Hinge(_) => {
                    self.pass_joint::<0, 1>(model, kinematics, factor, body, wrenches, loads)
                }
                JointKind::Slide(_) => {
                    self.pass_joint::<1, 1>(model, kinematics, factor, body, wrenches, loads)
                }
                JointKind::Universal => {
                    self.pass_joint::<0, 2>(model, kinematics, factor, body, wrenches, loads)
                }
                JointKind::Ball => self.pass_joint::<0, 3>(model, kinematics, factor, body, wrenches, loads),
                JointKind::Planar => {
                    self.pass_joint::<2, 3>(model, kinematics, factor, body, wrenches, loads)
                }
                JointKind::Free => self.pass_joint::<3, 6>(model, kinematics, factor, body, wrenches, loads),
            }
            let parent = model.bodies[body].parent;
            side.body = parent.map(|parent| parent.index());
            if parent.is_some() {
                let r = &kinematics.links[body].r_parent;
                for wrench in wrenches {
                    wrench.torque += r.cross(&wrench.force);
                }
            }
        }
        self.blocks.push(first..self.nodes.len());
    }

    /// Lets the present path pass a node; true if no path did before.
    fn touch(&mut self, key: usize, width: usize) -> bool {
        self.nodes.push(Node { key, width });
        std::mem::replace(&mut self.widths[key], width) == 0
    }

    /// Eliminates a point body; what it passes to its anchor comes back.
    fn pass_point(&mut self, model: &Model, factor: &Factor, point: usize, impulses: &Mat3) -> Propagated {
        let factor = &factor.points[point];
        self.touch(model.bodies.len() + point, 3);
        let root = factor.inverse_mass.sqrt();
        self.y.extend(impulses.row_iter().map(|row| row.transpose() * root));
        match &model.points[point].tether {
            Some(tether) if factor.share != 0.0 => {
                let wrenches = [0, 1, 2]
                    .map(|k| Wrench::of_force_at(impulses.column(k) * factor.share, &factor.r_anchor));
                Propagated { body: Some(tether.body.index()), wrenches }
            }
            _ => Propagated { body: None, wrenches: [Wrench::ZERO; 3] },
        }
    }

    /// The spin of a point body is one more block of `D`: impulses at `r` from its centre turn it.
    fn pass_spin(&mut self, model: &Model, point: usize, impulses: &Mat3, r: &Vec3) {
        self.touch(model.bodies.len() + model.points.len() + point, 3);
        let root = (1.0 / model.points[point].spin_inertia).sqrt();
        let turning = r.cross_matrix() * impulses;
        self.y.extend(turning.row_iter().map(|row| row.transpose() * root));
    }

    /// Eliminates a joint of N degrees of freedom, T of them translations: `y = S^T P`, `P - G y`; keeps `C^T y`.
    fn pass_joint<const T: usize, const N: usize>(
        &mut self,
        model: &Model,
        kinematics: &Kinematics,
        factor: &Factor,
        body: usize,
        wrenches: &mut [Wrench; 3],
        loads: &[Load; 2],
    ) {
        let dofs = model.v_start[body]..model.v_start[body + 1];
        let mut own = [Vec3::zeros(); N];
        for (k, (y, axis)) in own.iter_mut().zip(&kinematics.axes[dofs.clone()]).enumerate() {
            let along = |wrench: &Wrench| axis.dot(if k < T { &wrench.force } else { &wrench.torque });
            *y = Vec3::new(along(&wrenches[0]), along(&wrenches[1]), along(&wrenches[2]));
        }
        for load in loads {
            if let Load::Dof { dof, factor, .. } = load
                && dofs.contains(dof)
            {
                own[dof - dofs.start].x += factor;
            }
        }
        for (y, g) in own.iter().zip(&factor.g[dofs]) {
            for (wrench, y) in wrenches.iter_mut().zip(y.iter()) {
                wrench.torque -= g.torque * *y;
                wrench.force -= g.force * *y;
            }
        }
        let entries = factor.d_start[body]..factor.d_start[body] + N * N;
        if self.touch(body, N) {
            lower_root::<N>(&factor.d_inverse[entries.clone()], &mut self.roots[entries.clone()]);
        }
        let root = &self.roots[entries];
        for column in 0..N {
            let below = own.iter().enumerate().skip(column);
            self.y.push(below.fold(Vec3::zeros(), |sum, (row, y)| sum + y * root[row * N + column]));
        }
    }
}
