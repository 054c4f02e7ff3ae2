//! Stems that bend, twist and pull taut.

use orchard_fruit::{Fruit, FruitGroups, FruitLives, FruitSet, LooseEvent, Release, RestRule, Touch};
use orchard_geometry::{Pose, Vec3, math, rotation_from_z};
use orchard_multibody::{
    BodyId, Data, Groups, Model, ModelBuilder, StepReport, StepSettings, energy, equilibrium, step,
};
use orchard_spec::{Preset, Spec};
use orchard_treegen::{Segment, Skeleton};
use orchard_treephys::{TreeBody, TreeGroups, step_settings};
use std::f64::consts::{FRAC_PI_2, TAU};

const RADIUS: f64 = 0.0375;
const PULL: f64 = 20.0;
const TWIST: f64 = 0.1;

/// A fruit of 75 mm on a twig that nothing bends.
struct Hung {
    spec: Spec,
    model: Model,
    data: Data,
    fruit: FruitSet,
    lives: FruitLives,
    settings: StepSettings,
}

impl Hung {
    fn new() -> Self {
        let mut spec = Spec::preset(Preset::Calibrated);
        spec.wood.rigid = true;
        let skeleton = Skeleton {
            segments: vec![Segment {
                parent: None,
                p_base_world: Vec3::new(0.0, 0.0, 2.0),
                r_world_segment: rotation_from_z(&Vec3::x()),
                length: 0.2,
                radius: 0.006,
                order: 2,
            }],
            fruit_sites: Vec::new(),
            leaves: Vec::new(),
            spurs: Vec::new(),
        };
        let none = Groups::NONE;
        let mut builder = ModelBuilder::new();
        let tree =
            TreeBody::add_to(&mut builder, &skeleton, &spec.wood, TreeGroups { wood: none, debris: none });
        let arm = spec.fruit.stem_length.si() + RADIUS;
        let apple = Fruit {
            segment: 0,
            site: 0,
            p_segment: Vec3::new(0.0, 0.0, 0.2),
            p_hang_world: Vec3::new(0.2, 0.0, 2.0 - arm),
            radius: RADIUS,
            mass: 0.2,
            detach_force: PULL,
            twist_strength: TWIST,
            spur_strength: 1e3,
        };
        let groups = FruitGroups { hanging: none, loose: none, passed: none };
        let gravity = spec.sim.gravity.si();
        let fruit = FruitSet::add_to(
            &mut builder,
            vec![apple],
            &tree.bodies,
            &skeleton,
            &spec.fruit,
            gravity,
            groups,
        );
        let model = builder.build().unwrap();
        let mut data = Data::new(&model);
        fruit.reset(&model, &mut data);
        let (lives, settings) = (FruitLives::new(&fruit), step_settings(&spec.sim));
        Self { spec, model, data, fruit, lives, settings }
    }

    fn stem(&self) -> BodyId {
        self.fruit.stem(0).expect("a stem")
    }

    fn frame(&mut self) -> Option<Release> {
        let still = |_: &Vec3| Vec3::zeros();
        for _ in 0..self.spec.sim.substeps.get() {
            step(&self.model, &mut self.data, &self.settings, &mut StepReport::default());
            let h = self.settings.h;
            self.lives.end_substep(&self.fruit, &self.model, &mut self.data, h, &Pose::identity(), still);
        }
        let rest = RestRule { speed: 0.0, frames: u32::MAX };
        let touch = [Touch::default()];
        let events = self.lives.end_frame(
            &self.fruit,
            &self.model,
            &mut self.data,
            &self.spec.fruit,
            &touch,
            rest,
            still,
        );
        events.into_iter().find_map(|event| match event {
            LooseEvent::Detached { release, .. } => release,
            _ => None,
        })
    }

    /// Loads that grow at the given rates [N/s, N m/s] until the fruit comes off: how it did, and the loads then.
    fn load(&mut self, pull: Vec3, torque: f64) -> Option<(Release, Vec3, f64)> {
        let frame = self.spec.sim.frame();
        let spec = self.spec.sim.gravity.si() * self.fruit.fruit[0].mass;
        // The weight is borne, and the swing into the pull's direction is damped, so that the pull alone counts.
        let dofs = self.model.dofs(self.stem());
        self.data.damping[dofs].iter_mut().take(2).for_each(|damping| *damping *= 20.0);
        let lift = Vec3::new(0.0, 0.0, spec);
        for k in 1..2000 {
            let time = f64::from(k) * frame;
            self.data.point_force_world[0] = lift + pull * time;
            let axis = self.data.x_world_body(self.stem()).rotation * Vec3::z();
            let stem = self.stem().index();
            self.data.body_torque_world[stem] = axis * (torque * time);
            if let Some(release) = self.frame() {
                return Some((release, pull * time, torque * time));
            }
        }
        None
    }
}

/// The compound pendulum of reference.json, dyn.pendulum: 1.86 Hz within 3 %, along both axes.
#[test]
fn a_fruit_swings_as_a_compound_pendulum() {
    let mut hung = Hung::new();
    let arm = hung.spec.fruit.stem_length.si() + RADIUS;
    let exact = (9.80665 * arm / (arm * arm + 0.4 * RADIUS * RADIUS)).sqrt() / TAU;
    assert!((exact - 1.864).abs() < 1e-3, "{exact}");
    for push in [Vec3::x(), Vec3::y()] {
        let start = hung.data.clone();
        hung.data.point_v_world[0] = push * (0.05 * arm * exact * TAU);
        let omega = (-Vec3::z()).cross(&push) * (0.05 * exact * TAU);
        let in_stem = hung.data.x_world_body(hung.stem()).rotation.inverse() * omega;
        let dofs = hung.model.dofs(hung.stem());
        hung.data.v[dofs].copy_from_slice(in_stem.as_slice());
        let mut crossings = Vec::new();
        let mut before = 0.0;
        for k in 1..1800 {
            step(&hung.model, &mut hung.data, &hung.settings, &mut StepReport::default());
            let now = (hung.data.point_p_world[0] - Vec3::new(0.2, 0.0, 2.0)).dot(&push);
            if before < 0.0 && now >= 0.0 {
                crossings.push((f64::from(k) - now / (now - before)) * hung.settings.h);
            }
            before = now;
        }
        let swings = (crossings.len() - 1) as f64;
        let measured = swings / (crossings[crossings.len() - 1] - crossings[0]);
        assert!((measured / exact - 1.0).abs() < 0.03, "{measured} Hz against {exact}");
        hung.data = start;
    }
}

/// Loads along the axis, across it and about it come off at their own strengths, each as its own mode, at the rate that the
/// strengths are stated for: u grows as t / T, so that the life is used up when `T / (n + 1) u^(n + 1) = t_hold`.
#[test]
fn each_mode_gives_way_at_its_own_strength() {
    let rule = Spec::preset(Preset::Calibrated).fruit.stem.unwrap().release;
    let (n, hold) = (rule.rate_exponent.si(), rule.hold_time.si());
    // Load over strength at release where the load reaches its strength after a time.
    let expected = |time: f64| math::pow(hold * (n + 1.0) / time, 1.0 / (n + 1.0));
    for (pull, torque, strength, mode) in [
        (Vec3::new(0.0, 0.0, -10.0), 0.0, PULL, Release::Pull),
        (Vec3::new(0.0, 5.0, 0.0), 0.0, PULL * rule.bent.si(), Release::Bend),
        (Vec3::new(5.0, 0.0, 0.0), 0.0, PULL * rule.bent.si(), Release::Bend),
        (Vec3::zeros(), 0.05, TWIST, Release::Twist),
    ] {
        let (release, force, turn) = Hung::new().load(pull, torque).expect("it comes off");
        assert_eq!(release, mode);
        let (load, rate) = if torque > 0.0 { (turn, torque) } else { (force.norm(), pull.norm()) };
        let ratio = load / strength / expected(strength / rate);
        // A frame's growth of the load is up to 2 % of it.
        assert!((ratio - 1.0).abs() < 0.04, "{mode:?}: {load} of {strength}, ratio {ratio}");
    }
}

/// A slow pull comes off near the strength; ten times the rate takes `10^(1 / (n + 1))` times the force.
#[test]
fn strength_grows_with_the_rate() {
    let at = |rate: f64| Hung::new().load(Vec3::new(0.0, 0.0, -rate), 0.0).unwrap().1.norm();
    let n = Spec::preset(Preset::Calibrated).fruit.stem.unwrap().release.rate_exponent.si();
    let (slow, fast) = (at(2.0), at(20.0));
    assert!((fast / slow / math::pow(10.0, 1.0 / (n + 1.0)) - 1.0).abs() < 0.02, "{slow} {fast}");
    assert!((slow / PULL - 1.0).abs() < 0.1, "{slow}");
}

/// Pushing a fruit up against its spur loads nothing.
#[test]
fn a_pushed_stem_bears_no_tension() {
    let mut hung = Hung::new();
    hung.data.point_force_world[0] = Vec3::new(0.0, 0.0, 60.0);
    let up = (0..3).find_map(|_| hung.frame());
    assert_eq!(up, None);
    assert_eq!(hung.fruit.stem_load(&hung.model, &hung.data, 0).unwrap().tension, 0.0);
}

/// Off its stem a fruit keeps its spin and its velocity, and falls.
#[test]
fn a_fruit_keeps_its_motion_when_it_comes_off() {
    let mut hung = Hung::new();
    hung.load(Vec3::new(0.0, 10.0, 0.0), 0.0).unwrap();
    let stem = hung.data.velocity(hung.stem()).angular;
    assert!(stem.norm() > 0.0);
    assert_eq!(hung.data.point_w_world[0], stem);
    hung.data.point_force_world[0] = Vec3::zeros();
    let height = hung.data.point_p_world[0].z;
    (0..30).for_each(|_| {
        hung.frame();
    });
    assert!(height - hung.data.point_p_world[0].z > 0.5);
}

/// Bent and twisted far, a fruit on an undamped stem loses energy to the first order of the step only.
#[test]
fn a_swinging_and_twisting_fruit_keeps_its_energy() {
    let drift = |h: f64| {
        let mut hung = Hung::new();
        hung.data.damping.fill(0.0);
        let (stem, dofs) = (hung.stem(), hung.model.dofs(hung.stem()));
        hung.data.v[dofs].copy_from_slice(&[9.0, 4.0, 12.0]);
        orchard_multibody::forward_kinematics(&hung.model, &mut hung.data);
        let velocity = hung.data.point_velocity_world(stem, &hung.data.point_p_world[0]);
        hung.data.point_v_world[0] = velocity;
        let gravity = hung.settings.gravity;
        let settings = StepSettings { h, ..hung.settings };
        let start = energy(&hung.model, &hung.data, &gravity);
        let mut most_bend: f64 = 0.0;
        for _ in 0..(0.6 / h) as u32 {
            step(&hung.model, &mut hung.data, &settings, &mut StepReport::default());
            most_bend = most_bend.max(hung.data.deflection(&hung.model, stem).unwrap().bend.norm());
        }
        assert!(most_bend > 0.5 * FRAC_PI_2, "{most_bend}");
        (energy(&hung.model, &hung.data, &gravity).total() - start.total()) / start.kinetic
    };
    // What is left at small steps is the loss of the damper along the stem, which the start shakes.
    let [coarse, fine, finest] = [720.0, 2880.0, 11520.0].map(|rate: f64| drift(1.0 / rate));
    assert!(finest < 0.0 && finest > -0.05, "{finest}");
    let order = (coarse - fine) / (fine - finest);
    assert!((order - 4.0).abs() < 1.0, "{coarse} {fine} {finest}");
}

/// A fruit that was drawn too weak to hang gets twice the strength that its weight takes, and hangs; one that is strong enough keeps its own.
#[test]
fn a_fruit_that_hangs_is_no_weaker_than_its_weight() {
    for (drawn, is_raised) in [(1.9, true), (PULL, false)] {
        let mut hung = Hung::new();
        let weight = hung.spec.sim.gravity.si() * hung.fruit.fruit[0].mass;
        hung.fruit.fruit[0].detach_force = drawn;
        equilibrium(&hung.model, &mut hung.data, &hung.settings.gravity, 1e-12).unwrap();
        hung.fruit.strengthen_to_hang(&hung.model, &hung.data);
        let apple = hung.fruit.fruit[0].clone();
        let (strength, twist) =
            if is_raised { (2.0 * weight, TWIST * 2.0 * weight / drawn) } else { (drawn, TWIST) };
        assert!((apple.detach_force / strength - 1.0).abs() < 1e-6, "{}", apple.detach_force);
        assert!((apple.twist_strength / twist - 1.0).abs() < 1e-6, "{}", apple.twist_strength);
        assert_eq!(apple.spur_strength, 1e3);
        assert_eq!((0..60).find_map(|_| hung.frame()), None);
        hung.fruit.fruit[0].detach_force = 1.9;
        assert!((0..60).find_map(|_| hung.frame()).is_some(), "so weak a fruit falls");
    }
}
