//! Tips to root: elimination of the joints (articulated-body algorithm, Featherstone 2008, section 7.3) with springs, dampers and drag taken at the end of the
//! substep as what they add to inertia; `docs/computation/dynamics.md` derives the equations. Motion is walked back from the tips.

use super::Lane;
use super::load::Load;
use super::math::{Vec3, symmetric};
use super::motion::{Joint, Link, Motion, joint_inward};
use crate::Solver;
use crate::layout::{first, fourth, link, push, second, state, third, tile, work, world};

/// A link at its joint: impulses on it, and where its joint leads.
pub(super) struct Body {
    pub joint: Joint,
    /// From the joint to the tip.
    pub d: Vec3,
    /// Torque about the joint and force, as impulses over the substep.
    torque: Vec3,
    force: Vec3,
    /// Motion of the parent's tip.
    parent: Motion,
}

impl Lane<'_> {
    /// One part of the walk.
    pub(super) fn inward(&mut self, part: usize) {
        let (start, end) = (self.header(tile::STARTS + part), self.header(tile::STARTS + part + 1));
        if start == end {
            return;
        }
        let [.., c, _] = self.operation(end - 1);
        let mut motion = self.motion(self.leaf_at(c >> third::LEAF & 0x3ff), 0);
        let mut load = Load::nothing();
        for row in (start..end).rev() {
            let [a, b, c, d] = self.operation(row);
            // A row that gives something away is not carried by the next one, which begins at the leaf before this one.
            let leaf = (c >> third::LEAF & 0x3ff).max(1) - 1;
            if a & first::ACTIVE == 0 {
                motion = self.motion(self.leaf_at(leaf), 0);
                continue;
            }
            if b & second::TAKES != 0 {
                load = load.plus(&self.load(self.slot_at(a >> first::SLOT & 0xff)));
            }
            for k in 0..(b >> second::LOADS & 0x3f) {
                let brought = self.load(self.cross_load_at((b >> second::FIRST_LOAD & 0x3ff) + k));
                load = load.plus(&brought);
            }
            let own = self.read_link(row);
            let bits = self.state(row);
            let (rules, is_debris) = (&self.memory.rules, bits & state::DEBRIS != 0);
            let drag = if is_debris {
                [rules.broken_linear_drag, rules.broken_angular_drag]
            } else {
                [rules.linear_drag, rules.angular_drag]
            };
            let body = self.body_inward(&own, &motion, drag);
            let (mut torque, mut force) = (body.torque, body.force);
            for k in 0..(c >> third::FRUIT & 0x3f) {
                let fruit = (c >> third::FIRST_FRUIT & 0xfff) + k;
                let (arm, reaction, mass) = self.stem_reaction(fruit);
                load = load.plus_point_mass(mass, arm - body.d);
                torque += arm.cross(&reaction);
                force += reaction;
            }
            // Nobody holds on to what falls.
            let mut held = [0.0; 2];
            if bits & state::DEBRIS != 0 {
                (load, held) = self.propped(row, load);
            }
            if d & fourth::PUSHED != 0 && bits & state::DEBRIS == 0 {
                let (push_torque, push_force) = self.pushed(row, body.d);
                torque += push_torque;
                force += push_force;
            }
            load = self.eliminate(&own, row, bits, drag, &body, &load, torque, force);
            if bits & state::DEBRIS != 0 {
                self.hand_on(row, held);
            }
            motion = body.parent;
            if b & (second::GIVES_FIRST | second::GIVES) != 0 {
                let at = self.slot_at(a >> first::PARENT & 0xff);
                let sum = if b & second::GIVES != 0 { self.load(at).plus(&load) } else { load };
                self.set_load(at, &sum);
            }
            if b & second::GIVES_CROSS != 0 {
                self.set_load(self.cross_load_at(b >> second::OWN_LOAD), &load);
            }
            if b & (second::GIVES_FIRST | second::GIVES | second::GIVES_CROSS) != 0 {
                motion = self.motion(self.leaf_at(leaf), 0);
                load = Load::nothing();
            }
        }
    }

    /// Keeps what held a tip beside what the way in leaves.
    fn hand_on(&mut self, row: usize, held: [f32; 2]) {
        let at = self.work_at(row);
        for (field, held) in [work::G_2N, work::G_2F].into_iter().zip(held) {
            let [x, y, z, _] = self.quad(at, field);
            self.set_quad(at, field, [x, y, z, held]);
        }
    }

    /// Gravity, drag and velocity products of a link, from the motion of its tip.
    fn body_inward(&self, own: &Link, tip: &Motion, drag: [f32; 2]) -> Body {
        let h = self.memory.rules.h;
        let v = own.v;
        let (joint, axes) = joint_inward(&tip.axes, own.direction, own.q);
        let (z, w) = (tip.axes.z, tip.w);
        let length = own.length;
        let d = z * length;
        let w_cross_z = w.cross(&z);
        let v_d = w_cross_z * length;
        let b_d = tip.b_w.cross(&d) + w.cross(&v_d);
        let (v_joint, b_joint) = (tip.v - v_d, tip.b_v - b_d);

        // Minus the rate of change of momentum that the bias motion needs, at the centre of mass and then about the joint.
        let mut f = b_joint + b_d * 0.5 + (v_joint + v_d * 0.5) * drag[0];
        f.z += self.memory.rules.gravity;
        let force = f * (-h * own.mass);
        let t = tip.b_w + w * drag[1];
        let spin = z * z.dot(&t) + w_cross_z * w.dot(&z);
        let n = t * own.across + spin * own.excess;
        let torque = (d * 0.5).cross(&force) - n * h;

        let s_w = joint.first * v[0] + joint.axes.y * v[1];
        let w_parent = w - s_w;
        let b_joint_turn = w_parent.cross(&s_w) + joint.third * (v[0] * v[1]);
        let parent = Motion { axes, w: w_parent, b_w: tip.b_w - b_joint_turn, v: v_joint, b_v: b_joint };
        Body { joint, d, torque, force, parent }
    }

    /// Torque about the joint and force of what is applied to a link, as impulses.
    fn pushed(&self, row: usize, d: Vec3) -> (Vec3, Vec3) {
        let (mut torque, mut force) = (Vec3::zeros(), Vec3::zeros());
        for k in 0..self.memory.pushes_each {
            let number =
                |field: usize| self.memory.pushes[self.memory.push_at(self.number, k, field, self.lane)];
            let frame = self.memory.rules.frame;
            let acts = number(push::AFTER).to_bits() < frame && frame <= number(push::UNTIL).to_bits();
            if acts && number(push::ROW).to_bits() == row as u32 {
                let vector = |field: usize| Vec3::from_fn(|axis, _| number(field + axis));
                let (f, n) = (vector(push::FORCE), vector(push::TORQUE));
                force += f * self.memory.rules.h;
                torque += (n + (d * 0.5).cross(&f)) * self.memory.rules.h;
            }
        }
        (torque, force)
    }

    /// Stiffness and armature of a joint, h (D + h K); of a broken one the damper that its friction and brake are (`treephys::Rupture`).
    fn joint_law(&mut self, own: &Link, row: usize, bits: usize) -> [f32; 2] {
        let rules = &self.memory.rules;
        let h = rules.h;
        if bits & state::BROKEN == 0 {
            let damping_time = rules.damped * self.world(world::DAMPING_TIME);
            return [own.stiffness, h * (damping_time + h) * own.stiffness];
        }
        let [inertia, friction, last] =
            [link::BROKEN_INERTIA, link::FRICTION, link::LAST_RATE].map(|field| self.link(row, field));
        let rate = (own.v[0] * own.v[0] + own.v[1] * own.v[1]).sqrt();
        let frames = rules.frame - (bits >> state::BROKE) as u32 - 1;
        let age = (frames * rules.substeps + self.memory.substep) as f32 * h;
        let ramp =
            if rules.friction_ramp_time > 0.0 { (age / rules.friction_ramp_time).min(1.0) } else { 1.0 };
        let moment = friction * (1.0 + (rules.friction_ramp - 1.0) * ramp);
        let expected = rate + (rate - last).max(0.0);
        let speeding = expected / rules.rate_limit;
        let brake = rules.rate_brake * inertia * speeding * speeding * speeding * speeding;
        let residual = (rules.residual_damping * inertia).min(rules.residual_damping_max);
        let damping = residual + brake + moment / expected.max(rules.friction_regularisation);
        self.set_link(row, link::LAST_RATE, rate);
        [0.0, h * damping]
    }

    /// Eliminates a joint: leaves what the way out needs, and gives what the parent bears.
    #[expect(clippy::too_many_arguments, reason = "the numbers of one link, as its kernel has them")]
    fn eliminate(
        &mut self,
        own: &Link,
        row: usize,
        bits: usize,
        drag: [f32; 2],
        body: &Body,
        borne: &Load,
        torque: Vec3,
        force: Vec3,
    ) -> Load {
        let h = self.memory.rules.h;
        let d = body.d;
        let [stiffness, armature] = self.joint_law(own, row, bits);

        // The link's own inertia at its joint, drag included: a rod of mass m (1 + h c) and what it has beyond that.
        let mass = own.mass * (1.0 + h * drag[0]);
        let turning = 1.0 + h * drag[1];
        let length = own.length;
        let quarter = 0.25 * mass;
        let across = own.across * turning + quarter * (length * length);
        let along = d * (own.excess * turning / (length * length) - quarter);
        let half = d * (0.5 * mass);

        // What is borne, from the tip to the joint: H' = H + [d] M, J' = J + [d] H^T - H' [d].
        let (m, old) = (&borne.linear, &borne.coupling);
        let mut coupling = [
            old[0] + d.cross(&m[0]),
            old[1] + d.cross(&Vec3::new(m[0].y, m[1].x, m[1].y)),
            old[2] + d.cross(&Vec3::new(m[0].z, m[1].y, m[1].z)),
        ];
        let transposed = |j: usize| Vec3::new(old[0][j], old[1][j], old[2][j]);
        let column_x = d.cross(&transposed(0)) - (coupling[1] * d.z - coupling[2] * d.y) + along * d.x;
        let column_y = d.cross(&transposed(1)) - (coupling[2] * d.x - coupling[0] * d.z) + along * d.y;
        let column_z = d.cross(&transposed(2)) - (coupling[0] * d.y - coupling[1] * d.x) + along * d.z;
        let angular = [
            borne.angular[0] + column_x + Vec3::new(across, 0.0, 0.0),
            borne.angular[1] + Vec3::new(column_y.y + across, column_y.z, column_z.z + across),
        ];
        coupling[0] += Vec3::new(0.0, half.z, -half.y);
        coupling[1] += Vec3::new(-half.z, 0.0, half.x);
        coupling[2] += Vec3::new(half.y, -half.x, 0.0);
        let linear = [m[0] + Vec3::new(mass, 0.0, 0.0), m[1] + Vec3::new(mass, 0.0, mass)];
        let n = torque + borne.torque + d.cross(&borne.force);
        let f = force + borne.force;

        // U = I S, pivot D = S^T U + armature, g = D^-1 U.
        let (a_1, a_2) = (body.joint.first, body.joint.axes.y);
        let by_columns = |a: Vec3| Vec3::new(coupling[0].dot(&a), coupling[1].dot(&a), coupling[2].dot(&a));
        let (u_1n, u_2n) = (symmetric(angular[0], angular[1], a_1), symmetric(angular[0], angular[1], a_2));
        let (u_1f, u_2f) = (by_columns(a_1), by_columns(a_2));
        let (d_11, d_12, d_22) = (a_1.dot(&u_1n) + armature, a_2.dot(&u_1n), a_2.dot(&u_2n) + armature);
        let inverse = 1.0 / (d_11 * d_22 - d_12 * d_12);
        let (i_11, i_12, i_22) = (d_22 * inverse, -d_12 * inverse, d_11 * inverse);
        let (g_1n, g_1f) = (u_1n * i_11 + u_2n * i_12, u_1f * i_11 + u_2f * i_12);
        let (g_2n, g_2f) = (u_1n * i_12 + u_2n * i_22, u_1f * i_12 + u_2f * i_22);
        let spring = |k: usize| h * stiffness * own.q[k] + armature * own.v[k];
        let (y_1, y_2) = (a_1.dot(&n) - spring(0), a_2.dot(&n) - spring(1));
        if self.memory.solver == Solver::ConjugateGradients {
            self.prepare(row, body, [i_11, i_12, i_22], armature, [y_1, y_2]);
            return Load { angular, coupling, linear, torque: n, force: f };
        }
        let (e_1, e_2) = (i_11 * y_1 + i_12 * y_2, i_12 * y_1 + i_22 * y_2);
        let at = self.work_at(row);
        self.set_quad(at, work::G_1N, [g_1n.x, g_1n.y, g_1n.z, e_1]);
        self.set_quad(at, work::G_1F, [g_1f.x, g_1f.y, g_1f.z, e_2]);
        self.set_quad(at, work::G_2N, [g_2n.x, g_2n.y, g_2n.z, 0.0]);
        self.set_quad(at, work::G_2F, [g_2f.x, g_2f.y, g_2f.z, 0.0]);

        let left = |k: usize, column: Vec3| column - u_1n * g_1f[k] - u_2n * g_2f[k];
        let lower = |a: Vec3| Vec3::new(a.y, a.y, a.z);
        let below = |a: Vec3| Vec3::new(a.y, a.z, a.z);
        let reduced = |m: &[Vec3; 2], u: [Vec3; 2], g: [Vec3; 2]| {
            [
                m[0] - g[0] * u[0].x - g[1] * u[1].x,
                m[1] - lower(u[0]).component_mul(&below(g[0])) - lower(u[1]).component_mul(&below(g[1])),
            ]
        };
        Load {
            angular: reduced(&angular, [u_1n, u_2n], [g_1n, g_2n]),
            coupling: [left(0, coupling[0]), left(1, coupling[1]), left(2, coupling[2])],
            linear: reduced(&linear, [u_1f, u_2f], [g_1f, g_2f]),
            torque: n - u_1n * e_1 - u_2n * e_2,
            force: f - u_1f * e_1 - u_2f * e_2,
        }
    }
}
