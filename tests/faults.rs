//! Faults between the robot and the expert: each is noticed, told by its name, and handled without damage.

use orchard_picker::{Alarm, Event, State};
use orchard_scenario::Scenario;
use orchard_spec::Spec;
use orchard_tasks::harvest::interface::BenchWorld;
use orchard_world::{World, WorldEvent};

/// A tuning seed, on whose tree the expert is known to pick.
const SEED: u64 = 20250704;

/// What came of some seconds of the expert on tree 0 of [`SEED`].
struct Run {
    /// Alarms that begin (true) and end, with their times \[s\].
    alarms: Vec<(f64, Alarm, bool)>,
    /// States that begin, with their times \[s\].
    states: Vec<(f64, State)>,
    /// Events of the world with their times \[s\].
    events: Vec<(f64, WorldEvent)>,
    /// Time \[s\] and force on the hand \[N\] of each frame.
    forces: Vec<(f64, f64)>,
}

fn run(fault: &str, tree: u32, seconds: f64) -> Run {
    let scenario = Scenario::of(&[("controller", "expert")]).expect("built in");
    let spec = match fault {
        "" => Spec::clone(scenario.spec()),
        fault => {
            let text = format!("[fault]\nbase = 'standard'\n{fault}");
            let table = toml::from_str(&text).expect("TOML");
            scenario.spec().overlaid("fault.toml", table).expect("in range")
        }
    };
    let scenario = scenario.with_spec(spec);
    let frame = scenario.spec().sim.frame();
    let mut world = scenario.world(SEED, tree, 0).expect("it grows");
    let mut controller = scenario.controller();
    let (mut events, mut forces) = (Vec::new(), Vec::new());
    let mut seen = 0;
    for k in 0..(seconds / frame).round() as u32 {
        let time = f64::from(k) * frame;
        let command = controller.act(&world.observe());
        World::step(&mut world, &command);
        events.extend(World::drain_events(&mut world).into_iter().map(|event| (time, event)));
        if world.rupture().breaks().len() > seen {
            seen = world.rupture().breaks().len();
            let b = world.rupture().breaks().last().unwrap();
            let p = |i: usize| world.data().x_world_body(world.tree().bodies[i]).translation.vector;
            let sub = world.tree().subtree(b.segment);
            let mass: f64 = sub.iter().map(|&i| world.model().body(world.tree().bodies[i]).inertia.mass).sum();
            let hand = world.handle().x_world_tcp(world.data()).translation.vector;
            println!("BREAK {time:.2} seg {} n {} wood {mass:.3} kg base {:?} last {:?} hand {hand:?} inertia {:.3}", b.segment, sub.len(), p(b.segment), p(*sub.last().unwrap()), b.inertia);
        }
        if seen > 0 && k % 6 == 0 {
            let mut total = orchard_geometry::Vec3::zeros();
            let mut parts = Vec::new();
            for c in &world.report().contacts {
                let is_debris = |id| world.tree().colliders.iter().position(|t| *t == id).is_some_and(|s| world.rupture().is_debris(s));
                let robot = |id| world.handle().colliders.arm.contains(&id) || world.handle().colliders.fingers.iter().flatten().any(|f| *f == id) || world.handle().colliders.base.contains(&id)|| world.handle().colliders.bucket.contains(&id);
                if is_debris(c.a) && robot(c.b) || is_debris(c.b) && robot(c.a) { total += c.force_world; parts.push(c.force_world.norm()); }
            }
            if !parts.is_empty() { println!("TOUCH {time:.2} {:.1} N {parts:.1?}", total.norm()); }
        }
        forces.push((time, world.hand_forces().wrist));
    }
    let told = |event: &Event| match *event {
        Event::Alarm { time, alarm } => Some((time, alarm, true)),
        Event::AlarmEnded { time, alarm } => Some((time, alarm, false)),
        _ => None,
    };
    let entered = |event: &Event| match *event {
        Event::StateChanged { time, state } => Some((time, state)),
        _ => None,
    };
    let record = controller.record();
    Run {
        alarms: record.events.iter().filter_map(told).collect(),
        states: record.events.iter().filter_map(entered).collect(),
        events,
        forces,
    }
}

#[test]
fn measure() {
    let tree: u32 = std::env::var("TREE").unwrap().parse().unwrap();
    let run = run(&std::env::var("FAULT").unwrap(), tree, std::env::var("SECS").unwrap().parse().unwrap());
    println!("alarms {:?}", run.alarms);
    println!("states {:?}", run.states);
    println!("events {:?}", run.events);
    let _ = run.forces.len();
}
