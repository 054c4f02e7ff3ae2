//! Canopy zones of the benchmark's metrics in the world on show.

use orchard_geometry::{Vec3, math};
use orchard_play::{Colour, Marks, colour};
use orchard_tasks::zones::{Zone, ZoneFrame, ZoneRules};
use orchard_world::World;
use orchard_world::truth::FruitState;

/// Sides of a ring, radius of its line \[m\], and its colour.
const SIDES: u32 = 48;
const LINE: f64 = 0.006;
const GREY: Colour = [0.35, 0.35, 0.35];
/// Radius of the shell of a fruit over that of the fruit, and opacities of inner and outer shells.
const SHELL: f64 = 1.15;
const OPACITY: [f32; 2] = [0.8, 0.35];

/// Zones of a tree at the start of its episode, as the benchmark counts them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Canopy {
    frame: Option<ZoneFrame>,
    /// Zone of each fruit at the start; none for one out of reach, which the metrics leave out.
    zones: Vec<Option<Zone>>,
}

impl Canopy {
    /// The zones of a world at the start of its episode.
    pub fn of(world: &World, rules: &ZoneRules) -> Self {
        let (fruit, reachable) = (world.fruit_truth(), world.reachable());
        let frame = ZoneFrame::of_start(&fruit, &reachable, rules);
        let zones = fruit.iter().zip(&reachable).map(|(fruit, counts)| {
            let frame = frame.as_ref().filter(|_| *counts)?;
            Some(frame.zone(&fruit.p_world))
        });
        Self { zones: zones.collect(), frame }
    }

    /// Zone of each fruit at the start; none for one that the metrics leave out.
    pub fn zones(&self) -> &[Option<Zone>] {
        &self.zones
    }

    /// Draws the cylinder that parts inner from outer zones, its cuts into thirds, and a shell in the colour of its zone about each fruit on the tree.
    pub fn mark(&self, marks: &mut Marks, world: &World) {
        let Some(frame) = &self.frame else { return };
        let [x, y] = frame.axis_world;
        let at = |z: f64| Vec3::new(x, y, z);
        marks.line(&at(frame.z_low), &at(frame.z_high), LINE, GREY);
        for third in 0..=3 {
            let z = frame.z_low + (frame.z_high - frame.z_low) * f64::from(third) / 3.0;
            let corner = |side: u32| {
                let (sin, cos) = math::sin_cos(std::f64::consts::TAU * f64::from(side) / f64::from(SIDES));
                at(z) + Vec3::new(cos, sin, 0.0) * frame.split_radius
            };
            for side in 0..SIDES {
                marks.line(&corner(side), &corner(side + 1), LINE, GREY);
            }
        }
        for (fruit, zone) in world.fruit_truth().iter().zip(&self.zones) {
            if let (FruitState::OnTree, Some(zone)) = (fruit.state, zone) {
                let (colour, opacity) = shade(*zone);
                marks.ball(&fruit.p_world, SHELL * fruit.radius, colour, opacity);
            }
        }
    }
}

/// Colour of a zone by its third, and opacity by its half: dense inside.
fn shade(zone: Zone) -> (Colour, f32) {
    let [inner, outer] = OPACITY;
    match zone {
        Zone::LowerInner => (colour::BLUE, inner),
        Zone::LowerOuter => (colour::BLUE, outer),
        Zone::MiddleInner => (colour::GREEN, inner),
        Zone::MiddleOuter => (colour::GREEN, outer),
        Zone::UpperInner => (colour::RED, inner),
        Zone::UpperOuter => (colour::RED, outer),
    }
}
