//! The state of every fruit of one tree, and what it does to the model. The rules are in [`crate::life`].

use crate::bruise::{Bruise, Partner};
use crate::life::{FruitState, HandOver, Life, LooseEvent, Phase, RestRule, Resting, Touch};
use crate::{FruitSet, Impact};
use orchard_geometry::{Pose, Vec3, transform};
use orchard_multibody::{Data, Model};
use orchard_spec::fruit::FruitSpec;
use serde::{Deserialize, Serialize};

/// The state of every fruit of one tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FruitLives {
    lives: Vec<Life>,
    frame_peak: f64,
    peak: f64,
}

impl FruitLives {
    /// All fruit of a tree on their stems.
    pub fn new(set: &FruitSet) -> Self {
        Self { lives: vec![Life::hanging(); set.len()], frame_peak: 0.0, peak: 0.0 }
    }

    /// True if this is the state of as many fruit as the set has.
    pub fn fits(&self, set: &FruitSet) -> bool {
        let partner_fits = |p: &Partner| !matches!(p, Partner::Fruit(i) if *i >= set.len());
        let bruise_fits = |life: &Life| life.bruise.peak_partner.iter().all(partner_fits);
        self.lives.len() == set.len() && self.lives.iter().all(bruise_fits)
    }

    /// Phase of a fruit.
    pub fn phase(&self, fruit: usize) -> Phase {
        self.lives[fruit].phase
    }

    /// State of a fruit as a benchmark counts it. `on_broken_limb`: its segment is debris; `held`: both fingers touch it.
    pub fn state(&self, fruit: usize, on_broken_limb: bool, held: bool) -> FruitState {
        self.lives[fruit].state(on_broken_limb, held)
    }

    /// True if any fruit is off its stem.
    pub fn any_off_stem(&self) -> bool {
        self.lives.iter().any(|life| life.phase != Phase::Hanging)
    }

    /// True if any fruit is moved by the rigid-body engine.
    pub fn any_free(&self) -> bool {
        self.lives.iter().any(|life| life.phase == Phase::Free)
    }

    /// True if all fruit hang or sleep on the ground, and none counts frames over a limit or has met something that is not told yet.
    pub fn are_calm(&self) -> bool {
        self.lives.iter().all(Life::is_calm)
    }

    /// Ends a frame in which fruit hung or slept on the ground and no stem came near a limit; `tension` is the largest of their stems' \[N\].
    pub fn end_calm_frame(&mut self, tension: f64) {
        (self.frame_peak, self.peak) = (0.0, tension);
    }

    /// True if a fruit has touched the ground since it left its stem, or since it last lay in the bucket.
    pub fn has_dropped(&self, fruit: usize) -> bool {
        self.lives[fruit].dropped
    }

    /// True if a fruit lies in the bucket and has come to rest there.
    pub fn is_deposited(&self, fruit: usize) -> bool {
        self.lives[fruit].deposited
    }

    /// True if a fruit has been quiet for as long as the rest rule asks.
    pub fn is_quiet(&self, fruit: usize, rest: RestRule) -> bool {
        self.lives[fruit].is_quiet(rest)
    }

    /// Hardest impact and squeeze of a fruit so far.
    pub fn bruise(&self, fruit: usize) -> Bruise {
        self.lives[fruit].bruise
    }

    /// Largest stem tension of any fruit in the latest whole frame \[N\].
    pub fn peak_tension(&self) -> f64 {
        self.peak
    }

    /// Notes a pressing contact of a substep with something hard; the energy \[J\] is that of the approach before it.
    /// `z_world` is the height of the fruit's centre \[m\].
    pub fn strike(&mut self, fruit: usize, partner: Partner, energy: f64, z_world: f64) {
        self.lives[fruit].strike(partner, energy, z_world);
    }

    /// Notes the normal force of one finger on a fruit in a substep \[N\].
    pub fn squeeze(&mut self, fruit: usize, force: f64) {
        self.lives[fruit].bruise.squeeze(force);
    }

    /// Shares of the lives of zone and spur of a fruit's stem that have passed.
    pub fn wear(&self, fruit: usize) -> [f64; 2] {
        self.lives[fruit].stem.wear()
    }

    /// Sets these shares of each fruit; none leave them as they are.
    pub fn set_wear(&mut self, wear: &[[f64; 2]]) {
        self.lives.iter_mut().zip(wear).for_each(|(life, wear)| life.stem.set_wear(*wear));
    }

    /// Puts a fruit to sleep where it is.
    pub fn sleep(&mut self, fruit: usize, resting: Resting) {
        self.lives[fruit].sleep(resting);
    }

    /// Takes a fruit that has come to rest in the bucket off the field for good, and keeps it at a point of the world \[m\].
    pub fn take_away(&mut self, set: &FruitSet, data: &mut Data, fruit: usize, p_world: Vec3) {
        self.lives[fruit].take_away(p_world);
        let point = set.points[fruit].index();
        data.point_p_world[point] = p_world;
        data.point_v_world[point] = Vec3::zeros();
        data.point_w_world[point] = Vec3::zeros();
    }

    /// Wakes a sleeping fruit on the field.
    pub fn wake(&mut self, fruit: usize) {
        self.lives[fruit].wake();
    }

    /// Ends a substep of length `h` \[s\], by which stems wear: notes stem tensions, and holds sleeping fruit at its place; fruit on the base moves with it.
    pub fn end_substep(
        &mut self,
        set: &FruitSet,
        model: &Model,
        data: &mut Data,
        h: f64,
        x_world_base: &Pose,
        base_velocity: impl Fn(&Vec3) -> Vec3,
    ) {
        for (i, life) in self.lives.iter_mut().enumerate() {
            match life.phase {
                Phase::Hanging => {
                    let tension = match &set.stems {
                        None => data.tether_spring_force(model, set.points[i]).norm(),
                        Some(stems) => {
                            let load = stems.load(model, data, i, set.points[i]);
                            let rule = &stems.spec.release;
                            life.stem.bear(&load, &set.fruit[i], rule, h);
                            load.tension
                        }
                    };
                    self.frame_peak = self.frame_peak.max(tension);
                }
                Phase::InHand | Phase::Free => {}
                Phase::Asleep(resting) => {
                    let point = set.points[i].index();
                    (data.point_p_world[point], data.point_v_world[point]) = match resting {
                        Resting::Base(p_base) => {
                            let p_world = transform(x_world_base, &p_base);
                            (p_world, base_velocity(&p_world))
                        }
                        Resting::Ground(p_world) | Resting::Away(p_world) => (p_world, Vec3::zeros()),
                    };
                }
            }
        }
    }

    /// Ends a frame: tests the two detachment paths of hanging fruit and the rest rule of loose fruit.
    ///
    /// `touch` is per fruit; `base_velocity` gives the velocity of a point of the base, both in the world [m, m/s].
    #[expect(clippy::too_many_arguments, reason = "one call a frame, each input a different kind of thing")]
    pub fn end_frame(
        &mut self,
        set: &FruitSet,
        model: &Model,
        data: &mut Data,
        spec: &FruitSpec,
        touch: &[Touch],
        rest: RestRule,
        base_velocity: impl Fn(&Vec3) -> Vec3,
    ) -> Vec<LooseEvent> {
        let mut events = Vec::new();
        self.peak = std::mem::take(&mut self.frame_peak);
        for (i, life) in self.lives.iter_mut().enumerate() {
            let point = set.points[i].index();
            if let Some((partner, energy)) = life.take_struck()
                && energy > spec.impact_floor.si()
            {
                events.push(LooseEvent::Struck(Impact { fruit: i, partner, energy }));
            }
            let (p_world, v_world) = (data.point_p_world[point], data.point_v_world[point]);
            if life.phase == Phase::Hanging {
                let come_off = match &set.stems {
                    None => {
                        let tension = data.tether_spring_force(model, set.points[i]).norm();
                        let pull = data.point_force_world[point].norm();
                        let threshold = set.fruit[i].detach_force;
                        life.load_stem(spec, pull, tension, threshold, &p_world).then_some((None, tension))
                    }
                    Some(_) => life.come_off(&p_world).map(|(release, tension)| (Some(release), tension)),
                };
                if let Some((release, tension)) = come_off {
                    set.detach(data, i);
                    events.push(LooseEvent::Detached { fruit: i, tension, release });
                }
                continue;
            }
            let v_support = if touch[i].on_base { base_velocity(&p_world) } else { Vec3::zeros() };
            life.judge(i, &touch[i], rest, &p_world, &v_world, &v_support, &mut events);
        }
        events
    }

    /// Hands loose fruit over between the coupled solve and the rigid-body engine, with its position, velocity and spin bit
    /// for bit. Called after [`FruitLives::end_frame`] in worlds with an engine.
    pub fn hand_over(&mut self, set: &FruitSet, data: &mut Data, spec: &FruitSpec, touch: &[Touch]) {
        for (i, life) in self.lives.iter_mut().enumerate() {
            match life.end_frame_off_stem(spec, &touch[i]) {
                None => {}
                Some(HandOver::ToEngine) => set.pass_to_engine(data, i),
                Some(HandOver::ToHand) => set.take_back(data, i),
            }
        }
    }
}
