//! `Harvest-v1`: the benchmark's harvest as an episode to learn in.

use orchard_geometry::{Vec3, transform};
use orchard_tasks::harvest::episode::Outcome;
use orchard_tasks::harvest::outcome_of;
use orchard_world::truth::{FruitState, FruitTruth};
use orchard_world::{World, WorldEvent};
use serde::{Deserialize, Serialize};

use crate::interface::{Term, term};
use crate::report::{Ending, TERMS};
use crate::rules::HarvestReward;

/// A harvest under way.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Harvest {
    reachable: Vec<bool>,
    /// Longest episode \[frames\].
    horizon: u32,
    /// Deposits and drops so far.
    settlings: usize,
    /// Fruit that was gripped, that the hand took off, that lay in the bucket.
    gripped: Vec<bool>,
    taken: Vec<bool>,
    deposited: Vec<bool>,
    /// Of the present step: fruit deposited, gripped and taken off for the first time.
    new: [u32; 3],
    /// At the begin of the step: the fruit to approach with its distance, and the fruit under way with theirs \[m\].
    nearest: Option<(usize, f64)>,
    carried: Vec<(usize, f64)>,
}

pub(crate) fn terms(rules: &HarvestReward) -> Vec<Term> {
    vec![
        term("deposit", &rules.deposit),
        term("grip", &rules.grip),
        term("detach", &rules.detach),
        term("approach", &rules.approach),
        term("carry", &rules.carry),
        term("damage", &rules.damage),
    ]
}

impl Harvest {
    pub fn new(world: &World, horizon: u32) -> Self {
        let reachable = world.reachable();
        let none = vec![false; reachable.len()];
        Self {
            horizon,
            settlings: 0,
            gripped: none.clone(),
            taken: none.clone(),
            deposited: none,
            new: [0; 3],
            nearest: None,
            carried: Vec::new(),
            reachable,
        }
    }

    /// The reachable fruit on the tree, each with its distance from the tool \[m\].
    fn hanging(&self, world: &World, fruit: &[FruitTruth]) -> Vec<(usize, f64)> {
        let p_world_tcp = p_world_tcp(world);
        let distance = |i: usize| (i, (fruit[i].p_world - p_world_tcp).norm());
        (0..fruit.len()).filter(|&i| self.reachable[i] && hangs(&fruit[i])).map(distance).collect()
    }

    /// The nearest of them, and their number.
    pub fn goal(&self, world: &World) -> (Option<Vec3>, usize) {
        let fruit = world.fruit_truth();
        let hanging = self.hanging(world, &fruit);
        (nearest(&hanging).map(|(i, _)| fruit[i].p_world), hanging.len())
    }

    pub fn begin_step(&mut self, world: &World) {
        let fruit = world.fruit_truth();
        self.new = [0; 3];
        self.nearest = nearest(&self.hanging(world, &fruit));
        let p_world_bucket = p_world_bucket(world);
        let under_way =
            |&i: &usize| self.taken[i] && matches!(fruit[i].state, FruitState::Held | FruitState::Loose);
        let to_bucket = |i: usize| (i, (fruit[i].p_world - p_world_bucket).norm());
        self.carried = (0..fruit.len()).filter(under_way).map(to_bucket).collect();
    }

    /// Adds a frame with its events; returns how the episode ends with it, if it does.
    pub fn after_frame(&mut self, world: &World, events: &[WorldEvent]) -> Option<Ending> {
        let first = |seen: &mut bool| u32::from(!std::mem::replace(seen, true));
        for event in events {
            match *event {
                WorldEvent::FruitDeposited { fruit, .. } => {
                    self.settlings += 1;
                    self.new[0] += first(&mut self.deposited[fruit]);
                }
                WorldEvent::FruitDropped { .. } => self.settlings += 1,
                WorldEvent::FruitGripped { fruit, .. } => self.new[1] += first(&mut self.gripped[fruit]),
                WorldEvent::FruitDetached { fruit, .. } if world.is_held(fruit) => {
                    self.new[2] += first(&mut self.taken[fruit]);
                }
                _ => {}
            }
        }
        outcome_of(world, &self.reachable, self.settlings, world.frame(), self.horizon).map(|outcome| {
            match outcome {
                Outcome::AllReachablePicked => Ending {
                    outcome: "all_reachable_picked",
                    terminated: true,
                    success: self.completeness(world) >= 1.0,
                },
                Outcome::BudgetSpent => Ending::TIME_OVER,
                Outcome::Stalled => Ending::STALLED,
                Outcome::Quarantined { .. } => Ending::QUARANTINED,
            }
        })
    }

    /// Number of frames after which the harvest may have ended, at the earliest, if nothing touches wood or fruit in them; at least 1.
    pub fn frames_left(&self, world: &World) -> u32 {
        self.horizon.saturating_sub(world.frame()).max(1)
    }

    /// Terms of the step, unweighted, in the order of [`terms`], but for the damage.
    pub fn end_step(&self, world: &World) -> [f64; TERMS] {
        let fruit = world.fruit_truth();
        let (p_world_tcp, p_world_bucket) = (p_world_tcp(world), p_world_bucket(world));
        let nearer = |&(i, before): &(usize, f64), to: &Vec3| before - (fruit[i].p_world - to).norm();
        let approach = self.nearest.iter().map(|start| nearer(start, &p_world_tcp)).sum();
        let carry = self.carried.iter().map(|start| nearer(start, &p_world_bucket)).sum();
        let [deposit, grip, detach] = self.new.map(f64::from);
        [deposit, grip, detach, approach, carry, 0.0]
    }

    /// Fruit that came to rest in the bucket.
    pub fn deposited(&self) -> u32 {
        self.deposited.iter().filter(|d| **d).count() as u32
    }

    /// Reachable fruit that lies in the bucket now, by reachable fruit; 0 if none is reachable.
    pub fn completeness(&self, world: &World) -> f64 {
        let reachable = self.reachable.iter().filter(|r| **r).count();
        let fruit = world.fruit_truth();
        let lies = |(f, reachable): &(&FruitTruth, &bool)| **reachable && f.state == FruitState::Deposited;
        let deposited = fruit.iter().zip(&self.reachable).filter(lies).count();
        if reachable == 0 { 0.0 } else { deposited as f64 / reachable as f64 }
    }

    /// True if the state fits a world.
    pub fn fits(&self, world: &World) -> bool {
        let fruit = world.fruit().len();
        [&self.reachable, &self.gripped, &self.taken, &self.deposited].iter().all(|list| list.len() == fruit)
    }
}

fn nearest(fruit: &[(usize, f64)]) -> Option<(usize, f64)> {
    fruit.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1))
}

fn hangs(fruit: &FruitTruth) -> bool {
    matches!(fruit.state, FruitState::OnTree | FruitState::OnBrokenLimb)
}

pub(crate) fn p_world_tcp(world: &World) -> Vec3 {
    world.handle().x_world_tcp(world.data()).translation.vector
}

fn p_world_bucket(world: &World) -> Vec3 {
    transform(&world.handle().x_world_base(world.data()), &world.handle().bucket.p_base)
}
