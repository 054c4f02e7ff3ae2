//! A tree with a capsule that is pushed through its canopy: the work with contacts.

use orchard_exchange::mjcf;
use orchard_fruit::{FruitGroups, FruitLives, FruitSet, RestRule, Touch};
use orchard_geometry::{Pose, Shape, Vec3};
use orchard_multibody::{
    Body, BodyId, Collider, Data, Groups, JointKind, Model, ModelBuilder, Owner, SpatialInertia, StepReport,
    StepSettings, equilibrium, step,
};
use orchard_treephys::{Rupture, TreeBody, TreeGroups, step_settings};

use rayon::prelude::*;

use super::forest::{Planting, kick};
use super::limit::operations_of;
use super::peer::ContactCounts;

/// Radius of the capsule. It is upright, as high as the canopy, and too heavy to be slowed by wood. A thinner one has too few
/// contacts.
const RADIUS: f64 = 0.2;
const LENGTH: f64 = 1.6;
const MASS: f64 = 1000.0;
/// Height of the capsule's centre \[m\].
const HEIGHT: f64 = 1.4;
/// Speed of the capsule along x \[m/s\]: slow enough to bend the wood more than to break it.
const SPEED: f64 = 0.3;
/// Start of the capsule along x, outside the canopy \[m\].
const START: f64 = -1.3;
/// Offsets at which the capsule passes the trunk \[m\], on either side.
const OFFSETS: [f64; 4] = [-0.2, -0.1, 0.1, 0.2];
/// One of every `EVERY` trees is tried.
const EVERY: usize = 8;
/// Largest number of pushes that are examined further.
const WAYS: usize = 16;
/// Least number of contacts at any time.
pub const CONTACTS: u32 = 8;
/// Frames until the capsule has left the canopy.
const FRAMES: u32 = 480;

/// Wood and fruit touch the capsule and nothing else.
const CANOPY: Groups = Groups { member: 1, filter: 2 };
const CAPSULE: Groups = Groups { member: 2, filter: 1 };

/// Largest joint move of the last iteration of the statics \[rad\].
const STATICS_TOLERANCE: f64 = 1e-12;

/// One tree, its fruit and the capsule; wood may break and fruit come off. Cloning it is a snapshot.
#[derive(Clone)]
pub struct PushedTree {
    planting: Planting,
    model: Model,
    data: Data,
    tree: TreeBody,
    fruit: FruitSet,
    rupture: Rupture,
    stems: FruitLives,
    settings: StepSettings,
    report: StepReport,
}

/// A push of the capsule through a canopy.
pub struct Push {
    /// State with the capsule in front of the tree.
    pub start: PushedTree,
    /// Frames until the timed part.
    pub lead: u32,
    /// Contacts in the timed part.
    pub contacts: ContactCounts,
}

impl PushedTree {
    /// Makes the start state: the capsule in front of the tree and moving, every joint of the tree kicked.
    fn new(planting: Planting, offset: f64) -> anyhow::Result<Self> {
        let spec = planting.spec.clone();
        let settings = step_settings(&spec.sim);
        let mut builder = ModelBuilder::new();
        let tree_groups = TreeGroups { wood: CANOPY, debris: Groups::NONE };
        let tree = TreeBody::add_to(&mut builder, &planting.skeleton, &spec.wood, tree_groups);
        let gravity = spec.sim.gravity.si();
        let fruit = FruitSet::add_to(
            &mut builder,
            planting.fruit.clone(),
            &tree.bodies,
            &planting.skeleton,
            &spec.fruit,
            gravity,
            FruitGroups { hanging: CANOPY, loose: CANOPY, passed: Groups::NONE },
        );
        let capsule = add_capsule(&mut builder, offset, spec.wood.friction.si());
        let model = builder.build()?;
        let mut data = Data::new(&model);
        tree.reset(&model, &mut data, &spec.wood);
        fruit.reset(&model, &mut data);
        // The capsule slides freely, with nothing along its axis that could move it.
        data.stiffness[model.dofs(capsule)].fill(1.0);
        equilibrium(&model, &mut data, &settings.gravity, STATICS_TOLERANCE)?;
        data.stiffness[model.dofs(capsule)].fill(0.0);
        kick(&mut data.v[..model.dofs(capsule).start], 0);
        data.v[model.dofs(capsule)].fill(SPEED);
        let (rupture, stems) = (Rupture::new(&tree), FruitLives::new(&fruit));
        Ok(Self {
            planting,
            model,
            data,
            tree,
            fruit,
            rupture,
            stems,
            settings,
            report: StepReport::default(),
        })
    }

    /// Pushes that keep enough contacts over `frames` consecutive frames, the most first.
    pub fn busiest(plantings: &[Planting], frames: u32) -> anyhow::Result<Vec<Push>> {
        let ways: Vec<(&Planting, f64)> = plantings
            .iter()
            .step_by(EVERY)
            .flat_map(|planting| OFFSETS.map(|offset| (planting, offset)))
            .collect();
        let mut pushes = ways
            .into_par_iter()
            .map(|(planting, offset)| Self::new(planting.clone(), offset)?.watch(frames))
            .collect::<anyhow::Result<Vec<_>>>()?;
        pushes.retain(|push| push.contacts.fewest >= CONTACTS);
        pushes.sort_by_key(|push| std::cmp::Reverse(push.contacts.fewest));
        pushes.truncate(WAYS);
        anyhow::ensure!(!pushes.is_empty(), "no path through a canopy keeps {CONTACTS} contacts");
        Ok(pushes)
    }

    /// Finds the part of the capsule's path, `frames` frames long, with the most contacts.
    fn watch(self, frames: u32) -> anyhow::Result<Push> {
        let mut world = self.clone();
        let counts: Vec<Vec<u32>> = (0..FRAMES).map(|_| world.step()).collect();
        anyhow::ensure!(world.data.is_finite(), "the state of a pushed tree is not finite");
        let fewest: Vec<u32> = counts.iter().map(|f| f.iter().copied().min().unwrap_or(0)).collect();
        let least = |lead: usize| fewest[lead..lead + frames as usize].iter().copied().min().unwrap_or(0);
        let lead = (0..=fewest.len() - frames as usize).rev().max_by_key(|&lead| least(lead)).unwrap_or(0);
        let timed = counts[lead..lead + frames as usize].concat();
        let contacts = f64::from(timed.iter().sum::<u32>()) / timed.len() as f64;
        Ok(Push {
            start: self,
            lead: lead as u32,
            contacts: ContactCounts { contacts, fewest: least(lead), finite: true },
        })
    }

    /// Advances one frame; returns the number of contacts that carry load, for each substep.
    pub fn step(&mut self) -> Vec<u32> {
        let Self { planting, model, data, tree, fruit, rupture, stems, settings, report } = self;
        let spec = &planting.spec;
        let mut contacts = Vec::with_capacity(spec.sim.substeps.get() as usize);
        for _ in 0..spec.sim.substeps.get() {
            rupture.begin_substep(tree, model, data, &spec.wood, settings.h);
            step(model, data, settings, report);
            contacts.push(report.contacts.iter().filter(|c| c.force_world != Vec3::zeros()).count() as u32);
        }
        rupture.end_frame(tree, model, data, &spec.wood, spec.sim.gravity.si());
        fruit.weigh_on(data, |segment| rupture.is_debris(segment));
        let untouched = vec![Touch::default(); fruit.len()];
        let never = RestRule { speed: 0.0, frames: u32::MAX };
        let nowhere = |_: &Vec3| Vec3::zeros();
        stems.end_frame(fruit, model, data, &spec.fruit, &untouched, never, nowhere);
        contacts
    }

    /// Joints that broke and fruit that came off so far.
    pub fn losses(&self) -> (usize, usize) {
        let loose = self.data.tethered.iter().filter(|tethered| !**tethered).count();
        (self.rupture.breaks().len(), loose)
    }

    /// Floating-point operations of a substep without contacts.
    pub fn operations(&self) -> f64 {
        operations_of(&self.tree, self.fruit.len())
    }

    /// The model at its present state for MuJoCo.
    pub fn mjcf(&self) -> anyhow::Result<String> {
        Ok(mjcf::write_for_timing(
            "pushed",
            &self.model,
            &self.data,
            &self.settings.gravity,
            self.settings.h,
        )?)
    }
}

/// A capsule along z that slides along x.
fn add_capsule(builder: &mut ModelBuilder, offset: f64, friction: f64) -> BodyId {
    let square = MASS * LENGTH * LENGTH / 12.0;
    let body = builder.add_body(Body {
        parent: None,
        joint: JointKind::Slide(Vec3::x_axis()),
        x_parent_joint: Pose::translation(START, offset, HEIGHT),
        inertia: SpatialInertia {
            mass: MASS,
            p_com: Vec3::zeros(),
            i_com: orchard_geometry::Mat3::from_diagonal(&Vec3::new(square, square, square)),
        },
    });
    builder.add_collider(Collider {
        owner: Owner::Body(body),
        shape: Shape::Capsule { radius: RADIUS, length: LENGTH },
        x_owner_shape: Pose::translation(0.0, 0.0, -0.5 * LENGTH),
        groups: CAPSULE,
        friction,
        stiffness: f64::INFINITY,
    });
    body
}
