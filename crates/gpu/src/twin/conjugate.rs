//! The substep's linear system by conjugate gradients instead of elimination: what other simulators do, for comparison. Nothing is factorised; a product with the
//! joint-space inertia is a walk outwards and a walk inwards.
//!
//! The way in leaves for every joint its axes, the arm to its tip, the impulse y on it with no joint moving, and the inverse of its own 2 x 2 block of the inertia,
//! the preconditioner: H = S^T I^c S + armature, I^c the inertia of all that the joint bears. Then H x = y is solved from x = 0. A product H p: velocity changes p
//! spread outwards to every tip ([`Lane::spread`]), and the momenta of links, fruit and what the ground holds are collected inwards ([`Lane::collect`]).

use super::Lane;
use super::inward::Body;
use super::math::Vec3;
use super::outward::{Found, Way};
use crate::layout::{
    LANES, QUAD, first, fruit, krylov, link, notice, second, state, third, tile, work, world,
};
use crate::schedule::{LEVELS, PARTS, WARPS};

/// Iterations after which a substep goes on with what it has.
const MOST_ITERATIONS: usize = 64;
/// Norm of the preconditioned residual, over that of the start, at which a world's system counts as solved: what f32 can tell.
const TOLERANCE: f32 = 1e-5;

/// Change of angular and of linear velocity; torque and force.
#[derive(Clone, Copy)]
struct Pair {
    angular: Vec3,
    linear: Vec3,
}

impl Pair {
    fn zero() -> Self {
        Self { angular: Vec3::zeros(), linear: Vec3::zeros() }
    }
}

fn sum_of(a: Pair, b: Pair) -> Pair {
    Pair { angular: a.angular + b.angular, linear: a.linear + b.linear }
}

/// The inverse of a joint's block times a residual.
fn preconditioned([i_11, i_12, i_22]: [f32; 3], r: [f32; 2]) -> [f32; 2] {
    [i_11 * r[0] + i_12 * r[1], i_12 * r[0] + i_22 * r[1]]
}

fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

impl Lane<'_> {
    /// One frame of a running world.
    pub(super) fn conjugate(&mut self) {
        if self.world(world::STOPPED).to_bits() != 0 {
            return;
        }
        if self.world(world::NOTICE).to_bits() & notice::STALE as u32 != 0 {
            (0..PARTS).for_each(|part| {
                self.outward(part, Way::Look);
            });
        }
        let mut found = Found::default();
        for substep in 0..self.memory.rules.substeps {
            self.memory.substep = substep;
            (0..PARTS).rev().for_each(|part| self.inward(part));
            self.solve();
            let way = if substep + 1 == self.memory.rules.substeps { Way::Test } else { Way::Advance };
            for part in 0..PARTS {
                let Found { notice, peak } = self.outward(part, way);
                found = Found { notice: found.notice | notice, peak: found.peak.max(peak) };
            }
        }
        self.conclude(found);
    }

    fn solve(&mut self) {
        self.solve_to(TOLERANCE);
        (0..PARTS).for_each(|part| self.hand_over(part));
    }

    /// Down to a part of the first residual.
    pub(super) fn solve_to(&mut self, tolerance: f32) {
        let start = self.total(|lane, part| lane.found_dot(part));
        let mut rho = start;
        for _ in 0..MOST_ITERATIONS {
            // Also where something is no number.
            let goes = rho > tolerance * tolerance * start;
            if !goes {
                break;
            }
            (0..PARTS).for_each(|part| self.spread(part));
            let mut curvatures = [0.0; PARTS];
            (0..PARTS).rev().for_each(|part| curvatures[part] = self.collect(part));
            // Rounding may leave none: what has been found so far is the end.
            let curvature = self.total(|_, part| curvatures[part]);
            let is_convex = curvature > 0.0;
            if !is_convex {
                break;
            }
            let alpha = rho / curvature;
            let next = self.total(|lane, part| lane.relax(part, alpha));
            (0..PARTS).for_each(|part| self.redirect(part, next / rho));
            rho = next;
        }
    }

    /// A sum over all parts, warp by warp.
    fn total(&mut self, mut of: impl FnMut(&mut Self, usize) -> f32) -> f32 {
        let of_parts: Vec<f32> = (0..PARTS).map(|part| of(self, part)).collect();
        let of_warp = |warp: usize| {
            let trunk = if warp == 0 { of_parts[0] } else { 0.0 };
            (0..LEVELS).fold(trunk, |sum, level| sum + of_parts[1 + level * WARPS + warp])
        };
        (0..WARPS).fold(0.0, |sum, warp| sum + of_warp(warp))
    }

    /// First residual times preconditioned residual, of a part; a kernel sums it up on the way in.
    fn found_dot(&self, part: usize) -> f32 {
        self.rows_of(part).fold(0.0, |sum, row| {
            let at = self.krylov_of(row);
            let [.., r_1, r_2] = self.krylov(at, krylov::X);
            sum + dot([r_1, r_2], preconditioned(self.pivot_of(at), [r_1, r_2]))
        })
    }

    /// First quad of what is kept of a row's joint, behind the links of the tile.
    pub(super) fn krylov_of(&self, row: usize) -> usize {
        let rows = self.header(tile::STARTS + PARTS);
        let behind = self.memory.link_at(self.number, rows, 0, self.lane) / QUAD;
        behind + row * krylov::FIELDS / QUAD * LANES
    }

    /// Four of its fields, from a multiple of four on.
    pub(super) fn krylov(&self, at: usize, field: usize) -> [f32; QUAD] {
        let at = (at + field / QUAD * LANES) * QUAD;
        [0, 1, 2, 3].map(|k| self.memory.links[at + k])
    }

    fn krylov3(&self, at: usize, field: usize) -> Vec3 {
        let [x, y, z, _] = self.krylov(at, field);
        Vec3::new(x, y, z)
    }

    fn set_krylov(&mut self, at: usize, field: usize, value: [f32; QUAD]) {
        let at = (at + field / QUAD * LANES) * QUAD;
        self.memory.links[at..at + QUAD].copy_from_slice(&value);
    }

    /// Rows of a part that have a link of this world.
    fn rows_of(&self, part: usize) -> impl DoubleEndedIterator<Item = usize> + use<> {
        let range = self.header(tile::STARTS + part)..self.header(tile::STARTS + part + 1);
        let rows: Vec<usize> = range.filter(|&row| self.operation(row)[0] & first::ACTIVE != 0).collect();
        rows.into_iter()
    }

    /// Leaves what the iterations need of a joint, instead of eliminating it.
    pub(super) fn prepare(&mut self, row: usize, body: &Body, pivot: [f32; 3], armature: f32, y: [f32; 2]) {
        let at = self.krylov_of(row);
        let z = preconditioned(pivot, y);
        let with = |v: Vec3, more: f32| [v.x, v.y, v.z, more];
        self.set_krylov(at, krylov::FIRST, with(body.joint.first, pivot[0]));
        self.set_krylov(at, krylov::SECOND, with(body.joint.axes.y, pivot[1]));
        self.set_krylov(at, krylov::ARM, with(body.d, pivot[2]));
        self.set_krylov(at, krylov::X, [0.0, 0.0, y[0], y[1]]);
        self.set_krylov(at, krylov::P, [z[0], z[1], 0.0, 0.0]);
        self.set_krylov(at, krylov::ARMATURE, [armature, 0.0, 0.0, 0.0]);
    }

    fn pivot_of(&self, at: usize) -> [f32; 3] {
        [krylov::FIRST, krylov::SECOND, krylov::ARM].map(|field| self.krylov(at, field)[3])
    }

    fn pair(&self, at: usize) -> Pair {
        let [angular, linear] = self.vectors(at, 0);
        Pair { angular, linear }
    }

    fn set_pair(&mut self, at: usize, value: Pair) {
        self.set_vectors(at, 0, &[value.angular, value.linear]);
    }

    /// Velocity changes of the joints, to every tip.
    fn spread(&mut self, part: usize) {
        let mut tip = Pair::zero();
        for row in self.rows_of(part) {
            let [a, b, c, _] = self.operation(row);
            if a & first::ROOT != 0 {
                tip = Pair::zero();
            } else if a & (first::FROM_SLOT | first::FROM_CROSS) != 0 {
                tip = self.pair(self.parent_fork_at(a));
            }
            let at = self.krylov_of(row);
            let [p_1, p_2, ..] = self.krylov(at, krylov::P);
            let first = self.krylov3(at, krylov::FIRST);
            let second = self.krylov3(at, krylov::SECOND);
            let d = self.krylov3(at, krylov::ARM);
            tip.angular += first * p_1 + second * p_2;
            tip.linear += tip.angular.cross(&d);
            if b & second::CARRIES == 0 {
                self.set_pair(self.leaf_at(c >> third::LEAF & 0x3ff), tip);
            }
            if a & first::TO_SLOT != 0 {
                self.set_pair(self.slot_at(a >> first::SLOT & 0xff), tip);
            }
            if a & first::TO_CROSS != 0 {
                self.set_pair(self.cross_fork_at(a >> first::FORK), tip);
            }
        }
    }

    /// Momenta of these changes, from every tip to the joints. Leaves the product, and gives the part's p . H p.
    fn collect(&mut self, part: usize) -> f32 {
        let (mut tip, mut borne, mut curvature) = (Pair::zero(), Pair::zero(), 0.0);
        for row in self.rows_of(part).rev() {
            let [a, b, c, _] = self.operation(row);
            if b & second::CARRIES == 0 {
                tip = self.pair(self.leaf_at(c >> third::LEAF & 0x3ff));
                borne = Pair::zero();
            }
            if b & second::TAKES != 0 {
                borne = sum_of(borne, self.pair(self.slot_at(a >> first::SLOT & 0xff)));
            }
            for k in 0..(b >> second::LOADS & 0x3f) {
                let brought = self.pair(self.cross_load_at((b >> second::FIRST_LOAD & 0x3ff) + k));
                borne = sum_of(borne, brought);
            }
            let at = self.krylov_of(row);
            let first = self.krylov3(at, krylov::FIRST);
            let second = self.krylov3(at, krylov::SECOND);
            let d = self.krylov3(at, krylov::ARM);
            let [p_1, p_2, ..] = self.krylov(at, krylov::P);
            let [armature, ..] = self.krylov(at, krylov::ARMATURE);
            borne = self.momentum(row, c, tip, d, borne);
            let product =
                [first.dot(&borne.angular) + armature * p_1, second.dot(&borne.angular) + armature * p_2];
            self.set_krylov(at, krylov::P, [p_1, p_2, product[0], product[1]]);
            curvature += dot([p_1, p_2], product);
            tip.linear -= tip.angular.cross(&d);
            tip.angular -= first * p_1 + second * p_2;
            if b & second::GIVES_FIRST != 0 {
                self.set_pair(self.slot_at(a >> first::PARENT & 0xff), borne);
            }
            if b & second::GIVES != 0 {
                let to = self.slot_at(a >> first::PARENT & 0xff);
                self.set_pair(to, sum_of(self.pair(to), borne));
            }
            if b & second::GIVES_CROSS != 0 {
                self.set_pair(self.cross_load_at(b >> second::OWN_LOAD), borne);
            }
        }
        curvature
    }

    /// Momentum about a link's joint of the link, its fruit, what the ground holds at its tip, and what is borne there; drag included as in `eliminate`.
    fn momentum(&self, row: usize, third_word: usize, tip: Pair, d: Vec3, borne: Pair) -> Pair {
        let rules = &self.memory.rules;
        let is_debris = self.state(row) & state::DEBRIS != 0;
        let [linear_drag, angular_drag] = if is_debris {
            [rules.broken_linear_drag, rules.broken_angular_drag]
        } else {
            [rules.linear_drag, rules.angular_drag]
        };
        let z = d * (1.0 / self.link(row, link::LENGTH));
        let at_joint = tip.linear - tip.angular.cross(&d);
        let mut at_tip = borne.linear;
        if is_debris {
            let [.., across] = self.quad(self.work_at(row), work::PROP);
            let [normal, ..] = self.quad(self.work_at(row), work::HELD);
            at_tip += tip.linear.component_mul(&Vec3::new(across, across, normal));
        }
        let mass = self.link(row, link::MASS) * (1.0 + rules.h * linear_drag);
        let own_force = (at_joint + tip.angular.cross(&d) * 0.5) * mass;
        let mut sum = Pair {
            angular: borne.angular + d.cross(&at_tip) + d.cross(&own_force) * 0.5,
            linear: at_tip + own_force,
        };
        let spin = tip.angular * self.link(row, link::ACROSS)
            + z * (self.link(row, link::EXCESS) * z.dot(&tip.angular));
        sum.angular += spin * (1.0 + rules.h * angular_drag);
        let first_fruit = third_word >> third::FIRST_FRUIT & 0xfff;
        for k in first_fruit..first_fruit + (third_word >> third::FRUIT & 0x3f) {
            let arm = self.fruit3(k, fruit::ARM);
            let force = (at_joint + tip.angular.cross(&arm)) * self.fruit(k, fruit::ADDED_MASS);
            sum.angular += arm.cross(&force);
            sum.linear += force;
        }
        sum
    }

    /// x and r after a step along p; gives the part's new r . z.
    fn relax(&mut self, part: usize, alpha: f32) -> f32 {
        let mut rho = 0.0;
        for row in self.rows_of(part) {
            let at = self.krylov_of(row);
            let [p_1, p_2, h_1, h_2] = self.krylov(at, krylov::P);
            let [x_1, x_2, r_1, r_2] = self.krylov(at, krylov::X);
            let r = [r_1 - h_1 * alpha, r_2 - h_2 * alpha];
            self.set_krylov(at, krylov::X, [x_1 + p_1 * alpha, x_2 + p_2 * alpha, r[0], r[1]]);
            rho += dot(r, preconditioned(self.pivot_of(at), r));
        }
        rho
    }

    /// The next direction.
    fn redirect(&mut self, part: usize, beta: f32) {
        for row in self.rows_of(part) {
            let at = self.krylov_of(row);
            let [.., r_1, r_2] = self.krylov(at, krylov::X);
            let z = preconditioned(self.pivot_of(at), [r_1, r_2]);
            let [p_1, p_2, ..] = self.krylov(at, krylov::P);
            self.set_krylov(at, krylov::P, [z[0] + p_1 * beta, z[1] + p_2 * beta, 0.0, 0.0]);
        }
    }

    /// Leaves the solution where elimination leaves a joint's own part, with nothing that depends on its parent.
    fn hand_over(&mut self, part: usize) {
        for row in self.rows_of(part) {
            let [x_1, x_2, ..] = self.krylov(self.krylov_of(row), krylov::X);
            let at = self.work_at(row);
            self.set_quad(at, work::G_1N, [0.0, 0.0, 0.0, x_1]);
            self.set_quad(at, work::G_1F, [0.0, 0.0, 0.0, x_2]);
            for field in [work::G_2N, work::G_2F] {
                let [.., held] = self.quad(at, field);
                self.set_quad(at, field, [0.0, 0.0, 0.0, held]);
            }
        }
    }
}
