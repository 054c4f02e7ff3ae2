//! Delassus matrix `W = J A^-1 J^T`, path by path.
//!
//! With the articulated-body factor `A^-1 = L^-T D^-1 L^-1`, an impulse at a contact only passes through the
//! joints between its links and the world: its row of `Y = L^-1 J^T` is as sparse as that path. A block of
//! `W` is then `Y_r^T D^-1 Y_s` over the joints that two paths share.

use std::ops::Range;

use orchard_geometry::{Mat3, Vec3};

use crate::data::Data;
use crate::model::Model;
use crate::spatial::Wrench;

/// Three unit impulses (one for each row of a block) on one side of a block.
#[derive(Debug, Clone, Copy)]
pub(super) enum Load {
    /// On the world.
    None,
    /// On a link, at its origin.
    Body { body: usize, wrenches: [Wrench; 3] },
    /// On a point body: the columns.
    Point { point: usize, impulses: Mat3, r: Vec3 },
    /// On a degree of freedom, in the first row only.
    Dof { body: usize, dof: usize, factor: f64 },
}

/// A joint or point body that the impulses of a block pass through.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// Link, or number of links + point body.
    key: usize,
    /// Its first entry in `y` and `z`.
    start: usize,
    /// Its degrees of freedom.
    width: usize,
}

/// The matrix, and the paths that it is made from.
#[derive(Debug, Clone, Default)]
pub(super) struct Delassus {
    nodes: Vec<Node>,
    /// Nodes of each block, keys descending.
    paths: Vec<Range<usize>>,
    /// Y: for each degree of freedom on a path, the values of the block's three rows.
    y: Vec<Vec3>,
    /// D^-1 Y.
    z: Vec<Vec3>,
    blocks: Vec<Mat3>,
}

/// Impulses on their way to the root.
#[derive(Clone, Copy)]
struct Carrier {
    body: Option<usize>,
    wrenches: [Wrench; 3],
}

impl Delassus {
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.paths.clear();
        self.y.clear();
        self.z.clear();
    }

    /// Block of W that says what the impulses of block `column` change at block `row`.
    pub fn block(&self, row: usize, column: usize) -> &Mat3 {
        &self.blocks[row * self.paths.len() + column]
    }

    /// Velocity changes of the rows under impulses: `W p`.
    pub fn multiply(&self, p: &[Vec3], out: &mut [Vec3]) {
        for (row, out) in self.blocks.chunks_exact(p.len()).zip(out) {
            *out = row.iter().zip(p).fold(Vec3::zeros(), |sum, (block, p)| sum + block * p);
        }
    }

    /// Adds a block of three rows, with its load on each side.
    pub fn push(&mut self, model: &Model, data: &Data, loads: [Load; 2]) {
        let first = self.nodes.len();
        let mut carriers = [Carrier { body: None, wrenches: [Wrench::ZERO; 3] }; 2];
        for (carrier, load) in carriers.iter_mut().zip(&loads) {
            match load {
                Load::None => {}
                Load::Body { body, wrenches } => {
                    *carrier = Carrier { body: Some(*body), wrenches: *wrenches }
                }
                Load::Dof { body, .. } => carrier.body = Some(*body),
                Load::Point { point, impulses, r } => {
                    *carrier = self.pass_point(model, data, *point, impulses);
                    if data.spins(model, *point) {
                        self.pass_spin(model, *point, impulses, r);
                    }
                }
            }
        }
        self.nodes[first..].sort_by_key(|node| std::cmp::Reverse(node.key));
        // Parents have smaller indices, so the larger of two links is never above the other.
        while let Some(body) = carriers[0].body.max(carriers[1].body) {
            let mut wrenches = [Wrench::ZERO; 3];
            for carrier in carriers.iter_mut().filter(|carrier| carrier.body == Some(body)) {
                for (sum, wrench) in wrenches.iter_mut().zip(&carrier.wrenches) {
                    *sum += *wrench;
                }
                carrier.body = None;
            }
            self.pass_joint(model, data, body, &mut wrenches, &loads);
            if let Some(parent) = model.bodies[body].parent {
                let r = &data.kinematics.links[body].r_parent;
                let free = usize::from(carriers[0].body.is_some());
                let wrenches = wrenches.map(|wrench| wrench.shifted(r));
                carriers[free] = Carrier { body: Some(parent.index()), wrenches };
            }
        }
        self.paths.push(first..self.nodes.len());
    }

    /// Eliminates a point body; what it passes to its anchor comes back.
    fn pass_point(&mut self, model: &Model, data: &Data, point: usize, impulses: &Mat3) -> Carrier {
        let factor = &data.factor.points[point];
        self.nodes.push(Node { key: model.bodies.len() + point, start: self.y.len(), width: 3 });
        for row in impulses.row_iter() {
            let y = row.transpose();
            self.y.push(y);
            self.z.push(y * factor.inverse_mass);
        }
        match &model.points[point].tether {
            Some(tether) if factor.share != 0.0 => {
                let wrenches = [0, 1, 2]
                    .map(|k| Wrench::of_force_at(impulses.column(k) * factor.share, &factor.r_anchor));
                Carrier { body: Some(tether.body.index()), wrenches }
            }
            _ => Carrier { body: None, wrenches: [Wrench::ZERO; 3] },
        }
    }

    /// The spin of a point body is one more block of `D`: impulses at `r` from its centre turn it.
    fn pass_spin(&mut self, model: &Model, point: usize, impulses: &Mat3, r: &Vec3) {
        let key = model.bodies.len() + model.points.len() + point;
        self.nodes.push(Node { key, start: self.y.len(), width: 3 });
        let turning = r.cross_matrix() * impulses;
        for row in turning.row_iter() {
            let y = row.transpose();
            self.y.push(y);
            self.z.push(y / model.points[point].spin_inertia);
        }
    }

    /// Eliminates a joint: `y = S^T P`, `P - G y`.
    fn pass_joint(
        &mut self,
        model: &Model,
        data: &Data,
        body: usize,
        wrenches: &mut [Wrench; 3],
        loads: &[Load; 2],
    ) {
        let dofs = model.v_start[body]..model.v_start[body + 1];
        let width = dofs.len();
        if width == 0 {
            return;
        }
        let start = self.y.len();
        let translations = model.bodies[body].joint.translations();
        for (k, dof) in dofs.clone().enumerate() {
            let axis = &data.kinematics.axes[dof];
            let mut y = Vec3::from(wrenches.map(|wrench| {
                if k < translations { axis.dot(&wrench.force) } else { axis.dot(&wrench.torque) }
            }));
            for load in loads {
                if let Load::Dof { dof: loaded, factor, .. } = load
                    && *loaded == dof
                {
                    y.x += factor;
                }
            }
            self.y.push(y);
        }
        let d_inverse = &data.factor.d_inverse[data.factor.d_start[body]..data.factor.d_start[body + 1]];
        for (row, dof) in d_inverse.chunks_exact(width).zip(dofs) {
            let y = &self.y[start..];
            self.z.push(row.iter().zip(y).fold(Vec3::zeros(), |sum, (d, y)| sum + y * *d));
            let own = y[self.z.len() - 1 - start];
            for (k, wrench) in wrenches.iter_mut().enumerate() {
                *wrench = *wrench - data.factor.g[dof].scaled(own[k]);
            }
        }
        self.nodes.push(Node { key: body, start, width });
    }

    /// Multiplies the paths out.
    pub fn assemble(&mut self) {
        let count = self.paths.len();
        self.blocks.clear();
        self.blocks.resize(count * count, Mat3::zeros());
        for row in 0..count {
            for column in 0..=row {
                let block = self.overlap(row, column);
                self.blocks[row * count + column] = block;
                self.blocks[column * count + row] = block.transpose();
            }
        }
    }

    /// `Y_r^T D^-1 Y_s` over the nodes that two paths share.
    fn overlap(&self, row: usize, column: usize) -> Mat3 {
        let mut sum = Mat3::zeros();
        let (mut r, mut s) = (self.paths[row].clone(), self.paths[column].clone());
        while let (Some(node_r), Some(node_s)) =
            (self.nodes[r.clone()].first(), self.nodes[s.clone()].first())
        {
            match node_r.key.cmp(&node_s.key) {
                std::cmp::Ordering::Greater => r.start += 1,
                std::cmp::Ordering::Less => s.start += 1,
                std::cmp::Ordering::Equal => {
                    for k in 0..node_r.width {
                        sum += self.y[node_r.start + k] * self.z[node_s.start + k].transpose();
                    }
                    r.start += 1;
                    s.start += 1;
                }
            }
        }
        sum
    }
}
