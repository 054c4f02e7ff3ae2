//! Stems: the load on the branch, both paths of detachment, and falling fruit.

use orchard_fruit::{Fruit, FruitGroups, FruitLives, FruitSet, LooseEvent, Phase, RestRule, Touch};
use orchard_geometry::{Pose, Vec3, rotation_from_z};
use orchard_multibody::{Data, Groups, Model, ModelBuilder, StepReport, StepSettings, equilibrium, step};
use orchard_spec::Spec;
use orchard_treegen::{Segment, Skeleton};
use orchard_treephys::{Rupture, TreeBody, TreeGroups, step_settings};

/// A trunk with one horizontal twig that bears one fruit at its tip.
struct Spur {
    spec: Spec,
    model: Model,
    data: Data,
    tree: TreeBody,
    fruit: FruitSet,
    state: FruitLives,
    settings: StepSettings,
}

const TWIG: f64 = 0.2;
const RADIUS: f64 = 0.03;

fn skeleton() -> Skeleton {
    let segment = |parent, p_base_world, direction: Vec3, length, radius, order| Segment {
        parent,
        p_base_world,
        r_world_segment: rotation_from_z(&direction),
        length,
        radius,
        order,
    };
    Skeleton {
        segments: vec![
            segment(None, Vec3::zeros(), Vec3::z(), 2.0, 0.03, 0),
            segment(Some(0), Vec3::new(0.0, 0.0, 2.0), Vec3::x(), TWIG, 0.006, 2),
        ],
        fruit_sites: Vec::new(),
        leaves: Vec::new(),
        spurs: Vec::new(),
    }
}

impl Spur {
    fn new(spec: Spec, strength: f64, bears: bool) -> Self {
        let skeleton = skeleton();
        let mut builder = ModelBuilder::new();
        let none = Groups::NONE;
        let tree =
            TreeBody::add_to(&mut builder, &skeleton, &spec.wood, TreeGroups { wood: none, debris: none });
        let apple = Fruit {
            segment: 1,
            site: 0,
            p_segment: Vec3::new(0.0, 0.0, TWIG),
            p_hang_world: Vec3::new(TWIG, 0.0, 2.0 - spec.fruit.stem_length.si() - RADIUS),
            radius: RADIUS,
            mass: 0.16,
            detach_force: strength,
            twist_strength: f64::INFINITY,
            spur_strength: f64::INFINITY,
        };
        let fruit = FruitSet::add_to(
            &mut builder,
            if bears { vec![apple] } else { Vec::new() },
            &tree.bodies,
            &skeleton,
            &spec.fruit,
            spec.sim.gravity.si(),
            FruitGroups { hanging: none, loose: none, passed: none },
        );
        let model = builder.build().unwrap();
        let mut data = Data::new(&model);
        tree.reset(&model, &mut data, &spec.wood);
        fruit.reset(&model, &mut data);
        let settings = step_settings(&spec.sim);
        equilibrium(&model, &mut data, &settings.gravity, 1e-14).unwrap();
        let state = FruitLives::new(&fruit);
        Self { spec, model, data, tree, fruit, state, settings }
    }

    fn frame(&mut self) -> Vec<LooseEvent> {
        let identity = Pose::identity();
        for _ in 0..self.spec.sim.substeps.get() {
            step(&self.model, &mut self.data, &self.settings, &mut StepReport::default());
            let h = self.settings.h;
            self.state.end_substep(&self.fruit, &self.model, &mut self.data, h, &identity, |_| Vec3::zeros());
        }
        let rest = RestRule { speed: 0.0, frames: u32::MAX };
        let touch = [Touch::default()];
        self.state.end_frame(&self.fruit, &self.model, &mut self.data, &self.spec.fruit, &touch, rest, |_| {
            Vec3::zeros()
        })
    }

    /// Pulls with a force for some frames; the frame in which the stem gave way, counted from 1.
    fn pull(&mut self, force: Vec3, frames: u32) -> Option<u32> {
        self.data.point_force_world[0] = force;
        (1..=frames).find(|_| !self.frame().is_empty())
    }
}

/// The paper's rule: at rest the fruit's weight leaves the rest pose as without fruit.
#[test]
fn hanging_fruit_leaves_the_rest_pose_alone() {
    let bearing = Spur::new(Spec::paper(), 20.0, true);
    let bare = Spur::new(Spec::paper(), 20.0, false);
    for (with, without) in bearing.data.q.iter().zip(&bare.data.q) {
        // Round-off of the statics, which stops at steps of 1e-14 rad.
        assert!((with - without).abs() < 1e-12, "{with} against {without}");
    }
    let sag = bearing.data.tether_spring_force(&bearing.model, bearing.fruit.points[0]);
    assert!((sag - Vec3::new(0.0, 0.0, 0.16 * 9.81)).norm() < 1e-9);
}

#[test]
fn direct_pull_detaches_after_its_frames_and_a_tug_does_not() {
    let frames = Spec::paper().fruit.pull_frames.get();
    let pull = |force: f64| Spur::new(Spec::paper(), 20.0, true).pull(Vec3::new(force, 0.0, 0.0), 120);
    assert_eq!(pull(20.5), Some(frames));
    assert_eq!(pull(19.5), None);
}

/// A grip never shows as a body force; the stem's tension alone takes the fruit off, above 1.2 f_detach.
#[test]
fn tension_detaches_above_its_own_threshold() {
    let mut spec = Spec::paper();
    spec.fruit.pull_frames = spec.fruit.pull_frames.with_value(600).unwrap();
    let pull = |force: f64| Spur::new(spec.clone(), 20.0, true).pull(Vec3::new(force, 0.0, 0.0), 240);
    // The fruit's weight adds in quadrature to a sideways pull: sqrt(23.9^2 + 1.57^2) = 23.95 N.
    assert_eq!(pull(23.9), None);
    let frame = pull(25.0).expect("25 N is above 1.2 * 20 N");
    assert!(frame > spec.fruit.tension_frames.get(), "{frame}");
}

#[test]
fn an_infinitely_strong_stem_never_gives_way() {
    let mut spur = Spur::new(Spec::paper(), f64::INFINITY, true);
    assert_eq!(spur.pull(Vec3::new(60.0, 0.0, -60.0), 300), None);
    assert_eq!(spur.state.phase(0), Phase::Hanging);
}

/// A pull bends the spur as the same force at its tip would, up to the cap of the reaction.
#[test]
fn a_pull_loads_the_branch_up_to_the_cap() {
    let bend_under = |force: f64| {
        let mut spur = Spur::new(Spec::paper(), f64::INFINITY, true);
        let before = spur.tree.bending_angle(&spur.model, &spur.data, 1);
        spur.pull(Vec3::new(0.0, 0.0, -force), 300);
        let moment = spur.tree.stiffness[1] * (spur.tree.bending_angle(&spur.model, &spur.data, 1) - before);
        moment / TWIG
    };
    // The arm shortens with the cosine of a bend of some degrees, and gravity turns with it: 1 %.
    assert!((bend_under(4.0) / 4.0 - 1.0).abs() < 0.01, "{}", bend_under(4.0));
    assert!((bend_under(40.0) / 10.0 - 1.0).abs() < 0.02, "{}", bend_under(40.0));
}

/// Loose fruit feels quadratic air drag only: 1 m of fall ends at 4.43 m/s (less than 1 % is lost).
#[test]
fn loose_fruit_falls_like_an_apple() {
    let mut spur = Spur::new(Spec::paper(), 20.0, true);
    spur.data.point_force_world[0] = Vec3::new(0.0, 0.0, -25.0);
    while spur.state.phase(0) == Phase::Hanging {
        spur.frame();
    }
    spur.data.point_force_world[0] = Vec3::zeros();
    spur.data.point_v_world[0] = Vec3::zeros();
    let start = spur.data.point_p_world[0].z;
    let (mut height, mut speed) = (start, 0.0);
    while start - spur.data.point_p_world[0].z < 1.0 {
        (height, speed) = (spur.data.point_p_world[0].z, spur.data.point_v_world[0].norm());
        step(&spur.model, &mut spur.data, &spur.settings, &mut StepReport::default());
    }
    // Speed where the last metre ends, by energy from the last state above it.
    let left = 1.0 - (start - height);
    let landing = (speed * speed + 2.0 * 9.81 * left).sqrt();
    assert!((landing / 4.43 - 1.0).abs() < 0.01, "{landing}");
}

/// A broken twig falls with its fruit: the paper takes the weight off live wood only. A fruit of 0.16 kg on a twig
/// of 19 g that hinges at its base makes the tip fall nearly as a point mass on a massless rod, with the friction
/// of the break at 0.2 of its gravity moment: its angle obeys a'' = (cos(a) - 0.2 r(t)) g / l with the ramp r.
#[test]
fn a_broken_twig_falls_with_its_fruit() {
    let mut spur = Spur::new(Spec::paper(), f64::INFINITY, true);
    let mut rupture = Rupture::new(&spur.tree);
    let wood = spur.spec.wood.clone();
    rupture.break_joint(&spur.tree, &spur.model, &mut spur.data, &wood, 9.81, 1);
    spur.fruit.weigh_on(&mut spur.data, |segment| rupture.is_debris(segment));
    let h = spur.settings.h;
    let steps = (0.15 / h).round() as u32;
    for _ in 0..steps {
        rupture.begin_substep(&spur.tree, &spur.model, &mut spur.data, &wood, h);
        step(&spur.model, &mut spur.data, &spur.settings, &mut StepReport::default());
    }
    let (mut angle, mut rate, dt) = (0.0_f64, 0.0, 1e-5);
    for k in 0..(f64::from(steps) * h / dt) as u32 {
        let ramp = 1.0 + 4.0 * f64::from(k) * dt / 1.5;
        rate += dt * (orchard_geometry::math::cos(angle) - 0.2 * ramp) * 9.81 / TWIG;
        angle += dt * rate;
    }
    let fallen = spur.tree.bending_angle(&spur.model, &spur.data, 1);
    // The stem is a soft spring of 17 ms, the twig has a tenth of the mass, the first substep is first order: 20 %.
    assert!((fallen / angle - 1.0).abs() < 0.2, "{fallen} rad against {angle}");
}
