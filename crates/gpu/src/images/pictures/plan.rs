//! What is sent to draw some pictures.

use orchard_camera::picture::recipe::{self, Palette, Recipe, casts_shadow};
use orchard_geometry::{Intrinsics, Pose};
use rayon::prelude::*;

use super::super::buffers::{Groups, Header, PIXEL_BYTES, Sizes, VIEWS_ALIGNED};
use super::super::pipelines::BOUND_THREADS;
use super::super::solids::{CORNERS, Meshes, WORDS, of_items, pose_quads};
use super::super::tiles;
use super::Lit;
use super::table::{self, ITEM, NO_SUN, SHOTS, Shot, Words};
use crate::layout::QUAD;

/// Marks of solids are wanted: `WANTS_MARKS` of the kernels.
const MARKS: u32 = 2;

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
    pub solids: Vec<[u32; WORDS]>,
    pub table: Vec<Words>,
    /// First views and workgroups of pictures, of the sun's maps, and of the sky's.
    pub kinds: [(usize, Groups); 3],
    /// Pictures, scene by scene.
    pub shots: Vec<Drawn>,
    /// Pixels and words of all pictures.
    pub pixels: usize,
    pub words: usize,
    /// Largest number of columns or rows of a view.
    pub longest: usize,
}

/// What a scene brings to the plan.
struct Packed {
    recipe: Recipe,
    /// Solids that cast shadow, then the others.
    solids: Vec<[u32; WORDS]>,
    casters: usize,
    items: Vec<Words>,
}

/// Bytes of the depths that a scene needs, and the largest number of views of a kind.
pub(super) fn needs(lit: &Lit<'_>) -> (usize, usize) {
    let samples = |(k, _): &(Intrinsics, Pose)| {
        let k = recipe::samples(&lit.style, k);
        k.width * k.height
    };
    let shadows = lit.style.shadows;
    let skies = if shadows.sky > 0 { recipe::SKY_DIRECTIONS } else { 0 };
    let maps = shadows.sun * shadows.sun + skies * shadows.sky * shadows.sky;
    let pixels = lit.cameras.iter().map(samples).sum::<usize>() + maps;
    (PIXEL_BYTES * pixels, skies.max(lit.cameras.len()))
}

impl Packed {
    fn new(lit: &Lit<'_>, palette: &Palette, meshes: &Meshes) -> Self {
        let items = &lit.scene.items;
        let solids = of_items(lit.scene, |_| 0, meshes);
        let (casting, others): (Vec<_>, Vec<_>) =
            solids.into_iter().partition(|words| casts_shadow(&items[words[1] as usize]));
        Self {
            recipe: Recipe::new(lit.scene, &lit.style),
            casters: casting.len(),
            solids: [casting, others].concat(),
            items: items.iter().flat_map(|item| table::item(palette, item)).collect(),
        }
    }
}

impl Plan {
    pub fn new(lit: &[Lit<'_>], meshes: &Meshes, head: &[Words]) -> Self {
        let palette = Palette::default();
        let packed: Vec<Packed> = lit.par_iter().map(|lit| Packed::new(lit, &palette, meshes)).collect();
        let mut plan = Self {
            sizes: Sizes { corners: CORNERS * meshes.len(), ..Sizes::default() },
            headers: Vec::new(),
            bodies: Vec::new(),
            solids: Vec::new(),
            table: head.to_vec(),
            kinds: [(0, Groups::default()); 3],
            shots: Vec::new(),
            pixels: 0,
            words: 0,
            longest: 0,
        };
        let firsts = packed.iter().scan(0, |end, packed| {
            let first = *end;
            *end += packed.solids.len();
            Some(first)
        });
        let firsts: Vec<usize> = firsts.collect();
        plan.solids = packed.iter().flat_map(|packed| packed.solids.iter().copied()).collect();
        plan.sizes.solids = plan.solids.len();
        plan.view_pictures(lit, &packed, &firsts);
        let sun = plan.view_maps(1, &packed, &firsts, |recipe| recipe.sun.as_slice());
        let sky = plan.view_maps(2, &packed, &firsts, |recipe| &recipe.sky);
        plan.sizes.views = plan.headers.len();
        plan.sizes.bodies = plan.bodies.len();
        plan.tabulate(lit, &packed, &sun, &sky);
        plan.sizes.read = plan.words;
        plan
    }

    /// Bytes of the table.
    pub fn table_bytes(&self) -> usize {
        size_of_val(&*self.table)
    }

    /// Adds a view of a kind onto some solids.
    fn view(
        &mut self,
        kind: usize,
        k: &Intrinsics,
        x_world_camera: &Pose,
        (first, count): (usize, usize),
        wants: u32,
    ) {
        let sizes = &mut self.sizes;
        self.headers.push(Header {
            first: first as u32,
            count: count as u32,
            posed: sizes.posed as u32,
            bodies: self.bodies.len() as u32,
            pixels: sizes.pixels as u32,
            size: (k.width | k.height << 16) as u32,
            wants,
            focal: [k.fx as f32, k.fy as f32],
            axis: [k.cx as f32, k.cy as f32],
            near: 0.0,
            far: f32::MAX,
            ..Header::default()
        });
        self.bodies.push(pose_quads(&x_world_camera.inverse()));
        sizes.posed += count;
        sizes.pixels += k.width * k.height;
        self.longest = self.longest.max(k.width).max(k.height);
        let groups = &mut self.kinds[kind].1;
        groups.views += 1;
        groups.bound = groups.bound.max(count.div_ceil(BOUND_THREADS));
        groups.tiles = groups.tiles.max(tiles((k.width, k.height)));
    }

    /// Begins the views of a kind, where a binding can begin.
    fn begin(&mut self, kind: usize) {
        let first = self.headers.len().next_multiple_of(VIEWS_ALIGNED);
        self.headers.resize(first, Header::default());
        self.kinds[kind].0 = first;
    }

    fn view_pictures(&mut self, lit: &[Lit<'_>], packed: &[Packed], firsts: &[usize]) {
        for ((lit, packed), first) in lit.iter().zip(packed).zip(firsts) {
            for (k, x_world_camera) in lit.cameras {
                let samples = recipe::samples(&lit.style, k);
                self.view(0, &samples, x_world_camera, (*first, packed.solids.len()), MARKS);
                let bytes = 3 * k.width * k.height;
                self.shots.push(Drawn { width: k.width, height: k.height, words: self.words, bytes });
                self.pixels += k.width * k.height;
                self.words += bytes.div_ceil(PIXEL_BYTES);
            }
        }
        self.sizes.items = self.sizes.pixels;
    }

    /// Adds the maps of some lights of each scene, and returns the first view of each.
    fn view_maps(
        &mut self,
        kind: usize,
        packed: &[Packed],
        firsts: &[usize],
        lights: impl Fn(&Recipe) -> &[recipe::LightView],
    ) -> Vec<u32> {
        self.begin(kind);
        let mut views = Vec::with_capacity(packed.len());
        for (packed, first) in packed.iter().zip(firsts) {
            views.push(self.headers.len() as u32);
            for light in lights(&packed.recipe) {
                self.view(kind, &light.intrinsics, &light.x_world_light, (*first, packed.casters), 0);
            }
        }
        views
    }

    /// Fills the table behind its head.
    fn tabulate(&mut self, lit: &[Lit<'_>], packed: &[Packed], sun: &[u32], sky: &[u32]) {
        let shots = self.shots.len();
        let mut items = SHOTS + table::SHOT * shots;
        let (mut view, mut pixels) = (0, 0);
        for (k, (lit, packed)) in lit.iter().zip(packed).enumerate() {
            for (_, x_world_camera) in lit.cameras {
                let drawn = &self.shots[view];
                let shot = Shot {
                    view: view as u32,
                    items: items as u32,
                    sun: packed.recipe.sun.map_or(NO_SUN, |_| sun[k]),
                    sky: sky[k],
                    pixels: pixels as u32,
                    words: drawn.words as u32,
                    x_world_camera,
                    style: &lit.style,
                    recipe: &packed.recipe,
                };
                self.table.extend(shot.quads());
                (view, pixels) = (view + 1, pixels + drawn.width * drawn.height);
            }
            items += packed.items.len();
        }
        self.table.extend(packed.iter().flat_map(|packed| packed.items.iter().copied()));
        debug_assert!(packed.iter().all(|packed| packed.items.len().is_multiple_of(ITEM)));
    }
}
