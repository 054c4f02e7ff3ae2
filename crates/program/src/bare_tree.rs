//! A world's tree and fruit alone, for export to other engines; effects that those lack are switched off.

use anyhow::Context;
use orchard_exchange::mjcf;
use orchard_fruit::{FruitGroups, FruitSet};
use orchard_geometry::Vec3;
use orchard_multibody::{Data, Groups, Model, ModelBuilder, PointBody, Tether};
use orchard_spec::Spec;
use orchard_treegen::Skeleton;
use orchard_treephys::{Timber, TreeBody, TreeGroups};
use orchard_world::Planting;
use std::sync::Arc;

/// A tree with its fruit as a model without drag, reaction cap and contacts. Link i is segment i.
pub struct BareTree {
    /// Name of the model.
    pub name: String,
    /// The world's config with the constants of this tree.
    pub spec: Arc<Spec>,
    /// The grown tree.
    pub skeleton: Skeleton,
    /// Links of the tree.
    pub tree: TreeBody,
    /// Multibody model of the tree.
    pub model: Model,
    /// State of the model: q = 0, at rest.
    pub data: Data,
    /// Gravity \[m/s^2\], world.
    pub gravity: Vec3,
}

impl BareTree {
    /// Makes the tree of a world as in its first episode.
    pub fn new(spec: &Spec, seed: u64, world: u32) -> anyhow::Result<Self> {
        let spec = Arc::new(spec.clone());
        let name = format!("{}-{seed}-{world}", spec.preset);
        let planting =
            Planting::draw(&spec, seed, world, 0).with_context(|| format!("seed {seed}, tree {world}"))?;
        Self::of_planting(planting, name, seed, world)
    }

    /// Makes the model of a given tree; seed and world choose its fruit and wood.
    pub fn of_skeleton(
        spec: &Spec,
        skeleton: Skeleton,
        name: String,
        seed: u64,
        world: u32,
    ) -> anyhow::Result<Self> {
        let spec = Arc::new(spec.clone());
        Self::of_planting(Planting::of_tree(spec, skeleton, seed, world), name, seed, world)
    }

    fn of_planting(planting: Planting, name: String, seed: u64, world: u32) -> anyhow::Result<Self> {
        let Planting { spec, skeleton, fruit, .. } = planting;
        let gravity = spec.sim.gravity.si();
        let mut builder = ModelBuilder::new();
        let no_contact = TreeGroups { wood: Groups::NONE, debris: Groups::NONE };
        let timber = Timber::draw(&skeleton, &spec.wood, seed, world);
        let tree = TreeBody::of_timber(&mut builder, &skeleton, &spec.wood, &timber, no_contact);

        let mut capped = builder.clone();
        FruitSet::add_to(
            &mut capped,
            fruit,
            &tree.bodies,
            &skeleton,
            &spec.fruit.on_tethers(),
            gravity,
            FruitGroups { hanging: Groups::NONE, loose: Groups::NONE, passed: Groups::NONE },
        );
        for point in capped.build()?.points() {
            builder.add_point(without_cap(point));
        }

        let model = builder.build()?;
        let mut data = Data::new(&model);
        tree.reset(&model, &mut data, &spec.wood);
        data.linear_drag.fill(0.0);
        data.angular_drag.fill(0.0);
        Ok(Self { name, spec, skeleton, tree, model, data, gravity: Vec3::new(0.0, 0.0, -gravity) })
    }

    /// The model as MJCF for steps of `h` \[s\].
    pub fn mjcf(&self, h: f64) -> anyhow::Result<String> {
        Ok(mjcf::write(&self.name, &self.model, &self.data, &self.gravity, h)?)
    }
}

fn without_cap(point: &PointBody) -> PointBody {
    let free = |tether: &Tether| Tether { reaction_cap: f64::INFINITY, ..tether.clone() };
    PointBody { tether: point.tether.as_ref().map(free), ..point.clone() }
}
