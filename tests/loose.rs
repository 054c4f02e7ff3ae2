//! Loose fruit: hand-overs to the engine, flight, landing, piles.

use orchard_camera::picture::{PictureStyle, look_at, picture};
use orchard_fruit::{Ball, Engine, Obstacle, Partner, Phase, Resting};
use orchard_geometry::{Intrinsics, Pose, Vec3, inverse_transform, transform};
use orchard_robot::{Command, RobotModel};
use orchard_spec::Spec;
use orchard_tests::state_hash;
use orchard_world::truth::FruitState;
use orchard_world::{Snapshot, Status, World, WorldEvent};
use std::sync::Arc;

fn world(seed: u64) -> World {
    World::new(Arc::new(Spec::paper()), Arc::new(RobotModel::paper()), seed, 0).unwrap()
}

pub(crate) fn hold() -> Command {
    RobotModel::paper().start_command()
}

fn point(world: &World, fruit: usize) -> usize {
    world.fruit().points[fruit].index()
}

pub(crate) fn motion(world: &World, fruit: usize) -> [Vec3; 3] {
    let (data, point) = (world.data(), point(world, fruit));
    [data.point_p_world[point], data.point_v_world[point], data.point_w_world[point]]
}

/// Takes a fruit off its stem and puts it somewhere with some velocity.
pub(crate) fn put(world: &mut World, fruit: usize, p_world: Vec3, v_world: Vec3, command: &Command) {
    let point = point(world, fruit);
    while world.data().tethered[point] {
        world.data_mut().point_force_world[point] = Vec3::new(0.0, 0.0, 60.0);
        world.step(command);
    }
    let data = world.data_mut();
    data.point_force_world[point] = Vec3::zeros();
    data.point_p_world[point] = p_world;
    data.point_v_world[point] = v_world;
    data.point_w_world[point] = Vec3::zeros();
}

/// A point of the bucket's interior in the world; coordinates from -1 to 1 over its half-extents.
pub(crate) fn in_bucket(world: &World, at: [f64; 3]) -> Vec3 {
    let bucket = world.handle().bucket;
    let p_base = bucket.p_base + Vec3::new(at[0], at[1], at[2]).component_mul(&bucket.half);
    transform(&world.handle().x_world_base(world.data()), &p_base)
}

/// Puts fruit 0.. into the bucket from a little above its rim, one after the other, and waits until all is still.
fn fill_bucket(world: &mut World, count: usize) {
    for i in 0..count {
        // Spread evenly and never one right above another.
        let spread = |step: f64| 0.7 * (2.0 * ((i as f64 + 1.0) * step).fract() - 1.0);
        let at = [spread(0.754_877_666), spread(0.569_840_291), 2.5];
        let p = in_bucket(world, at);
        put(world, i, p, Vec3::zeros(), &hold());
    }
    for _ in 0..600 {
        world.step(&hold());
    }
}

/// Deepest overlap of the fruit with each other, and of their centres with the room that the bucket leaves them \[m\].
fn overlaps(world: &World, fruit: &[usize]) -> f64 {
    let radius = |i: usize| world.fruit().fruit[i].radius;
    let p = |i: usize| motion(world, i)[0];
    let mut deepest = 0.0_f64;
    for (n, &i) in fruit.iter().enumerate() {
        for &k in &fruit[..n] {
            deepest = deepest.max(radius(i) + radius(k) - (p(i) - p(k)).norm());
        }
    }
    deepest
}

/// The worst overlap of a fruit with walls and floor of the bucket \[m\].
fn wall_overlap(world: &World, fruit: &[usize]) -> f64 {
    let bucket = world.handle().bucket;
    let x_world_base = world.handle().x_world_base(world.data());
    let overlap = |&i: &usize| {
        let d = inverse_transform(&x_world_base, &motion(world, i)[0]) - bucket.p_base;
        let radius = world.fruit().fruit[i].radius;
        let walls = (0..2).map(|k| d[k].abs() + radius - bucket.half[k]).fold(f64::NEG_INFINITY, f64::max);
        walls.max(radius - bucket.half.z - d.z)
    };
    fruit.iter().map(overlap).fold(f64::NEG_INFINITY, f64::max)
}

/// A fruit released in the air is handed over to the engine with every bit of its motion, and its momentum
/// then changes by its weight and air drag alone; so it is when handed back.
#[test]
fn momentum_is_kept_at_hand_over() {
    let mut world = world(3);
    let v = Vec3::new(0.7, -0.4, 2.0);
    put(&mut world, 0, Vec3::new(-2.0, 2.0, 1.5), v, &hold());
    let index = point(&world, 0);
    world.data_mut().point_w_world[index] = Vec3::new(3.0, -2.0, 7.0);
    let (gravity, frame, h) = (9.81, 1.0 / 60.0, 1.0 / 180.0);
    let drag = world.fruit().air_drag(0) / world.fruit().fruit[0].mass;
    let loss = world.spec().fruit.rolling_loss.si();
    let mut phases = vec![world.fruit_lives().phase(0)];
    for _ in 0..12 {
        let [_, v, w] = motion(&world, 0);
        world.step(&hold());
        let [_, v_after, w_after] = motion(&world, 0);
        phases.push(world.fruit_lives().phase(0));
        // Weight is exact; the error of drag is the drag on the speed that the weight adds within the frame.
        let tolerance = drag * v.norm().max(v_after.norm()) * gravity * frame * frame + 1e-12;
        let mut expected = v;
        for _ in 0..3 {
            expected -= expected * (drag * expected.norm() * h);
            expected.z -= gravity * h;
        }
        assert!((v_after - expected).norm() < tolerance, "{v_after} {expected}");
        // The model damps implicitly in one step, the engine in four smaller ones: both lie between these.
        let sweep = 1.0 + loss * h / 4.0;
        let [slow, fast] =
            [1.0 / (1.0 + loss * h), 1.0 / (sweep * sweep * sweep * sweep)].map(|x: f64| x * x * x);
        let ratio = w_after.norm() / w.norm();
        assert!((fast - 1e-12..=slow + 1e-12).contains(&ratio), "{ratio}");
        assert!(w_after.cross(&w).norm() < 1e-12 * w.norm_squared(), "the spin turned");
    }
    assert_eq!(phases[0], Phase::InHand);
    assert_eq!(*phases.last().unwrap(), Phase::Free);
}

/// Two worlds differ only in the frame of hand-over of a fruit: at the end of that frame in one of them, the fruit's
/// motion is the same in both to the bit, in flight and while it rolls.
#[test]
fn a_hand_over_changes_no_bit() {
    let of_frames = |frames: u32| {
        let mut spec = Spec::paper();
        spec.fruit.hand_over_frames = spec.fruit.hand_over_frames.with_value(frames).unwrap();
        World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 3, 0).unwrap()
    };
    let radius = of_frames(1).fruit().fruit[0].radius;
    let v = Vec3::new(0.5, -0.3, 0.0);
    let rolling = Vec3::z().cross(&v) / radius;
    for (height, w) in [(1.2, Vec3::new(3.0, -2.0, 7.0)), (0.0, rolling)] {
        // The frame of detachment counts.
        let [mut sooner, mut later] = [8, 9].map(of_frames);
        for world in [&mut sooner, &mut later] {
            put(world, 0, Vec3::new(-2.0, 2.0, radius + height), v, &hold());
            let point = point(world, 0);
            world.data_mut().point_w_world[point] = w;
        }
        while sooner.fruit_lives().phase(0) == Phase::InHand {
            sooner.step(&hold());
            later.step(&hold());
        }
        assert_eq!(sooner.fruit_lives().phase(0), Phase::Free);
        assert_eq!(later.fruit_lives().phase(0), Phase::InHand);
        assert_eq!(motion(&sooner, 0), motion(&later, 0));
        assert!(motion(&sooner, 0)[1].norm() > 0.3 && motion(&sooner, 0)[2].norm() > 1.0);
        sooner.step(&hold());
        later.step(&hold());
        assert!((motion(&sooner, 0)[1] - motion(&later, 0)[1]).norm() < 0.05, "{height}");
    }
}

/// Fingers that close on a fruit which the engine moves take it back into the coupled solve, with every bit of its motion, and
/// then hold it.
#[test]
fn fingers_take_a_fruit_back() {
    let of_range = |range: f64| {
        let mut spec = Spec::paper();
        spec.sim.gravity = spec.sim.gravity.with_value(0.0).unwrap();
        spec.fruit.grasp_range = spec.fruit.grasp_range.with_value(range).unwrap();
        World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 3, 0).unwrap()
    };
    let [mut taking, mut not_yet] = [3.0, 0.0].map(of_range);
    for world in [&mut taking, &mut not_yet] {
        put(world, 0, Vec3::new(-2.0, 2.0, 1.0), Vec3::zeros(), &hold());
        while world.fruit_lives().phase(0) != Phase::Free {
            world.step(&hold());
        }
        let p_tcp = world.handle().x_world_tcp(world.data()).translation.vector;
        let point = point(world, 0);
        let data = world.data_mut();
        data.point_p_world[point] = p_tcp;
        data.point_v_world[point] = Vec3::new(1e-3, -2e-3, 1e-3);
        data.point_w_world[point] = Vec3::new(0.3, 0.2, -0.1);
    }
    let close = Command { finger_q: 0.0, ..hold() };
    while taking.fruit_lives().phase(0) == Phase::Free {
        assert!(taking.frame() < 600, "the fingers never reached it");
        taking.step(&close);
        not_yet.step(&close);
    }
    assert_eq!(taking.fruit_lives().phase(0), Phase::InHand);
    assert_eq!(not_yet.fruit_lives().phase(0), Phase::Free);
    assert_eq!(motion(&taking, 0), motion(&not_yet, 0));
    for _ in 0..60 {
        taking.step(&close);
    }
    assert_eq!(taking.fruit_truth()[0].state, FruitState::Held);
    let squeeze = taking.fruit_bruise(0).peak_squeeze_force;
    assert!(squeeze > 1.0 && squeeze < 500.0, "{squeeze} N");
}

/// More fruit than the bucket holds heap up, and those that roll off are dropped.
#[test]
fn an_overfull_bucket_spills() {
    let mut spec = Spec::paper();
    spec.fruit.count = spec.fruit.count.with_value(80).unwrap();
    spec.fruit.radius = spec.fruit.radius.with_ends(35.0, 35.0).unwrap();
    let mut world = World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 3, 0).unwrap();
    let count = world.fruit().len();
    assert!(count > 70, "{count} fruit");
    fill_bucket(&mut world, count);
    let mut states: Vec<FruitState> = world.fruit_truth().iter().map(|f| f.state).collect();
    let all: Vec<usize> = (0..count).collect();
    let deposited = all.iter().filter(|&&i| states[i] == FruitState::Deposited).count();
    // A random packing of balls fills 0.55 to 0.64 of its volume, less at walls four diameters apart; a heap rises over the rim.
    let half = world.handle().bucket.half;
    let share = deposited as f64 * 4.19 * 0.035 * 0.035 * 0.035 / (8.0 * half.x * half.y * half.z);
    assert!((0.45..0.75).contains(&share), "{deposited} fruit fill {share}");
    assert!(overlaps(&world, &all) < 1e-3, "{}", overlaps(&world, &all));
    assert!(
        states.iter().all(|s| matches!(s, FruitState::Deposited | FruitState::Dropped | FruitState::Loose))
    );
    // A hard start shakes the heap off.
    for frame in 0..600 {
        let speed = if frame < 120 { -1.1 } else { 0.0 };
        world.step(&Command { base_velocity: [speed, 0.0, 0.0], ..hold() });
    }
    states = world.fruit_truth().iter().map(|f| f.state).collect();
    let dropped = states.iter().filter(|s| **s == FruitState::Dropped).count();
    assert!(dropped > 0, "{states:?}");
    let told = world.drain_events().iter().filter(|e| matches!(e, WorldEvent::FruitDropped { .. })).count();
    assert_eq!(told, dropped, "events and states");
    assert_eq!(*world.status(), Status::Running);
}

/// The engine returns the motions that it was given, bit for bit.
#[test]
fn the_engine_takes_motions_as_they_are() {
    let (p, v, w) = (Vec3::new(0.1, 0.2, 1.3), Vec3::new(-1.0 / 3.0, 0.7, 2.2), Vec3::new(0.3, 5.1, -7.7));
    let mut engine = Engine::new(1.0 / 180.0, &Vec3::zeros(), &Spec::paper().sim.loose);
    engine.add_ball(ball(0, p, v, w));
    assert_eq!(engine.motions().collect::<Vec<_>>(), [(0, p, v, w)]);
}

fn ball(fruit: usize, p_world: Vec3, v_world: Vec3, w_world: Vec3) -> Ball {
    Ball {
        fruit,
        radius: 0.03,
        mass: 0.16,
        p_world,
        v_world,
        w_world,
        force_world: Vec3::zeros(),
        quadratic_drag: 0.0,
        rolling_loss: 0.0,
        restitution: 0.3,
        friction: 1.0,
    }
}

/// Two fruit collide off-centre in the engine: linear momentum, and angular momentum with the spins, are kept; the energy
/// of the impact is that of the approach along the normal with the reduced mass, and restitution gives part of it back.
#[test]
fn a_collision_in_the_engine_keeps_momentum() {
    let mut engine = Engine::new(1.0 / 180.0, &Vec3::zeros(), &Spec::paper().sim.loose);
    engine.add_ball(ball(0, Vec3::new(0.0, 0.0, 1.0), Vec3::new(1.0, 0.0, 0.0), Vec3::zeros()));
    engine.add_ball(ball(1, Vec3::new(0.1, 0.02, 1.0), Vec3::new(-0.5, 0.0, 0.0), Vec3::zeros()));
    let momenta = |engine: &Engine| {
        engine.motions().fold((Vec3::zeros(), Vec3::zeros()), |(linear, angular), (_, p, v, w)| {
            let spin = w * (0.4 * 0.16 * 0.03 * 0.03);
            (linear + v * 0.16, angular + p.cross(&(v * 0.16)) + spin)
        })
    };
    let before = momenta(&engine);
    let mut impacts = Vec::new();
    for _ in 0..20 {
        engine.step(|_| Pose::identity());
        impacts.extend(engine.pressing().iter().filter(|p| p.impact.fruit == 0).map(|p| p.impact));
        let after = momenta(&engine);
        assert!((after.0 - before.0).norm() < 1e-12, "linear {after:?} {before:?}");
        // Rapier lets them push before they touch, each at its own surface: the arms of friction differ by the gap, up to
        // the motion of an inner step, a quarter of ours.
        let (gap, impulse) = (1.5 / 720.0, 1.3 * 0.08 * 1.5);
        assert!((after.1 - before.1).norm() < gap * impulse, "angular {after:?} {before:?}");
    }
    assert_eq!(impacts[0].partner, Partner::Fruit(1));
    let n_x = (0.06_f64 * 0.06 - 0.02 * 0.02).sqrt() / 0.06;
    let expected = 0.5 * 0.08 * (1.5 * n_x) * (1.5 * n_x);
    let hardest = impacts.iter().map(|i| i.energy).fold(0.0, f64::max);
    // The normal is that of the step in which they meet, up to a step of 8 mm before they touch.
    assert!((hardest / expected - 1.0).abs() < 0.1, "{hardest} {expected}");
}

/// A fruit that falls on the ground strikes it with the energy of its fall and bounces with the restitution of the config.
#[test]
fn a_fall_has_its_energy() {
    let mut world = world(3);
    let height = 0.8;
    let radius = world.fruit().fruit[0].radius;
    put(&mut world, 0, Vec3::new(-2.0, 2.0, radius + height), Vec3::zeros(), &hold());
    world.drain_events();
    let (mut events, mut apex, mut landed) = (Vec::new(), 0.0_f64, false);
    for _ in 0..120 {
        world.step(&hold());
        events.extend(world.drain_events());
        landed |= events.iter().any(|e| matches!(e, WorldEvent::FruitImpact { .. }));
        if landed {
            apex = apex.max(motion(&world, 0)[0].z - radius);
        }
    }
    let impacts: Vec<f64> = events
        .iter()
        .filter_map(|e| match e {
            WorldEvent::FruitImpact { fruit: 0, energy, partner: Partner::Ground, .. } => Some(*energy),
            _ => None,
        })
        .collect();
    let mass = world.fruit().fruit[0].mass;
    // Semi-implicit Euler falls h / 2 ahead of the parabola, up to the motion of a step is not fallen yet, and drag takes below 1 %.
    let (speed, step) = ((2.0 * 9.81 * height).sqrt(), 9.81 / 180.0);
    let within = |energy: f64| {
        let v = (2.0 * energy / mass).sqrt();
        (0.99 * speed - step..=speed + step).contains(&v)
    };
    assert!(within(impacts[0]), "{impacts:?}");
    assert_eq!(world.fruit_bruise(0).peak_impact_energy, impacts[0]);
    assert_eq!(world.fruit_bruise(0).peak_partner, Some(Partner::Ground));
    assert!(world.fruit_bruise(0).is_bruised(&world.spec().fruit));
    let e = world.spec().fruit.restitution.si();
    assert!((apex / (e * e * height) - 1.0).abs() < 0.15, "bounced {apex} m of {height} m");
    let dropped: Vec<_> = events.iter().filter(|e| matches!(e, WorldEvent::FruitDropped { .. })).collect();
    assert_eq!(dropped.len(), 1);
    assert!(matches!(world.fruit_lives().phase(0), Phase::Asleep(Resting::Ground(_))));
    assert_eq!(world.fruit_truth()[0].state, FruitState::Dropped);
}

/// Forty fruit poured into the bucket lie on each other, sleep and move along with it; those without room lie elsewhere.
#[test]
fn a_bucket_fills_and_rides() {
    let mut world = world(3);
    let count = world.fruit().len();
    assert_eq!(count, 40);
    fill_bucket(&mut world, count);
    let states: Vec<FruitState> = world.fruit_truth().iter().map(|f| f.state).collect();
    let inside: Vec<usize> = (0..count).filter(|&i| states[i] == FruitState::Deposited).collect();
    assert_eq!(inside.len(), count, "{states:?}");
    assert!(overlaps(&world, &inside) < 1e-3, "{}", overlaps(&world, &inside));
    assert!(wall_overlap(&world, &inside) < 1e-3, "{}", wall_overlap(&world, &inside));
    let asleep = |world: &World, i: usize| matches!(world.fruit_lives().phase(i), Phase::Asleep(_));
    let awake: Vec<usize> = (0..count).filter(|&i| !asleep(&world, i)).collect();
    assert!(awake.is_empty(), "awake: {awake:?}");
    world.drain_events();
    let drive = Command { base_velocity: [-0.5, 0.2, 0.6], ..hold() };
    let mut woke = false;
    for frame in 0..360 {
        world.step(&if frame < 180 { drive } else { hold() });
        woke |= inside.iter().any(|&i| !asleep(&world, i));
        assert!(
            wall_overlap(&world, &inside) < 2e-3 || !woke,
            "frame {frame}: {}",
            wall_overlap(&world, &inside)
        );
    }
    assert!(woke);
    let lost = inside.iter().filter(|&&i| world.fruit_truth()[i].state != FruitState::Deposited).count();
    assert!((0..count).all(|i| asleep(&world, i)));
    assert_eq!(lost, 0, "lost on a gentle drive");
}

/// Worlds with a sleeping pile, a fruit in the air and one that rolls continue from their bytes with the same bits, and so do clones.
#[test]
fn snapshots_hold_loose_fruit() {
    let mut run = world(3);
    fill_bucket(&mut run, 6);
    put(&mut run, 6, Vec3::new(-2.0, 2.0, 0.5), Vec3::new(1.0, 0.0, 0.0), &hold());
    let p = in_bucket(&run, [0.0, 0.0, 3.0]);
    put(&mut run, 7, p, Vec3::zeros(), &hold());
    let drive = Command { base_velocity: [0.3, -0.3, 0.5], ..hold() };
    for frame in 0..150 {
        let act = |world: &mut World, frame: usize| world.step(&if frame < 60 { hold() } else { drive });
        if frame % 11 == 0 {
            let bytes = run.snapshot().to_bytes();
            let mut fresh = world(3);
            fresh.restore(&Snapshot::from_bytes(&bytes).unwrap()).unwrap();
            assert!(fresh.snapshot().to_bytes() == bytes);
            let mut twin = run.clone();
            for next in frame..frame + 20 {
                act(&mut fresh, next);
                act(&mut twin, next);
            }
            let mut on = run.clone();
            on.reset();
            on.restore(&run.snapshot()).unwrap();
            for next in frame..frame + 20 {
                act(&mut on, next);
            }
            assert_eq!(state_hash(&fresh), state_hash(&twin), "frame {frame}");
            assert_eq!(state_hash(&on), state_hash(&twin), "frame {frame}");
        }
        act(&mut run, frame);
    }
    assert_eq!(*run.status(), Status::Running);
}

/// A landing on an obstacle ball counts as one on another fruit.
/// A fruit that rolls down a slope rests where the ground ends, and the world goes on; one that falls through the ground stops it.
#[test]
fn a_fruit_that_rolls_off_the_ground_rests_at_its_border() {
    let slope = "[terrain]\nenabled = true\n[terrain.slope]\nangle = { value = 10, range = [0, 45], unit = 'deg', source = 'x' }\n\
                 bearing = { value = 0, range = [-180, 180], unit = 'deg', source = 'x' }";
    let spec = Spec::paper().overlaid("slope", slope.parse().unwrap()).unwrap();
    let extent = spec.sim.plausible_extent.si();
    let start = World::new(Arc::new(spec), Arc::new(RobotModel::paper()), 3, 0).unwrap();
    let mut world = start.clone();
    let radius = world.fruit().fruit[0].radius;
    let height = |x: f64| start.terrain().unwrap().height(x, 0.0).unwrap();
    let downhill = if height(extent - 1.0) < 0.0 { 1.0 } else { -1.0 };
    let x = downhill * (extent - 0.5);
    let p_world = Vec3::new(x, 0.0, height(x) + radius + 0.002);
    put(&mut world, 0, p_world, Vec3::new(downhill, 0.0, 0.0), &hold());
    for _ in 0..120 {
        world.step(&hold());
    }
    assert_eq!(*world.status(), Status::Running);
    let [p, v, _] = motion(&world, 0);
    assert_eq!((p.x, v), (downhill * extent, Vec3::zeros()));
    assert!(matches!(world.fruit_lives().phase(0), Phase::Asleep(Resting::Ground(_))));

    let mut world = start;
    put(&mut world, 0, Vec3::new(0.0, 3.0, -2.0 * extent), Vec3::zeros(), &hold());
    world.step(&hold());
    assert!(matches!(world.status(), Status::Quarantined { .. }), "{:?}", world.status());
}

#[test]
fn obstacles_strike_back() {
    let mut engine = Engine::new(1.0 / 180.0, &Vec3::new(0.0, 0.0, -9.81), &Spec::paper().sim.loose);
    engine.add_ball(ball(0, Vec3::new(0.0, 0.0, 0.2), Vec3::zeros(), Vec3::zeros()));
    let p = Vec3::new(0.0, 0.0, 0.03);
    engine.add_obstacle(Obstacle::ball(9, 0.03, 1.0, &p));
    let mut hardest = 0.0_f64;
    for _ in 0..60 {
        engine.step(|_| Pose::translation(p.x, p.y, p.z));
        for pressing in engine.pressing() {
            assert_eq!(pressing.impact.partner, Partner::Fruit(9));
            hardest = hardest.max(pressing.impact.energy);
        }
    }
    let fall = 0.16 * 9.81 * (0.2 - 0.09);
    assert!((hardest / fall - 1.0).abs() < 0.15, "{hardest} {fall}");
}

/// A picture of a full bucket to look at: `cargo test -p orchard-tests --test loose -- --ignored`, with the file in `PILE_PNG`.
#[test]
#[ignore = "writes a picture for people"]
fn picture_of_a_pile() {
    let mut world = world(3);
    fill_bucket(&mut world, 40);
    let middle = in_bucket(&world, [0.0, 0.0, 0.5]);
    let scene = world.picture_scene();
    let intrinsics = Intrinsics { width: 960, height: 720, fx: 900.0, fy: 900.0, cx: 479.5, cy: 359.5 };
    let x_world_camera = look_at(&(middle + Vec3::new(0.15, -0.75, 0.75)), &middle);
    let image = picture(&scene, &intrinsics, &x_world_camera, &PictureStyle::default());
    let file = std::env::var("PILE_PNG").unwrap_or_else(|_| "pile.png".to_owned());
    std::fs::write(file, orchard_exchange::image_png::write_rgb(&image).unwrap()).unwrap();
}
