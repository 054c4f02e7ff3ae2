//! Conditions are paired: everything that the dial does not change has the same bits in every world of a tree.

use orchard_fruit::Fruit;
use orchard_scenario::Scenario;
use orchard_tasks::harvest::WorldFactory;
use orchard_tasks::harvest::episode::EpisodeKey;
use orchard_tasks::harvest::{Extent, Harvest};
use orchard_world::World;

const TREES: [(u64, u32); 2] = [(20250704, 0), (20250706, 3)];

struct Conditions {
    harvest: Harvest,
    keys: Vec<EpisodeKey>,
}

impl Conditions {
    fn new() -> Self {
        let harvest = Harvest::new(Scenario::of(&[]).unwrap()).unwrap();
        let conditions = ["nominal", "foliage", "fruit", "terrain", "exhaustion"];
        let extent = Extent {
            profile: "full".into(),
            conditions: conditions.map(str::to_owned).into(),
            seeds: TREES.map(|(seed, _)| seed).into(),
            trees: 4,
            repeats: 1,
            horizon_s: 1.0,
        };
        let keys = harvest.plan_of(extent).unwrap().episodes();
        Self { harvest, keys }
    }

    fn world(&self, condition: &str, (seed, world): (u64, u32)) -> World {
        let of =
            |key: &&EpisodeKey| (key.condition.as_str(), key.seed, key.world) == (condition, seed, world);
        self.harvest.build(self.keys.iter().find(of).unwrap()).unwrap().0
    }
}

/// All properties of the fruit.
fn fruit(world: &World) -> Vec<Fruit> {
    world.fruit().fruit.clone()
}

#[test]
fn dials_leave_the_tree_and_the_start_as_they_are() {
    let conditions = Conditions::new();
    let names: std::collections::BTreeSet<&str> =
        conditions.keys.iter().map(|key| key.condition.as_str()).collect();
    assert_eq!(names.len(), 11);
    for tree in TREES {
        let nominal = conditions.world("nominal", tree);
        for name in &names {
            let world = conditions.world(name, tree);
            assert!(world.skeleton().segments == nominal.skeleton().segments, "{name}: other wood");
            let same_leaves = world.skeleton().leaves == nominal.skeleton().leaves;
            assert_eq!(same_leaves, !name.starts_with("foliage"), "{name}: leaves");
            let place = |world: &World| {
                let x = world.x_world_odom();
                (x.translation.vector.xy(), x.rotation.euler_angles().2)
            };
            if !name.starts_with("terrain") {
                assert_eq!(world.x_world_odom(), nominal.x_world_odom(), "{name}");
            }
            assert_eq!(place(&world).0, place(&nominal).0, "{name}");
            if !name.starts_with("fruit") {
                assert!(fruit(&world) == fruit(&nominal), "{name}: other fruit");
            }
        }
    }
}

/// A tree that is asked for more fruit keeps those that it had.
#[test]
fn fruit_are_added_and_none_is_moved() {
    let conditions = Conditions::new();
    for tree in TREES {
        let [few, nominal, many] =
            ["fruit-20", "nominal", "fruit-60"].map(|name| fruit(&conditions.world(name, tree)));
        assert_eq!((few.len(), nominal.len()), (20, 40));
        assert!(many.len() > 40, "{}", many.len());
        assert!(few.iter().all(|fruit| nominal.contains(fruit)));
        assert!(nominal.iter().all(|fruit| many.contains(fruit)));
    }
}

#[test]
fn what_is_no_condition_is_told() {
    let conditions = Conditions::new();
    let key = EpisodeKey { condition: "windy".into(), ..conditions.keys[0].clone() };
    let reason = conditions.harvest.build(&key).err().unwrap();
    assert_eq!(reason, "no condition windy");
}
