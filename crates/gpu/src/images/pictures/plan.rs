//! Contents of the buffers of some pictures: views, bodies, solids, and the table of shots and items.

use orchard_camera::Item;
use orchard_camera::picture::recipe::{self, LightView, Recipe, casts_shadow};
use orchard_geometry::{Intrinsics, Pose};
use rayon::prelude::*;

use super::super::buffers::{Groups, Header, PIXEL_BYTES, SOLID_BYTES, Sizes, VIEWS_ALIGNED};
use super::super::pipelines::BOUND_THREADS;
use super::super::solids::{CORNERS, WORDS, of_items, pose_quads};
use super::super::tiles;
use super::table::{self, HEAD, NO_SUN, Shot, Words};
use super::{Lit, PictureBatch};
use crate::layout::QUAD;

/// Marks of solids are wanted: `WANTS_MARKS` of the kernels.
const MARKS: u32 = 2;
/// Bit of the items that are sent, in the second word of a solid.
const LOOSE: u32 = 1 << 31;

/// Kinds of views: pictures, maps of the sun, and of the sky.
pub(super) const KINDS: usize = 3;

/// A picture: its size, the first word of its bytes, and their number.
pub(super) struct Drawn {
    pub width: usize,
    pub height: usize,
    pub words: usize,
    pub bytes: usize,
}

/// Contents of the buffers, and what is to be dispatched.
pub(super) struct Plan {
    pub sizes: Sizes,
    pub headers: Vec<Header>,
    pub bodies: Vec<[[f32; QUAD]; 2]>,
    /// Solids that are sent, which lie behind those that stay.
    pub solids: Vec<[u32; WORDS]>,
    /// Shots and items that are sent, which lie behind those that stay.
    pub quads: Vec<Words>,
    /// Quads of the whole table.
    pub table: usize,
    /// First views and workgroups of each kind.
    pub kinds: [(usize, Groups); KINDS],
    /// Pictures, scene by scene.
    pub shots: Vec<Drawn>,
    /// Pixels and words of all pictures.
    pub pixels: usize,
    pub words: usize,
    /// Largest number of columns or rows of a view, and of bodies.
    pub longest: usize,
    pub most_bodies: usize,
}

/// Share of one scene in a plan: its light, and the solids, items and bodies that are sent for it.
struct Packed {
    recipe: Recipe,
    /// First solids and items that stay, and numbers of solids: of casters of shadow, and all.
    kept: (usize, usize),
    kept_counts: [usize; 2],
    /// Solids that are sent, and the same numbers.
    solids: Vec<[u32; WORDS]>,
    counts: [usize; 2],
    /// Items that are sent, and the quads before them.
    items: (Vec<Words>, usize),
    /// Bodies in the world, the world itself, and the world before the camera of each view: of pictures, sun and sky.
    bodies: Vec<[[f32; QUAD]; 2]>,
    /// Number of those before the views'.
    still: usize,
}

/// Bytes that a scene needs of the depths and of the solids before cameras, and the largest number of its views of a kind.
pub(super) fn needs(lit: &Lit<'_>, batch: &PictureBatch) -> [usize; 3] {
    let samples = |(k, _): &(Intrinsics, Pose)| {
        let k = recipe::samples(&lit.style, k);
        k.width * k.height
    };
    let shadows = lit.style.shadows;
    let skies = if shadows.sky > 0 { recipe::SKY_DIRECTIONS } else { 0 };
    let maps = shadows.sun * shadows.sun + skies * shadows.sky * shadows.sky;
    let pixels = lit.cameras.iter().map(samples).sum::<usize>() + maps;
    // An item that is sent has one solid but for hulls and uneven ground, which the limits checked later allow for.
    let kept = |of: fn(&PictureBatch, usize) -> usize| lit.kept.map_or(0, |(place, _)| of(batch, place));
    let all = lit.loose.items.len() + kept(|batch, place| batch.solids.len(place));
    let casters = lit.loose.items.len() + kept(|batch, place| batch.solids.first_count(place));
    let posed = lit.cameras.len() * all + (1 + skies) * casters;
    [PIXEL_BYTES * pixels, SOLID_BYTES * posed, skies.max(lit.cameras.len())]
}

/// Solids of some items with those that cast shadow before the others, and the number of the former.
pub(super) fn casters_first(items: &[Item], solids: Vec<[u32; WORDS]>) -> (Vec<[u32; WORDS]>, usize) {
    let (mut first, others): (Vec<_>, Vec<_>) =
        solids.into_iter().partition(|words| casts_shadow(&items[words[1] as usize]));
    let casters = first.len();
    first.extend(others);
    (first, casters)
}

impl Packed {
    fn new(lit: &Lit<'_>, batch: &PictureBatch) -> Self {
        let PictureBatch { meshes, palette, solids: kept_solids, items: kept_items, .. } = batch;
        let x_world_body = lit.kept.map_or(&[][..], |(_, poses)| poses);
        let world = x_world_body.len() as u32;
        let loose = &lit.loose.items;
        let (mut solids, casters) = casters_first(loose, of_items(lit.loose, |_| world, meshes));
        solids.iter_mut().for_each(|words| words[1] |= LOOSE);
        let standing = lit.kept.map(|(place, _)| {
            let has = kept_solids.bodies(place);
            assert!(world as usize >= has, "a scene with {has} bodies was given {world} poses");
            kept_solids.scene(place)
        });
        let standing = standing.iter().flat_map(|scene| {
            let each = scene.items().iter().zip(scene.bodies());
            each.map(|(item, body)| (item, x_world_body[*body as usize] * item.x_world_item))
        });
        let all = standing.chain(loose.iter().map(|item| (item, item.x_world_item)));
        let recipe = Recipe::of(all, &lit.style);
        let kept = |of: fn(&PictureBatch, usize) -> usize| lit.kept.map_or(0, |(place, _)| of(batch, place));
        let cameras = lit.cameras.iter().map(|(_, x_world_camera)| x_world_camera);
        let lights = recipe.sun.iter().chain(&recipe.sky).map(|light| &light.x_world_light);
        let mut bodies: Vec<_> = x_world_body.iter().map(pose_quads).collect();
        bodies.push(pose_quads(&Pose::identity()));
        bodies.extend(cameras.chain(lights).map(|x_world_view| pose_quads(&x_world_view.inverse())));
        let head = kept(|batch, place| batch.items.first_count(place));
        Self {
            kept: (
                kept(|batch, place| batch.solids.first(place)),
                HEAD + lit.kept.map_or(0, |(place, _)| kept_items.first(place)) + head,
            ),
            kept_counts: [
                kept(|batch, place| batch.solids.first_count(place)),
                kept(|batch, place| batch.solids.len(place)),
            ],
            counts: [casters, solids.len()],
            solids,
            items: table::items(palette, loose),
            bodies,
            still: x_world_body.len() + 1,
            recipe,
        }
    }
}

/// Where what a scene sends begins: its solids, its bodies, and the pose of the world before the camera of its next view.
#[derive(Clone, Copy)]
struct Begin {
    solids: usize,
    bodies: usize,
    world_pose: usize,
}

impl Plan {
    pub fn new(lit: &[Lit<'_>], batch: &PictureBatch) -> Self {
        let packed: Vec<Packed> = lit.par_iter().map(|lit| Packed::new(lit, batch)).collect();
        let mut plan = Self {
            sizes: Sizes { corners: CORNERS * batch.meshes.len(), ..Sizes::default() },
            headers: Vec::new(),
            bodies: Vec::new(),
            solids: Vec::new(),
            quads: Vec::new(),
            table: 0,
            kinds: [(0, Groups::default()); KINDS],
            shots: Vec::new(),
            pixels: 0,
            words: 0,
            longest: 0,
            most_bodies: packed.iter().map(|packed| packed.still).max().unwrap_or(0),
        };
        let room = batch.solids.room();
        let mut begins: Vec<Begin> = Vec::with_capacity(packed.len());
        for packed in &packed {
            let bodies = plan.bodies.len();
            let world_pose = bodies + packed.still;
            begins.push(Begin { solids: room + plan.solids.len(), bodies, world_pose });
            plan.solids.extend_from_slice(&packed.solids);
            plan.bodies.extend_from_slice(&packed.bodies);
        }
        plan.view_pictures(lit, &packed, &mut begins);
        let sun = plan.view_maps(1, &packed, &mut begins, |recipe| recipe.sun.as_slice());
        let sky = plan.view_maps(2, &packed, &mut begins, |recipe| &recipe.sky);
        plan.sizes.solids = room + plan.solids.len();
        plan.sizes.views = plan.headers.len();
        plan.sizes.bodies = plan.bodies.len();
        plan.tabulate(lit, &packed, &sun, &sky, HEAD + batch.items.room());
        plan.table = HEAD + batch.items.room() + plan.quads.len();
        plan.sizes.read = plan.words;
        plan
    }

    /// Adds a view of a kind onto what a scene brings: all of it, or what casts shadow.
    fn view(&mut self, kind: usize, k: &Intrinsics, packed: &Packed, begin: &mut Begin) {
        let (which, wants) = if kind == 0 { (1, MARKS) } else { (0, 0) };
        let count = packed.kept_counts[which] + packed.counts[which];
        let sizes = &mut self.sizes;
        self.headers.push(Header {
            first: packed.kept.0 as u32,
            count: count as u32,
            kept_count: packed.kept_counts[which] as u32,
            loose_first: begin.solids as u32,
            posed: sizes.posed as u32,
            bodies: begin.bodies as u32,
            pixels: sizes.pixels as u32,
            size: (k.width | k.height << 16) as u32,
            wants,
            focal: [k.fx as f32, k.fy as f32],
            axis: [k.cx as f32, k.cy as f32],
            near: 0.0,
            far: f32::MAX,
            world_pose: begin.world_pose as u32,
        });
        begin.world_pose += 1;
        sizes.posed += count;
        sizes.pixels += k.width * k.height;
        self.longest = self.longest.max(k.width).max(k.height);
        let groups = &mut self.kinds[kind].1;
        groups.views += 1;
        groups.bound = groups.bound.max(count.div_ceil(BOUND_THREADS));
        groups.tiles = groups.tiles.max(tiles((k.width, k.height)));
    }

    fn view_pictures(&mut self, lit: &[Lit<'_>], packed: &[Packed], begins: &mut [Begin]) {
        for ((lit, packed), begin) in lit.iter().zip(packed).zip(begins) {
            for (k, _) in lit.cameras {
                self.view(0, &recipe::samples(&lit.style, k), packed, begin);
                let bytes = 3 * k.width * k.height;
                self.shots.push(Drawn { width: k.width, height: k.height, words: self.words, bytes });
                self.pixels += k.width * k.height;
                self.words += bytes.div_ceil(PIXEL_BYTES);
            }
        }
        self.sizes.items = self.sizes.pixels;
    }

    /// Adds the maps of some lights of each scene, from a view on where a binding can begin, and returns the first view of each scene.
    fn view_maps(
        &mut self,
        kind: usize,
        packed: &[Packed],
        begins: &mut [Begin],
        lights: impl Fn(&Recipe) -> &[LightView],
    ) -> Vec<u32> {
        if packed.iter().any(|packed| !lights(&packed.recipe).is_empty()) {
            let first = self.headers.len().next_multiple_of(VIEWS_ALIGNED);
            self.headers.resize(first, Header::default());
            self.kinds[kind].0 = first;
        }
        let mut views = Vec::with_capacity(packed.len());
        for (packed, begin) in packed.iter().zip(begins) {
            views.push(self.headers.len() as u32);
            for light in lights(&packed.recipe) {
                self.view(kind, &light.intrinsics, packed, begin);
            }
        }
        views
    }

    /// Lists shots and items that are sent; the first quad of them is given.
    fn tabulate(&mut self, lit: &[Lit<'_>], packed: &[Packed], sun: &[u32], sky: &[u32], first: usize) {
        let mut loose = first + table::SHOT * self.shots.len();
        let (mut view, mut pixels) = (0, 0);
        for (k, (lit, packed)) in lit.iter().zip(packed).enumerate() {
            for (_, x_world_camera) in lit.cameras {
                let drawn = &self.shots[view];
                let shot = Shot {
                    view: view as u32,
                    items: packed.kept.1 as u32,
                    loose: (loose + packed.items.1) as u32,
                    sun: packed.recipe.sun.map_or(NO_SUN, |_| sun[k]),
                    sky: sky[k],
                    pixels: pixels as u32,
                    words: drawn.words as u32,
                    x_world_camera,
                    style: &lit.style,
                    recipe: &packed.recipe,
                };
                self.quads.extend(shot.quads());
                (view, pixels) = (view + 1, pixels + drawn.width * drawn.height);
            }
            loose += packed.items.0.len();
        }
        packed.iter().for_each(|packed| self.quads.extend_from_slice(&packed.items.0));
    }
}
