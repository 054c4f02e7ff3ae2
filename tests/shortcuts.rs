//! Controls against shortcuts: fruit placed by a controller without sight, and by one that always reaches for the middle
//! of the tree's fruit. Start poses vary in distance, bearing and heading, so no fixed plan leads to fruit either.

use orchard_camera::Label;
use orchard_geometry::{DepthImage, Pose, Vec3, transform};
use orchard_picker::{Controller, Kind};
use orchard_robot::{Command, Observation};
use orchard_scenario::Scenario;
use orchard_tasks::harvest::Harvest;
use orchard_tasks::harvest::adapter::Recorded;
use orchard_tasks::harvest::episode::EpisodeRecord;
use orchard_tasks::harvest::interface::{BenchWorld, FruitTruth, VisibleFruit};
use orchard_tasks::harvest::{WorldFactory, run_episode};
use orchard_tasks::protocol::Protocol;
use orchard_world::World;
use orchard_world::WorldEvent;
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;

const SECONDS: f64 = 40.0;
const TREES: u32 = 2;
/// Largest share of placed attempts that chance may give a controller without sight.
const BY_CHANCE: f64 = 0.05;

/// Replacement of the depth image.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Sight {
    Sound,
    /// No pixel has a depth.
    Blind,
    /// The fruit are removed, and one phantom hangs at their mean position, in front of everything.
    MeanFruit {
        p_world: Vec3,
        radius: f64,
    },
}

impl Sight {
    fn mean_fruit(world: &World) -> Self {
        let fruit = world.fruit_truth();
        let n = fruit.len() as f64;
        Sight::MeanFruit {
            p_world: fruit.iter().map(|f| f.p_world).sum::<Vec3>() / n,
            radius: fruit.iter().map(|f| f.radius).sum::<f64>() / n,
        }
    }

    fn spoil(self, world: &World, observation: &mut Observation) {
        let (Some(depth), Some(truth)) = (&mut observation.depth, world.camera_truth()) else { return };
        match self {
            Sight::Sound => {}
            Sight::Blind => *depth = DepthImage::filled(depth.width(), depth.height(), 0.0),
            Sight::MeanFruit { p_world, radius } => {
                let p_camera = transform(&truth.sight.x_world_camera.inverse(), &p_world);
                let labels = &truth.truth().label;
                let camera = observation.intrinsics;
                // Middle of the phantom's image, and a length that no part of the image is beyond; a ray for every pixel of every image takes minutes.
                let image = camera
                    .project(&p_camera)
                    .map(|(u, v)| (u, v, 2.0 * camera.fx * radius / (p_camera.z - radius).max(0.5 * radius)));
                let phantom = |u: f64, v: f64| {
                    let (u_middle, v_middle, reach) = image?;
                    if (u - u_middle).abs().max((v - v_middle).abs()) > reach {
                        return None;
                    }
                    let ray = camera.ray(u, v).normalize();
                    let along = ray.dot(&p_camera);
                    let inside = radius * radius - (p_camera - ray * along).norm_squared();
                    (inside > 0.0).then(|| ((along - inside.sqrt()) * ray.z) as f32)
                };
                for v in 0..depth.height() {
                    for u in 0..depth.width() {
                        match phantom(u as f64, v as f64) {
                            Some(nearest) => depth[(u, v)] = nearest,
                            None if labels[(u, v)] == Label::Fruit => depth[(u, v)] = 0.0,
                            None => {}
                        }
                    }
                }
            }
        }
    }
}

/// A world with altered depth images.
struct Spoilt {
    world: World,
    sight: Sight,
}

impl BenchWorld for Spoilt {
    fn observe(&mut self) -> Observation {
        let mut observation = self.world.observe();
        self.sight.spoil(&self.world, &mut observation);
        observation
    }

    fn step(&mut self, command: &Command) {
        self.world.step(command);
    }

    fn drain_events(&mut self) -> Vec<WorldEvent> {
        BenchWorld::drain_events(&mut self.world)
    }

    fn fruit(&self) -> Vec<FruitTruth> {
        self.world.fruit_truth()
    }

    fn visible_fruit(&self) -> Vec<VisibleFruit> {
        BenchWorld::visible_fruit(&self.world)
    }

    fn x_world_odom(&self) -> Pose {
        self.world.x_world_odom()
    }

    fn reachable(&self) -> Vec<bool> {
        self.world.reachable()
    }

    fn peak_stem_pull(&self) -> f64 {
        BenchWorld::peak_stem_pull(&self.world)
    }

    fn quarantine(&self) -> Option<String> {
        BenchWorld::quarantine(&self.world)
    }
}

/// Runs an episode of the first trees of every tuning seed; `sight` gets each world at its start.
fn episodes(kind: Kind, sight: impl Fn(&World) -> Sight + Sync) -> Vec<EpisodeRecord> {
    let harvest = Harvest::new(Scenario::of(&[("controller", kind.name())]).unwrap()).unwrap();
    let protocol = Protocol::paper();
    let plan = harvest.plan("full", protocol.tuning_seeds.clone(), TREES, SECONDS);
    let run = |key: orchard_tasks::harvest::episode::EpisodeKey| {
        let (world, mut controller): (World, Recorded<Box<dyn Controller>>) =
            harvest.build(&key).expect("a tuning seed");
        let mut world = Spoilt { sight: sight(&world), world };
        let never = AtomicBool::new(false);
        run_episode(key, &mut world, &mut controller, &protocol, plan.frame, &never, &mut || ())
            .expect("nothing stops it")
    };
    plan.episodes().into_par_iter().map(run).collect()
}

/// Numbers of attempts and of placed attempts.
fn count(episodes: &[EpisodeRecord]) -> (usize, usize) {
    assert!(episodes.iter().all(|e| !e.quarantined()));
    (episodes.iter().map(|e| e.attempts.len()).sum(), episodes.iter().map(|e| e.placed().count()).sum())
}

/// Positive control: the unaltered image.
#[test]
fn with_sound_eyes_every_controller_places_fruit() {
    for kind in Kind::ALL {
        let (attempts, placed) = count(&episodes(kind, |_| Sight::Sound));
        println!("{}: {placed} of {attempts} placed", kind.name());
        assert!(placed as f64 > 4.0 * BY_CHANCE * attempts as f64, "{}", kind.name());
    }
}

#[test]
fn a_blind_camera_places_nothing() {
    for kind in Kind::ALL {
        let (attempts, placed) = count(&episodes(kind, |_| Sight::Blind));
        println!("{} blind: {placed} of {attempts} placed", kind.name());
        assert!(placed as f64 <= BY_CHANCE * attempts as f64, "{}", kind.name());
    }
}

#[test]
fn reaching_for_the_mean_fruit_position_places_next_to_nothing() {
    for kind in Kind::ALL {
        let (attempts, placed) = count(&episodes(kind, Sight::mean_fruit));
        println!("{} for the mean fruit: {placed} of {attempts} placed", kind.name());
        assert!(attempts > 0, "{}: it never reached for the phantom", kind.name());
        assert!(placed as f64 <= BY_CHANCE * attempts as f64, "{}", kind.name());
    }
}
