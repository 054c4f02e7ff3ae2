//! Hangs fruit on a grown tree, pulls at one of them, and prints when its stem gives way.

use orchard_fruit::{FruitGroups, FruitLives, FruitSet, RestRule, Touch, place};
use orchard_geometry::Vec3;
use orchard_multibody::{Data, Groups, ModelBuilder, StepReport, equilibrium, step};
use orchard_spec::Spec;
use orchard_treegen::grow;
use orchard_treephys::{TreeBody, TreeGroups, step_settings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (spec, apart) = (Spec::paper(), Groups::NONE);
    let skeleton = grow(&spec, 1, 0)?; // seed 1, tree 0
    let fruit = place(&spec.fruit, &skeleton, 1, 0);

    let mut builder = ModelBuilder::new();
    let groups = TreeGroups { wood: apart, debris: apart };
    let tree = TreeBody::add_to(&mut builder, &skeleton, &spec.wood, groups);
    let groups = FruitGroups { hanging: apart, loose: apart, passed: apart };
    let gravity = spec.sim.gravity.si(); // [m/s^2]
    let set = FruitSet::add_to(&mut builder, fruit, &tree.bodies, &skeleton, &spec.fruit, gravity, groups);
    let model = builder.build()?;
    let mut data = Data::new(&model);
    tree.reset(&model, &mut data, &spec.wood);
    set.reset(&model, &mut data);
    let settings = step_settings(&spec.sim);
    equilibrium(&model, &mut data, &settings.gravity, 1e-12)?; // tolerance in [rad]

    let mut lives = FruitLives::new(&set);
    let mut report = StepReport::default();
    let untouched = vec![Touch::default(); set.len()]; // no hand, no bucket, no ground
    let rest = RestRule { speed: 0.01, frames: 15 }; // [m/s]
    data.point_force_world[set.points[0].index()] = Vec3::new(0.0, 0.0, -30.0); // [N]
    for frame in 1..=60 {
        for _ in 0..spec.sim.substeps.get() {
            step(&model, &mut data, &settings, &mut report);
        }
        let still = |_: &Vec3| Vec3::zeros(); // velocity of the base
        for event in lives.end_frame(&set, &model, &mut data, &spec.fruit, &untouched, rest, still) {
            println!("frame {frame}: {event:?}");
        }
    }
    Ok(())
}
