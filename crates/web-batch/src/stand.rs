//! A stand of trees, each with its fruit, without robots.

use std::sync::Arc;

use orchard_batch::{Status, TreeWorld};
use orchard_geometry::{Vec3, transform};
use orchard_gpu::PackedTrees;
use orchard_multibody::forward_kinematics;
use orchard_spec::{Preset, Purpose, Spec, Stream};
use serde::{Deserialize, Serialize};

/// Most trees of a stand, our own choice: more fill a page with dots.
const MOST: u32 = 1024;
/// Largest shake \[rad/s\], that of the benchmark of batches (`scaling.kick`).
const HARDEST: f64 = 1.0;

/// Options of a stand, as a page gives them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Asked {
    /// Preset of the trees.
    pub preset: String,
    /// Seed.
    pub seed: u32,
    /// Number of trees.
    pub worlds: u32,
    /// Largest rate that the shake gives a joint \[rad/s\], 0 to 1.
    pub shake: f64,
}

impl Default for Asked {
    fn default() -> Self {
        Self { preset: Preset::Paper.name().to_owned(), seed: 20_250_704, worlds: 64, shake: HARDEST }
    }
}

/// Figures of a stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Figures {
    /// Joints that broke.
    pub snapped: u32,
    /// Fruit that came off.
    pub detached: u32,
    /// Trees that are no longer finite and stand still.
    pub stopped: u32,
}

/// A stand as seen from the side, tree by tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// For each tree the number of its segments and of its fruit.
    pub counts: Vec<[u32; 2]>,
    /// For each segment the places of its ends along x and z, and its radius \[m\].
    pub lines: Vec<[f32; 5]>,
    /// For each fruit its place along x and z, its radius \[m\], and 1 on its stem, else 0.
    pub dots: Vec<[f32; 4]>,
}

/// A stand of trees.
pub struct Stand {
    spec: Arc<Spec>,
    asked: Asked,
    worlds: Vec<TreeWorld>,
    packed: Option<PackedTrees>,
}

impl Stand {
    /// A stand whose trees are yet to grow.
    ///
    /// # Errors
    /// An unknown preset, a number of trees or a shake out of its range.
    pub fn new(asked: &Asked) -> Result<Self, String> {
        let names = || Preset::ALL.iter().map(|preset| preset.name()).collect::<Vec<_>>().join(", ");
        let preset: Preset = asked
            .preset
            .parse()
            .map_err(|_| format!("preset `{:.40}` is unknown; the presets are: {}", asked.preset, names()))?;
        if !(1..=MOST).contains(&asked.worlds) {
            return Err(format!("worlds is {}; the allowed range is [1, {MOST}]", asked.worlds));
        }
        if !(0.0..=HARDEST).contains(&asked.shake) {
            return Err(format!("shake is {} rad/s; the allowed range is [0, {HARDEST}] rad/s", asked.shake));
        }
        let spec = Arc::new(Spec::preset(preset));
        Ok(Self { spec, asked: asked.clone(), worlds: Vec::new(), packed: None })
    }

    /// Grows the next tree, shaken: every joint has a random rate. Returns false when all trees are there.
    ///
    /// # Errors
    /// The tree cannot be built.
    pub fn grow_one(&mut self) -> Result<bool, String> {
        let index = self.worlds.len() as u32;
        if index == self.asked.worlds {
            return Ok(false);
        }
        let seed = u64::from(self.asked.seed);
        let grown = TreeWorld::grow(self.spec.clone(), seed, index);
        let mut world = grown.map_err(|e| format!("tree {index} of seed {seed} cannot be built: {e}"))?;
        let mut stream = Stream::new(seed, index, Purpose::ScalingKick);
        for v in &mut world.data_mut().v {
            *v = stream.uniform(-self.asked.shake, self.asked.shake);
        }
        self.worlds.push(world);
        self.packed = None;
        Ok(self.worlds.len() < self.asked.worlds as usize)
    }

    /// Number of trees that have grown.
    pub fn len(&self) -> usize {
        self.worlds.len()
    }

    /// True before the first tree.
    pub fn is_empty(&self) -> bool {
        self.worlds.is_empty()
    }

    /// The trees that have grown, as they were shaken.
    pub fn worlds(&self) -> &[TreeWorld] {
        &self.worlds
    }

    /// The trees, packed for a device.
    ///
    /// # Errors
    /// The kernels cannot step them.
    pub fn packed(&mut self) -> Result<&mut PackedTrees, String> {
        if self.packed.is_none() {
            self.packed = Some(PackedTrees::new(&self.worlds).map_err(|e| e.to_string())?);
        }
        self.packed.as_mut().ok_or_else(|| "no trees".to_owned())
    }

    /// Figures of the state that was taken last.
    pub fn figures(&self) -> Figures {
        let mut figures = Figures { snapped: 0, detached: 0, stopped: 0 };
        let Some(packed) = &self.packed else { return figures };
        for index in 0..packed.len() {
            let [snapped, detached] = packed.lost(index);
            figures.snapped += snapped;
            figures.detached += detached;
            figures.stopped += u32::from(packed.status(index) != Status::Running);
        }
        figures
    }

    /// Angles of all joints of a tree in the state that was taken last \[rad\]; those at the start before.
    pub fn angles(&self, index: usize) -> Vec<f64> {
        let mut data = self.worlds[index].data().clone();
        if let Some(packed) = &self.packed {
            packed.store(index, &mut data);
        }
        data.q
    }

    /// The stand in the state that was taken last; a tree in quarantine stands as at the start.
    pub fn picture(&self) -> Picture {
        let mut picture = Picture { counts: Vec::new(), lines: Vec::new(), dots: Vec::new() };
        for (index, world) in self.worlds.iter().enumerate() {
            let (plant, mut data) = (world.plant(), world.data().clone());
            if let Some(packed) =
                self.packed.as_ref().filter(|packed| packed.status(index) == Status::Running)
            {
                packed.store(index, &mut data);
            }
            forward_kinematics(&plant.model, &mut data);
            let side = |p: &Vec3| [p.x as f32, p.z as f32];
            for (&id, &collider) in plant.tree.bodies.iter().zip(&plant.tree.colliders) {
                let x_world_body = data.x_world_body(id);
                let p_tip_world = transform(x_world_body, &(plant.model.body(id).inertia.p_com * 2.0));
                let ([x, z], [u, w]) = (side(&x_world_body.translation.vector), side(&p_tip_world));
                let radius = match plant.model.collider(collider).shape {
                    orchard_geometry::Shape::Capsule { radius, .. } => radius as f32,
                    _ => 0.0,
                };
                picture.lines.push([x, z, u, w, radius]);
            }
            for (fruit, point) in plant.fruit.fruit.iter().zip(&plant.fruit.points) {
                let [x, z] = side(&data.point_p_world[point.index()]);
                let hangs = f32::from(u8::from(data.tethered[point.index()]));
                picture.dots.push([x, z, fruit.radius as f32, hangs]);
            }
            picture.counts.push([plant.tree.bodies.len() as u32, plant.fruit.fruit.len() as u32]);
        }
        picture
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stand(asked: &Asked) -> Stand {
        let mut stand = Stand::new(asked).unwrap();
        while stand.grow_one().unwrap() {}
        stand
    }

    #[test]
    fn a_picture_has_every_segment_and_fruit_as_they_stand() {
        let mut stand = stand(&Asked { worlds: 2, ..Asked::default() });
        let bare = stand.picture();
        stand.packed().unwrap();
        let packed = stand.picture();
        assert_eq!(bare.counts, packed.counts);
        assert_eq!(bare.lines.len() as u32, bare.counts.iter().map(|[segments, _]| segments).sum::<u32>());
        assert_eq!(bare.dots.len() as u32, bare.counts.iter().map(|[_, fruit]| fruit).sum::<u32>());
        // The packed state is in f32.
        let near = |a: &[f32; 5], b: &[f32; 5]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(bare.lines.iter().zip(&packed.lines).all(|(a, b)| near(a, b)));
        assert!(bare.dots.iter().all(|[_, z, radius, hangs]| *z > *radius && *hangs == 1.0));
        assert_eq!(stand.figures(), Figures { snapped: 0, detached: 0, stopped: 0 });
        assert!(!stand.grow_one().unwrap() && stand.len() == 2);
    }

    #[test]
    fn a_tree_that_is_not_finite_stands_as_at_the_start() {
        let mut stand = stand(&Asked { worlds: 1, ..Asked::default() });
        let start = stand.picture();
        let packed = stand.packed().unwrap();
        // A number in every field of a world, the frame in which it stopped among them, and none in those of its links.
        for (name, number) in [("worlds", 1.0_f32), ("links", f32::NAN)] {
            let bytes = packed.buffers().iter().find(|buffer| buffer.name == name).unwrap().bytes.len();
            let filled: Vec<u8> = number.to_ne_bytes().iter().copied().cycle().take(bytes).collect();
            assert!(packed.take(name, &filled));
        }
        assert_eq!(stand.figures().stopped, 1);
        assert_eq!(stand.picture(), start);
    }

    #[test]
    fn a_tree_of_every_preset_is_packed() {
        for preset in Preset::ALL {
            let asked = Asked { preset: preset.name().to_owned(), worlds: 1, ..Asked::default() };
            assert_eq!(stand(&asked).packed().map(|packed| packed.len()), Ok(1), "{}", preset.name());
        }
    }

    #[test]
    fn a_shake_gives_every_joint_a_rate_within_it() {
        let fastest = |shake: f64| {
            let stand = stand(&Asked { worlds: 1, shake, ..Asked::default() });
            stand.worlds()[0].data().v.iter().fold(0.0_f64, |most, v| most.max(v.abs()))
        };
        assert_eq!(fastest(0.0), 0.0);
        assert!((0.04..=0.05).contains(&fastest(0.05)) && (0.8..=1.0).contains(&fastest(1.0)));
    }

    #[test]
    fn what_cannot_stand_is_named() {
        let refused = |asked: &Asked| Stand::new(asked).map(|_| ()).unwrap_err();
        let e = refused(&Asked { preset: "lemon".into(), ..Asked::default() });
        assert!(e.starts_with("preset `lemon` is unknown; the presets are: paper, "), "{e}");
        let e = refused(&Asked { worlds: 0, ..Asked::default() });
        assert_eq!(e, "worlds is 0; the allowed range is [1, 1024]");
        assert!(refused(&Asked { worlds: 2000, ..Asked::default() }).starts_with("worlds is 2000"));
        let e = refused(&Asked { shake: f64::NAN, ..Asked::default() });
        assert_eq!(e, "shake is NaN rad/s; the allowed range is [0, 1] rad/s");
    }
}
