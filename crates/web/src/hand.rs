//! A hand that pulls wood or fruit like a spring.
//!
//! The spring is taken implicitly, with the compliance C of the grabbed place over a frame T: the force that is exact at the end of the frame,
//! `f = k (p_target - p(T))` with `p(T) = p_free(T) + C f`, is `f = (I / k + C)^-1 (p_target - p_free(T))`. So the place approaches the target
//! and never overshoots it by the spring alone, however light the twig is. C and `p_free(T)` come from trial steps of the length of a frame on
//! a copy of the state, without a force and with a small one along each axis.

use orchard_geometry::{Mat3, Vec3, inverse_transform, transform};
use orchard_multibody::{Data, StepReport, StepSettings, step};
use orchard_treephys::step_settings;
use orchard_world::World;

use crate::rules::HandRules;

/// A grabbed place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grip {
    /// A place on the wood.
    Wood {
        /// Segment of the tree.
        segment: usize,
        /// The place \[m\], frame of the segment.
        p_segment: Vec3,
    },
    /// The centre of a fruit on its stem.
    Fruit {
        /// Index of the fruit.
        fruit: usize,
    },
}

impl Grip {
    /// The thing that a ray meets first, or else misses by the smallest angle, up to `grab_angle` \[rad\]: living wood, and fruit on their stems.
    /// `p_world` \[m\] is the ray's start, `along` its direction.
    pub fn along(world: &World, p_world: &Vec3, along: &Vec3, grab_angle: f64) -> Option<Self> {
        let length = along.norm();
        if length.is_nan() || length <= 0.0 {
            return None;
        }
        let along = along / length;
        let mut best: Option<(f64, f64, Self)> = None;
        let mut offer = |gap: f64, distance: f64, grip: Self| {
            if distance <= 0.0 {
                return;
            }
            let miss = gap.max(0.0) / distance;
            let is_better = best.is_none_or(|(m, d, _)| miss < m || miss == m && distance < d);
            if miss <= grab_angle && is_better {
                best = Some((miss, distance, grip));
            }
        };
        for (segment, wood) in world.skeleton().segments.iter().enumerate() {
            if world.rupture().is_debris(segment) {
                continue;
            }
            let x_world = world.data().x_world_body(world.tree().bodies[segment]);
            let tip = Vec3::new(0.0, 0.0, wood.length);
            let (on_ray, on_wood) =
                nearest(p_world, &along, &x_world.translation.vector, &transform(x_world, &tip));
            let gap = (p_world + along * on_ray - on_wood).norm() - wood.radius;
            offer(gap, on_ray, Self::Wood { segment, p_segment: inverse_transform(x_world, &on_wood) });
        }
        let set = world.fruit();
        for (fruit, (point, apple)) in set.points.iter().zip(&set.fruit).enumerate() {
            if !world.data().tethered[point.index()] {
                continue;
            }
            let p_fruit = world.data().point_p_world[point.index()];
            let on_ray = (p_fruit - p_world).dot(&along);
            let gap = (p_world + along * on_ray - p_fruit).norm() - apple.radius;
            offer(gap, on_ray - apple.radius, Self::Fruit { fruit });
        }
        best.map(|(_, _, grip)| grip)
    }

    /// The place in a state of a world \[m\], world.
    pub fn place(&self, world: &World, data: &Data) -> Vec3 {
        match *self {
            Self::Wood { segment, p_segment } => {
                transform(data.x_world_body(world.tree().bodies[segment]), &p_segment)
            }
            Self::Fruit { fruit } => data.point_p_world[world.fruit().points[fruit].index()],
        }
    }

    /// True while it can be held: the wood has not broken, the fruit is on its stem.
    fn holds(&self, world: &World) -> bool {
        match *self {
            Self::Wood { segment, .. } => !world.rupture().is_debris(segment),
            Self::Fruit { fruit } => world.data().tethered[world.fruit().points[fruit].index()],
        }
    }

    /// Force and torque on the link, or force on the fruit, that a force \[N\] at the place makes.
    fn loads(&self, world: &World, data: &Data, force_world: &Vec3) -> [Vec3; 2] {
        match *self {
            Self::Wood { segment, .. } => {
                let arm = self.place(world, data) - data.com_p_world(world.tree().bodies[segment]);
                [*force_world, arm.cross(force_world)]
            }
            Self::Fruit { .. } => [*force_world, Vec3::zeros()],
        }
    }

    /// The inputs of a step that push the held thing.
    fn inputs(&self, world: &World) -> Inputs {
        match *self {
            Self::Wood { segment, .. } => Inputs::Body(world.tree().bodies[segment].index()),
            Self::Fruit { fruit } => Inputs::Point(world.fruit().points[fruit].index()),
        }
    }
}

/// External force and torque of a link, or force of a point body, in a state.
#[derive(Debug, Clone, Copy)]
enum Inputs {
    Body(usize),
    Point(usize),
}

impl Inputs {
    fn read(self, data: &Data) -> [Vec3; 2] {
        match self {
            Self::Body(body) => [data.body_force_world[body], data.body_torque_world[body]],
            Self::Point(point) => [data.point_force_world[point], Vec3::zeros()],
        }
    }

    fn write(self, data: &mut Data, [force, torque]: [Vec3; 2]) {
        match self {
            Self::Body(body) => {
                (data.body_force_world[body], data.body_torque_world[body]) = (force, torque);
            }
            Self::Point(point) => data.point_force_world[point] = force,
        }
    }

    fn add(self, data: &mut Data, [force, torque]: [Vec3; 2]) {
        let [f, t] = self.read(data);
        self.write(data, [f + force, t + torque]);
    }
}

/// Nearest points of a ray and a line from `a` to `b` \[m\]: the distance along the ray, and the point between `a` and `b`.
fn nearest(p_world: &Vec3, along: &Vec3, a: &Vec3, b: &Vec3) -> (f64, Vec3) {
    let (line, from) = (b - a, a - p_world);
    let (slope, square) = (line.dot(along), line.norm_squared());
    let across = square - slope * slope;
    let share = if across > 0.0 { (from.dot(along) * slope - from.dot(&line)) / across } else { 0.0 };
    let on_line = a + line * share.clamp(0.0, 1.0);
    ((on_line - p_world).dot(along), on_line)
}

/// A hand; it holds at most one place.
#[derive(Debug)]
pub struct Hand {
    rules: HandRules,
    held: Option<Grip>,
    p_world_target: Vec3,
    force_world: Vec3,
    /// Force and torque of the held link, or force of the held fruit, without the hand.
    before: [Vec3; 2],
}

impl Hand {
    /// An empty hand.
    pub fn new(rules: &HandRules) -> Self {
        let zero = Vec3::zeros();
        Self { rules: rules.clone(), held: None, p_world_target: zero, force_world: zero, before: [zero; 2] }
    }

    /// Takes a place, with the pointer on it \[m\], world.
    pub fn take(&mut self, grip: Grip, p_world_target: Vec3) {
        (self.held, self.p_world_target, self.force_world) = (Some(grip), p_world_target, Vec3::zeros());
    }

    /// Moves the pointer \[m\], world. A place that is not finite is left out.
    pub fn pull_to(&mut self, p_world: &Vec3) {
        if p_world.iter().all(|x| x.is_finite()) {
            self.p_world_target = *p_world;
        }
    }

    /// Lets go.
    pub fn release(&mut self) {
        (self.held, self.force_world) = (None, Vec3::zeros());
    }

    /// The held place.
    pub fn grip(&self) -> Option<&Grip> {
        self.held.as_ref()
    }

    /// The pointer \[m\], world.
    pub fn target(&self) -> Vec3 {
        self.p_world_target
    }

    /// Force of the last frame \[N\], world.
    pub fn force(&self) -> Vec3 {
        self.force_world
    }

    /// Puts the hand's force on the world for the next frame. An empty hand leaves every bit as it is.
    pub(crate) fn load(&mut self, world: &mut World) {
        let Some(grip) = self.held else { return };
        if !grip.holds(world) {
            self.release();
            return;
        }
        self.force_world = self.spring(&grip, world);
        let inputs = grip.inputs(world);
        self.before = inputs.read(world.data());
        let loads = grip.loads(world, world.data(), &self.force_world);
        inputs.add(world.data_mut(), loads);
    }

    /// Takes the hand's force from the world, and lets go of what broke off.
    pub(crate) fn unload(&mut self, world: &mut World) {
        let Some(grip) = self.held else { return };
        let inputs = grip.inputs(world);
        inputs.write(world.data_mut(), self.before);
        if !grip.holds(world) {
            self.release();
        }
    }

    /// Force of the spring over the next frame \[N\].
    fn spring(&self, grip: &Grip, world: &World) -> Vec3 {
        let sim = &world.spec().sim;
        let settings = StepSettings { h: sim.frame(), ..step_settings(sim) };
        let after = |force_world: &Vec3| {
            let mut data = world.data().clone();
            let loads = grip.loads(world, &data, force_world);
            grip.inputs(world).add(&mut data, loads);
            step(world.model(), &mut data, &settings, &mut StepReport::default());
            grip.place(world, &data)
        };
        let (probe, largest) = (self.rules.probe_force.si(), self.rules.largest_force.si());
        let free = after(&Vec3::zeros());
        let columns = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| (after(&(axis * probe)) - free) / probe);
        let compliance = Mat3::from_columns(&columns) + Mat3::identity() / self.rules.stiffness.si();
        let force = compliance.try_inverse().map_or_else(Vec3::zeros, |k| k * (self.p_world_target - free));
        let size = force.norm();
        if !size.is_finite() {
            return Vec3::zeros();
        }
        if size > largest { force * (largest / size) } else { force }
    }
}

#[cfg(test)]
#[path = "hand_tests.rs"]
mod tests;
