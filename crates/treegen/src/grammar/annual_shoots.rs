//! Apple tree of annual shoots: one derivation is one season.
//!
//! A growth unit is the shoot that an apex makes in one season. The leader's shoots are fixed parts of its
//! length; nodes along every shoot bear buds on a phyllotactic spiral, which open a season later (or when
//! pruning allows) as limbs, whose shoots get shorter, or as laterals of short, medium and long shoots.
//! `docs/computation/growth.md` lists the productions and how their parameters were fitted.

use orchard_geometry::math;
use orchard_quantity::Quantity;
use orchard_spec::Stream;
use orchard_spec::tree::annual_shoots::{AnnualShootsSpec, ClassWeights};

use crate::lsystem::{AxisKind, Command, Grammar, Module, Unit};

/// Least length of a shoot and distance of nodes \[m\], for any config.
const LEAST_LENGTH: f64 = 1e-3;

/// Largest number of nodes over the largest number of growth units; beyond it shoots set no buds.
const NODES_A_UNIT: u32 = 16;

/// Length of a first shoot whose branch keeps the drawn angle \[m\].
const STEADY_LENGTH: f64 = 0.1;

/// The grammar of one tree: the parameters drawn once a tree, and the stream for all other draws.
#[derive(Debug, Clone)]
pub struct AnnualShoots<'a> {
    spec: &'a AnnualShootsSpec,
    stream: Stream,
    trunk_radius: f64,
    /// Lengths of the leader's shoots, one a season \[m\].
    leader: Vec<f64>,
    vigour: f64,
    /// Heights along the leader at which limbs stand, from the highest down \[m\].
    limb_heights: Vec<f64>,
    /// Factor on a limb's shoot from the trunk's diameter.
    limb_scale: f64,
    /// Angle that the branches on the leader have more than those of other trees \[rad\].
    tree_angle: f64,
    /// Number of growth units made.
    units: u32,
    /// Number of nodes made.
    nodes: u32,
    /// Length of the leader so far \[m\].
    height: f64,
    /// Length of the leader to its next node \[m\].
    next_node: f64,
}

/// Growing points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Apex {
    /// Tip of the leader.
    Leader {
        /// Season of its next shoot.
        season: u32,
    },
    /// Bud or tip of a branch.
    Branch(Branch),
}

/// Parameters of a branch's growing point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Branch {
    /// Branch order.
    order: u32,
    /// Season of the next derivation.
    season: u32,
    /// Season in which it begins to grow.
    opens: u32,
    /// Length of its next shoot if it is a limb \[m\].
    limb: Option<f64>,
    /// Number of shoots made.
    shoots: u32,
}

impl<'a> AnnualShoots<'a> {
    /// Draws the parameters of one tree.
    pub fn new(spec: &'a AnnualShootsSpec, mut stream: Stream) -> Self {
        let diameter = stream.cut_normal(&spec.trunk_diameter);
        let size = diameter / spec.trunk_diameter.mean_si();
        let allometry = &spec.allometry;
        let scale = |exponent: &Quantity| math::pow(size, exponent.si());
        let vigour = stream.cut_normal(&spec.vigour) * scale(&allometry.vigour_exponent);
        let length = stream.cut_normal(&spec.leader_length) * scale(&spec.leader_exponent);
        let parts: Vec<f64> = spec.leader_shoots.iter().map(|part| stream.cut_normal(part)).collect();
        let whole: f64 = parts.iter().sum();
        let leader: Vec<f64> = parts.iter().map(|part| (length * part / whole).max(LEAST_LENGTH)).collect();
        let zone = length * (spec.limb_zone.si() * scale(&allometry.zone_exponent)).min(1.0);
        let bare_trunk = stream.cut_normal(&spec.bare_trunk).min(zone);
        let most_limbs = f64::from(spec.growth_units_max.get());
        let limbs = stream.cut_normal(&spec.limbs) * scale(&allometry.limbs_exponent);
        let limbs = limbs.round().clamp(0.0, most_limbs);
        let tiers = stream.cut_normal(&spec.limb_tiers).round().clamp(1.0, limbs.max(1.0));
        // The limb zone has as many equal parts as tiers; each tier is at a random height in its part.
        let tier_heights: Vec<f64> = (0..tiers as u32)
            .map(|k| bare_trunk + (zone - bare_trunk) * (f64::from(k) + stream.unit()) / tiers)
            .collect();
        // Every tier has one limb; the other limbs are in random tiers.
        let mut limb_heights: Vec<f64> = (0..limbs as u32)
            .map(|k| if k < tiers as u32 { k } else { stream.integer(0, tiers as u32 - 1) })
            .map(|tier| tier_heights[tier as usize])
            .collect();
        limb_heights.sort_by(|a, b| b.total_cmp(a));
        let tree_angle = stream.cut_normal(&allometry.tree_angle);
        Self {
            spec,
            stream,
            trunk_radius: 0.5 * diameter,
            leader,
            vigour,
            limb_heights,
            limb_scale: scale(&spec.limb_exponent),
            tree_angle,
            units: 0,
            nodes: 0,
            height: 0.0,
            next_node: bare_trunk,
        }
    }

    /// Radius of the trunk's first link \[m\].
    pub fn trunk_radius(&self) -> f64 {
        self.trunk_radius
    }

    /// Random stream, after the tree's own draws.
    pub(crate) fn stream(&mut self) -> &mut Stream {
        &mut self.stream
    }

    fn seasons(&self) -> u32 {
        self.leader.len() as u32
    }

    /// Counts a new growth unit; false if the tree has reached its largest size.
    fn commit(&mut self) -> bool {
        let fits = self.units < self.spec.growth_units_max.get();
        self.units += u32::from(fits);
        fits
    }

    /// True if shoots still set nodes.
    fn sets_nodes(&self) -> bool {
        self.nodes < NODES_A_UNIT.saturating_mul(self.spec.growth_units_max.get())
    }

    /// A bend of random size about a random axis across the heading: `/(p) &(w) /(-p)`, and its inverse.
    fn draw_wobble(&mut self) -> ([Command; 3], [Command; 3]) {
        let phase = self.stream.uniform(0.0, std::f64::consts::TAU);
        let angle = self.stream.uniform(0.0, self.spec.wobble.si());
        let bend = |angle| [Command::Roll(phase), Command::Pitch(angle), Command::Roll(-phase)];
        (bend(angle), bend(-angle))
    }

    /// Distance from one node to the next \[m\].
    fn node_spacing(&mut self, axis: AxisKind) -> f64 {
        let spacing = match axis {
            AxisKind::Leader => &self.spec.leader_nodes,
            AxisKind::Limb => &self.spec.limb_nodes,
            AxisKind::Lateral => &self.spec.lateral_nodes,
        };
        (self.stream.cut_normal(spacing) / self.vigour).max(LEAST_LENGTH)
    }

    /// A node: `/(divergence)`, and unless it is blind `[ &(angle) bud ]`.
    fn node(&mut self, order: u32, season: u32, limb: Option<f64>, successor: &mut Vec<Module<Apex>>) {
        let divergence = self.stream.cut_normal(&self.spec.divergence);
        successor.push(Module::Turtle(Command::Roll(divergence)));
        let blind = self.stream.chance(self.spec.blind_nodes.si()) && limb.is_none();
        self.nodes = self.nodes.saturating_add(1);
        if blind || order >= self.spec.branch_orders.get() {
            return;
        }
        let angle = if order == 1 { &self.spec.branch_angle } else { &self.spec.lateral_angle };
        let angle = self.stream.cut_normal(angle) + if order == 1 { self.tree_angle } else { 0.0 };
        // Laterals that open earlier are pruned away by the last season.
        let last = self.seasons();
        let stands = 1 + self.stream.integer(0, self.spec.lateral_seasons.get().max(1) - 1);
        let opens = if limb.is_some() { season + 1 } else { (season + 1).max(last.saturating_sub(stands)) };
        let bud = Apex::Branch(Branch { order, season: season + 1, opens, limb, shoots: 0 });
        successor.extend([Command::Push, Command::Pitch(angle)].map(Module::Turtle));
        successor.extend([Module::Apex(bud), Module::Turtle(Command::Pop)]);
    }

    /// Production of the leader's tip: its shoot of the season with the nodes on it, and the tip again.
    fn grow_leader(&mut self, season: u32, successor: &mut Vec<Module<Apex>>) {
        let Some(&length) = self.leader.get(season as usize) else { return };
        if !self.commit() {
            return;
        }
        successor.push(unit(season, AxisKind::Leader, false));
        let (bend, unbend) = self.draw_wobble();
        successor.extend(bend.map(Module::Turtle));
        let top = self.height + length;
        let gradient = math::pow(self.spec.limb_gradient.si(), f64::from(season));
        while self.next_node < top && self.sets_nodes() {
            successor.push(Module::Turtle(Command::Forward(self.next_node - self.height)));
            self.height = self.next_node;
            let mut limbs = 0;
            while self.limb_heights.last().is_some_and(|&height| height <= self.height) {
                self.limb_heights.pop();
                let shoot = self.stream.cut_normal(&self.spec.limb_shoot) * self.limb_scale * gradient;
                self.node(1, season, Some(shoot), successor);
                limbs += 1;
            }
            if limbs == 0 {
                self.node(1, season, None, successor);
            }
            self.next_node += self.node_spacing(AxisKind::Leader);
        }
        successor.push(Module::Turtle(Command::Forward(top - self.height)));
        self.height = top;
        // The leader's bend is undone at once: it zigzags about the vertical.
        successor.extend(unbend.map(Module::Turtle));
        successor.push(Module::Apex(Apex::Leader { season: season + 1 }));
    }

    /// Length of a lateral's shoot \[m\].
    fn lateral_shoot(&mut self, weights: &ClassWeights) -> f64 {
        let (short, medium) = (weights.short.si(), weights.medium.si());
        let draw = self.stream.unit();
        let class = if draw < short {
            &self.spec.short_shoot
        } else if draw < short + medium {
            &self.spec.medium_shoot
        } else {
            &self.spec.long_shoot
        };
        self.stream.cut_normal(class).max(LEAST_LENGTH)
    }

    /// Production of a branch's growing point: a shoot with its nodes, and the tip again.
    fn grow_branch(&mut self, branch: Branch, successor: &mut Vec<Module<Apex>>) {
        let Branch { order, season, opens, limb, shoots } = branch;
        let later = Branch { season: season + 1, ..branch };
        if season < opens {
            successor.push(Module::Apex(Apex::Branch(later)));
            return;
        }
        let spec = self.spec;
        let shortest_limb = spec.medium_shoot.ends_si().0.max(LEAST_LENGTH);
        let limb = limb.filter(|&length| length >= shortest_limb);
        let length = match limb {
            Some(length) => length,
            None if shoots == 0 => self.lateral_shoot(&spec.first_shoot),
            None if self.stream.chance(spec.persistence.si()) => self.lateral_shoot(&spec.later_shoot),
            // Its terminal bud aborts.
            None => return,
        };
        if !self.commit() {
            return;
        }
        let floral = if shoots == 0 { &spec.floral_first } else { &spec.floral_later };
        let floral = limb.is_none() && self.stream.chance(floral.si());
        let (bend, _) = self.draw_wobble();
        let droop = self.stream.cut_normal(&spec.droop);
        let axis = if limb.is_some() { AxisKind::Limb } else { AxisKind::Lateral };
        if order == 1 && shoots == 0 {
            let more =
                spec.allometry.angle_by_length.si() * math::ln(length / STEADY_LENGTH) / math::ln(10.0);
            successor.push(Module::Turtle(Command::Pitch(more)));
        }
        successor.push(unit(season, axis, floral));
        successor.extend(bend.map(Module::Turtle));
        successor.push(Module::Turtle(Command::Droop(droop)));
        self.nodes_along(length, axis, order, season, successor);
        let next = limb.map(|length| length * self.stream.cut_normal(&spec.limb_decay));
        if limb.is_some() && self.stream.chance(spec.fork_chance.si()) {
            let fork = length * self.stream.cut_normal(&spec.fork_ratio);
            self.node(order + 1, season, Some(fork), successor);
        }
        let tip = Branch { limb: next, shoots: shoots + 1, ..later };
        successor.push(Module::Apex(Apex::Branch(tip)));
    }

    /// A branch's shoot: pieces between nodes, the last one up to its tip. The buds of a short shoot stay
    /// dormant.
    fn nodes_along(
        &mut self,
        length: f64,
        axis: AxisKind,
        order: u32,
        season: u32,
        successor: &mut Vec<Module<Apex>>,
    ) {
        let mut drawn = 0.0;
        // The first node is at a random position in its interval, so that the number of nodes follows the length.
        let first = self.node_spacing(axis);
        let mut node = first * self.stream.unit();
        let short = length < self.spec.medium_shoot.ends_si().0;
        while node < length && !short && self.sets_nodes() {
            successor.push(Module::Turtle(Command::Forward(node - drawn)));
            drawn = node;
            self.node(order + 1, season, None, successor);
            node += self.node_spacing(axis);
        }
        successor.push(Module::Turtle(Command::Forward(length - drawn)));
    }
}

/// The command that begins a growth unit. Trees are far younger than 255 seasons.
fn unit(season: u32, axis: AxisKind, floral: bool) -> Module<Apex> {
    Module::Turtle(Command::Unit(Unit { season: u8::try_from(season).unwrap_or(u8::MAX), axis, floral }))
}

impl Grammar for AnnualShoots<'_> {
    type Apex = Apex;

    /// One derivation a season.
    fn derivations(&self) -> u32 {
        self.seasons()
    }

    /// `/(phase) Leader`
    fn axiom(&mut self) -> Vec<Module<Apex>> {
        let phase = self.stream.uniform(0.0, std::f64::consts::TAU);
        vec![Module::Turtle(Command::Roll(phase)), Module::Apex(Apex::Leader { season: 0 })]
    }

    fn grow(&mut self, apex: Apex, successor: &mut Vec<Module<Apex>>) {
        match apex {
            Apex::Leader { season } => self.grow_leader(season, successor),
            Apex::Branch(branch) => self.grow_branch(branch, successor),
        }
    }
}
