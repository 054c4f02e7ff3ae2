//! One tree with its fruit and nothing else, in f64: batches are built from it and compared with it.

use crate::fault::Fault;
use orchard_fruit::{Fruit, FruitGroups, FruitLives, FruitSet, LooseEvent, Release, RestRule, Touch, place};
use orchard_geometry::{Pose, Shape, Vec3};
use orchard_multibody::{
    Collider, Data, Groups, Model, ModelBuilder, ModelError, Owner, Solver, StaticsError, StepReport,
    StepSettings, equilibrium, forward_kinematics, step,
};
use orchard_spec::Spec;
use orchard_treegen::{Skeleton, TreegenError, grow};
use orchard_treephys::wind::Weather;
use orchard_treephys::{Rupture, Timber, TreeBody, TreeGroups, step_settings};
use std::sync::Arc;

/// Largest joint move \[rad\] of the last statics iteration: a few units in the last place of a bent joint.
const EQUILIBRIUM_TOLERANCE: f64 = 1e-14;

/// A tree world that cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum TreeWorldError {
    /// The tree does not grow.
    #[error("the tree does not grow: {0}")]
    Growth(#[from] TreegenError),
    /// Bumpy ground, which a batch does not support.
    #[error("terrain.enabled = true: trees without a robot stand on level ground")]
    Terrain,
    /// Wind of no world in particular.
    #[error("wind.speed: the wind is drawn for a world's seed and index (TreeWorld::drawn)")]
    Wind,
    /// The parts form no valid model.
    #[error("the tree forms no valid model: {0}")]
    Model(#[from] ModelError),
    /// The loaded tree finds no rest.
    #[error("the tree finds no static equilibrium: {0}")]
    Equilibrium(#[from] StaticsError),
}

/// The constant part of a tree world.
#[derive(Debug, Clone)]
pub struct Plant {
    /// Spec: rules and materials.
    pub spec: Arc<Spec>,
    /// The model: the tree's links and the fruit as point bodies. Fruit off its stem and
    /// broken limbs touch the ground; there are no other contacts.
    pub model: Model,
    /// The tree's links.
    pub tree: TreeBody,
    /// The fruit that grew.
    pub fruit: FruitSet,
    /// Settings of a substep.
    pub settings: StepSettings,
    /// Wind of the world; `None` in still air.
    pub weather: Option<Weather>,
    /// Static equilibrium of the whole tree with all its fruit.
    rest: Rest,
}

/// Pose of a tree with its fruit.
#[derive(Debug, Clone)]
struct Rest {
    /// Joint angles \[rad\].
    q: Vec<f64>,
    /// Positions of the fruit \[m\], world.
    point_p_world: Vec<Vec3>,
}

/// Event of a tree world in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TreeEvent {
    /// The joint at a segment's base broke.
    Snapped {
        /// Segment.
        segment: usize,
    },
    /// A stem gave way.
    Detached {
        /// Index of the fruit.
        fruit: usize,
        /// Way in which it came off; `None` on a tether, which knows one way.
        release: Option<Release>,
    },
    /// The world is no longer finite and stands still from now on. Only a batch tests for it.
    Quarantined {
        /// Fault found.
        fault: Fault,
    },
}

/// One tree with its fruit in f64. A clone continues with the same bits; there is no save file.
#[derive(Debug, Clone)]
pub struct TreeWorld {
    plant: Arc<Plant>,
    data: Data,
    rupture: Rupture,
    stems: FruitLives,
    /// Contacts of each fruit: none.
    untouched: Vec<Touch>,
    report: StepReport,
    /// Frames since the tree was at rest.
    frame: u32,
    fruit_events: Vec<LooseEvent>,
}

impl TreeWorld {
    /// Grows the tree of a world's index and seed, before any randomisation, of its own wood, and lets it sag to its static equilibrium.
    ///
    /// # Errors
    /// The tree does not grow or finds no rest.
    pub fn grow(spec: Arc<Spec>, seed: u64, world: u32) -> Result<Self, TreeWorldError> {
        let skeleton = grow(&spec, seed, world)?;
        let fruit = place(&spec.fruit, &skeleton, seed, world);
        Self::drawn(spec, &skeleton, fruit, seed, world)
    }

    /// Builds the world of a given tree with given fruit, of the mean wood, in static equilibrium.
    ///
    /// # Errors
    /// The spec has bumpy ground or wind, the parts form no valid model, or the tree finds no rest.
    pub fn new(spec: Arc<Spec>, skeleton: &Skeleton, fruit: Vec<Fruit>) -> Result<Self, TreeWorldError> {
        if spec.wind.as_ref().is_some_and(|wind| wind.speed.si() > 0.0) {
            return Err(TreeWorldError::Wind);
        }
        let timber = Timber::mean(skeleton, &spec.wood);
        Self::of_timber(spec, skeleton, &timber, fruit, None)
    }

    /// As [`Self::new`], of the wood that `wood.scatter` draws for a world's index and seed, and in the wind that `wind` draws for it. The tree is at rest in
    /// still air; the wind rises at once.
    ///
    /// # Errors
    /// As [`Self::new`], but for wind.
    pub fn drawn(
        spec: Arc<Spec>,
        skeleton: &Skeleton,
        fruit: Vec<Fruit>,
        seed: u64,
        world: u32,
    ) -> Result<Self, TreeWorldError> {
        let timber = Timber::draw(skeleton, &spec.wood, seed, world);
        let weather = Weather::new(&spec, skeleton, seed, world);
        Self::of_timber(spec, skeleton, &timber, fruit, weather)
    }

    fn of_timber(
        spec: Arc<Spec>,
        skeleton: &Skeleton,
        timber: &Timber,
        fruit: Vec<Fruit>,
        weather: Option<Weather>,
    ) -> Result<Self, TreeWorldError> {
        const APART: Groups = Groups::NONE;
        const GROUND: Groups = Groups { member: 1, filter: 2 };
        const OFF_THE_TREE: Groups = Groups { member: 2, filter: 1 };
        if spec.terrain.enabled {
            return Err(TreeWorldError::Terrain);
        }
        let gravity = spec.sim.gravity.si();
        let mut builder = ModelBuilder::new();
        builder.add_collider(Collider {
            owner: Owner::World,
            shape: Shape::HalfSpace,
            x_owner_shape: Pose::identity(),
            groups: GROUND,
            friction: spec.sim.ground_friction.si(),
            stiffness: spec.sim.ground_stiffness.si(),
        });
        let groups = TreeGroups { wood: APART, debris: OFF_THE_TREE };
        let mut tree = TreeBody::of_timber(&mut builder, skeleton, &spec.wood, timber, groups);
        let groups = FruitGroups { hanging: APART, loose: OFF_THE_TREE, passed: APART };
        let mut fruit =
            FruitSet::add_to(&mut builder, fruit, &tree.bodies, skeleton, &spec.fruit, gravity, groups);
        let model = builder.build()?;
        let settings = step_settings(&spec.sim);
        let mut data = unbroken(&spec, &model, &tree, &fruit);
        equilibrium(&model, &mut data, &settings.gravity, EQUILIBRIUM_TOLERANCE)?;
        tree.strengthen_to_stand(&model, &data, &spec.wood);
        fruit.strengthen_to_hang(&model, &data);
        let Data { q, point_p_world, .. } = data;
        let rest = Rest { q, point_p_world };
        Ok(Self::at_rest(Arc::new(Plant { spec, model, tree, fruit, settings, weather, rest })))
    }

    /// The tree of a larger model, in a state of that model, which becomes the state of [`Self::reset`] too. Nothing else of the model takes part where a batch steps it; [`Self::step`] would move all of it.
    pub fn within(
        spec: Arc<Spec>,
        model: Model,
        tree: TreeBody,
        fruit: FruitSet,
        weather: Option<Weather>,
        data: Data,
    ) -> Self {
        let settings = step_settings(&spec.sim);
        let rest = Rest { q: data.q.clone(), point_p_world: data.point_p_world.clone() };
        let plant = Arc::new(Plant { spec, model, tree, fruit, settings, weather, rest });
        Self::in_state(plant, data)
    }

    /// Returns a copy of this tree in a given state of its model, of its wood and of its fruit, so many frames after its wind began. In wind the forces of the state are those of the air in the frame before, which are left out.
    #[must_use]
    pub fn in_state_of(&self, mut data: Data, rupture: Rupture, fruit: FruitLives, frame: u32) -> Self {
        if self.plant.weather.is_some() {
            data.body_force_world.fill(Vec3::zeros());
            data.point_force_world.fill(Vec3::zeros());
        }
        Self { rupture, stems: fruit, frame, ..Self::in_state(self.plant.clone(), data) }
    }

    /// The world as [`Self::new`] builds it: unbroken, every fruit on its stem, in static equilibrium, without external forces.
    pub(crate) fn at_rest(plant: Arc<Plant>) -> Self {
        let Plant { spec, model, tree, fruit, rest, .. } = &*plant;
        let mut data = unbroken(spec, model, tree, fruit);
        data.q.clone_from(&rest.q);
        data.point_p_world.clone_from(&rest.point_p_world);
        forward_kinematics(model, &mut data);
        Self::in_state(plant, data)
    }

    /// An unbroken tree in a state.
    fn in_state(plant: Arc<Plant>, data: Data) -> Self {
        let (rupture, stems) = (Rupture::new(&plant.tree), FruitLives::new(&plant.fruit));
        Self {
            untouched: vec![Touch::default(); plant.fruit.len()],
            plant,
            data,
            rupture,
            stems,
            report: StepReport::default(),
            frame: 0,
            fruit_events: Vec::new(),
        }
    }

    /// Puts the world back to the state that [`Self::new`] gave it. Changes through [`Self::data_mut`] are undone too.
    pub fn reset(&mut self) {
        *self = Self::at_rest(self.plant.clone());
    }

    /// Advances one frame: substeps with the friction of broken joints, then rupture and stems once.
    pub fn step(&mut self) -> Vec<TreeEvent> {
        self.step_by(self.plant.settings.solver)
    }

    /// Advances one frame with a chosen linear solver.
    pub fn step_by(&mut self, solver: Solver) -> Vec<TreeEvent> {
        let Plant { spec, model, tree, fruit, settings, weather, .. } = &*self.plant;
        let settings = &StepSettings { solver, ..*settings };
        let applied = weather.as_ref().map(|_| Applied::take(&self.data));
        if let Some(weather) = weather {
            // Rates may have been set since the last step.
            forward_kinematics(model, &mut self.data);
            let time = f64::from(self.frame) * spec.sim.frame();
            weather.blow(tree, fruit.balls(), &self.rupture, model, &mut self.data, time);
        }
        if let Some(applied) = &applied {
            applied.add_to(&mut self.data);
        }
        self.frame += 1;
        for _ in 0..spec.sim.substeps.get() {
            self.rupture.begin_substep(tree, model, &mut self.data, &spec.wood, settings.h);
            step(model, &mut self.data, settings, &mut self.report);
            if spec.fruit.stem.is_some() {
                let identity = Pose::identity();
                let still = |_: &Vec3| Vec3::zeros();
                self.stems.end_substep(fruit, model, &mut self.data, settings.h, &identity, still);
            }
        }
        let gravity = spec.sim.gravity.si();
        let snapped = self.rupture.end_frame(tree, model, &mut self.data, &spec.wood, gravity);
        fruit.weigh_on(&mut self.data, |segment| self.rupture.is_debris(segment));
        let rest = RestRule { speed: 0.0, frames: u32::MAX };
        let fruit_events =
            self.stems.end_frame(fruit, model, &mut self.data, &spec.fruit, &self.untouched, rest, |_| {
                Vec3::zeros()
            });
        self.fruit_events = fruit_events;
        if let Some(applied) = applied {
            applied.put_back(&mut self.data);
        }
        let detached = self.fruit_events.iter().filter_map(|event| match *event {
            LooseEvent::Detached { fruit, release, .. } => Some(TreeEvent::Detached { fruit, release }),
            LooseEvent::Deposited { .. } | LooseEvent::Dropped { .. } | LooseEvent::Struck(_) => None,
        });
        snapped.into_iter().map(|segment| TreeEvent::Snapped { segment }).chain(detached).collect()
    }

    /// Breaks the joint at a segment's base now.
    pub fn break_branch(&mut self, segment: usize) {
        let Plant { spec, model, tree, fruit, .. } = &*self.plant;
        forward_kinematics(model, &mut self.data);
        self.rupture.break_joint(tree, model, &mut self.data, &spec.wood, spec.sim.gravity.si(), segment);
        fruit.weigh_on(&mut self.data, |segment| self.rupture.is_debris(segment));
    }

    /// Frames since the tree was at rest.
    pub fn frame(&self) -> u32 {
        self.frame
    }

    /// True if its fruit hang on stems that bend.
    pub(crate) fn has_stems(&self) -> bool {
        self.plant.spec.fruit.stem.is_some()
    }

    /// The constant part.
    pub fn plant(&self) -> &Arc<Plant> {
        &self.plant
    }

    /// The multibody state.
    pub fn data(&self) -> &Data {
        &self.data
    }

    /// The multibody state, to change.
    pub fn data_mut(&mut self) -> &mut Data {
        &mut self.data
    }

    /// Events of fruit in the latest frame, detachments with their tension among them.
    pub fn fruit_events(&self) -> &[LooseEvent] {
        &self.fruit_events
    }

    /// State of the fruit, with the wear of their stems.
    pub fn fruit_lives(&self) -> &FruitLives {
        &self.stems
    }

    /// Broken joints and sub-trees.
    pub fn rupture(&self) -> &Rupture {
        &self.rupture
    }
}

/// External forces on links and fruit \[N\], which a wind comes on top of.
#[derive(Debug, Clone)]
struct Applied {
    links: Vec<Vec3>,
    fruit: Vec<Vec3>,
}

impl Applied {
    fn take(data: &Data) -> Self {
        Self { links: data.body_force_world.clone(), fruit: data.point_force_world.clone() }
    }

    fn add_to(&self, data: &mut Data) {
        let sums = data.body_force_world.iter_mut().zip(&self.links);
        sums.chain(data.point_force_world.iter_mut().zip(&self.fruit)).for_each(|(sum, own)| *sum += own);
    }

    fn put_back(self, data: &mut Data) {
        (data.body_force_world, data.point_force_world) = (self.links, self.fruit);
    }
}

/// State of the unbroken, straight tree with every fruit on its stem.
fn unbroken(spec: &Spec, model: &Model, tree: &TreeBody, fruit: &FruitSet) -> Data {
    let mut data = Data::new(model);
    tree.reset(model, &mut data, &spec.wood);
    fruit.reset(model, &mut data);
    data
}
