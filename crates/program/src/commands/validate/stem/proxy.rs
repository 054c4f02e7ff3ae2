//! The apple proxy of the laboratory: an arm on a pedestal picks an apple that a magnet holds at the end of a branch that gives way.

use std::sync::Arc;

use orchard_batch::TreeWorld;
use orchard_exchange::json;
use orchard_fruit::place;
use orchard_geometry::Vec3;
use orchard_perception::DetectorConfig;
use orchard_picker::Kind;
use orchard_robot::RobotModel;
use orchard_spec::Spec;
use orchard_world::{World, WorldEvent};
use rayon::prelude::*;

use super::pulls::Hanging;

/// Names of the levels and their configs.
const LEVELS: [(&str, &str); 3] = [
    ("low", include_str!("../../../../configs/proxy/low.toml")),
    ("medium", include_str!("../../../../configs/proxy/medium.toml")),
    ("high", include_str!("../../../../configs/proxy/high.toml")),
];
const BRANCH: &str = include_str!("../../../../configs/proxy/branch.json");
const ROBOT: &str = include_str!("../../../../configs/proxy/fr3.toml");

/// Seed of the start poses, and time for one pick \[s\].
const SEED: u64 = 1;
const DURATION: f64 = 30.0;
/// Pull by which the branch is measured \[N\].
const PROBE: f64 = 2.0;

/// Measurements at one level.
pub struct Level {
    pub name: &'static str,
    /// Tension of the stem when the magnet let go \[N\], of each pick in which it did.
    pub released_at: Vec<f64>,
    pub picks: u32,
    /// Stiffness at the apple, pulled sideways \[N/m\].
    pub stiffness: f64,
}

/// Measures every level with some picks of the expert.
pub fn levels(picks: u32) -> anyhow::Result<Vec<Level>> {
    LEVELS.iter().map(|(name, config)| level(name, config, picks)).collect()
}

fn level(name: &'static str, config: &str, picks: u32) -> anyhow::Result<Level> {
    let spec = Arc::new(Spec::from_toml(&format!("proxy/{name}.toml"), config)?);
    let robot = Arc::new(RobotModel::variant("proxy/fr3.toml", ROBOT).map_err(anyhow::Error::msg)?);
    let tree = json::read(BRANCH)?;
    let released = (0..picks).into_par_iter().map(|number| {
        let skeleton = tree.clone().into_skeleton(&spec, SEED, number);
        let mut world = World::with_tree(spec.clone(), robot.clone(), skeleton, SEED, number, 0)?;
        Ok(pick(&mut world, &robot))
    });
    let released_at: Vec<Option<f64>> = released.collect::<anyhow::Result<_>>()?;
    let skeleton = tree.clone().into_skeleton(&spec, SEED, 0);
    let fruit = place(&spec.fruit, &skeleton, SEED, 0);
    let world = TreeWorld::new(spec, &skeleton, fruit)?;
    let stiffness = Hanging::new(&world, 0).stiffness(Vec3::y() * PROBE);
    Ok(Level { name, released_at: released_at.into_iter().flatten().collect(), picks, stiffness })
}

/// Lets the expert pick: tension of the stem when the apple came off.
fn pick(world: &mut World, robot: &RobotModel) -> Option<f64> {
    let mut expert = Kind::Expert.controller(robot, DetectorConfig::paper());
    let frames = (DURATION * world.spec().sim.frame_rate.si()) as u32;
    (0..frames).find_map(|_| {
        let command = expert.act(&world.observe());
        world.step(&command);
        world.drain_events().into_iter().find_map(|event| match event {
            WorldEvent::FruitDetached { tension, .. } => Some(tension),
            _ => None,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Magnets of 9.78, 16.45 and 26.6 N and springs of 175, 490 and 771 N/m.
    #[test]
    fn the_arm_pulls_the_magnets_off_at_their_strengths() {
        for (level, (force, spring)) in
            levels(2).unwrap().iter().zip([(9.78, 175.0), (16.45, 490.0), (26.6, 771.0)])
        {
            assert!(!level.released_at.is_empty(), "{}", level.name);
            for tension in &level.released_at {
                assert!((tension / force - 1.0).abs() < 0.15, "{}: {tension} N of {force}", level.name);
            }
            assert!((level.stiffness / spring - 1.0).abs() < 0.05, "{}: {} N/m", level.name, level.stiffness);
        }
    }
}
