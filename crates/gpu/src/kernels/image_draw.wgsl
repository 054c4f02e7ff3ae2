// Draws images, a workgroup a tile: a depth buffer in workgroup memory into which threads draw solids. The nearest surface wins whatever
// the order, so that an image has the same bits in every run.

// Bits of the depth of the nearest surface.
var<workgroup> nearest_bits: array<atomic<u32>, TILE_PIXELS>;
// Mark of the first solid whose surface lies there: its number in the view, and the triangle of a blade in the lowest four bits.
var<workgroup> first_mark: array<atomic<u32>, TILE_PIXELS>;
// Solids that cover many pixels of the tile: all threads draw each of them together.
var<workgroup> wide: array<u32, WIDE_MOST>;
var<workgroup> wide_count: atomic<u32>;

const NO_ITEM: u32 = 0xffffffffu;
// What a view wants besides depths, from `Header::wants`.
const WANTS_MARKS: u32 = 2u;
// Depths that differ by less than this share are of one surface: the rounding of a hit.
const SAME: f32 = 1e-6;

// Part of a rectangle in a tile: first column and row, number of columns and rows.
struct Part {
    first: vec2u,
    count: vec2u,
}

struct Tile {
    view: View,
    first: vec2u,
    // Last column and row.
    last: vec2u,
}

fn part_of(rectangle: vec2u, tile: Tile) -> Part {
    let low = max(rectangle & vec2u(0xffffu), tile.first);
    let high = min(rectangle >> vec2u(16u), tile.last);
    return Part(low, select(vec2u(0u), high + 1u - low, high >= low));
}

fn ray_of(pixel: vec2u, view: View) -> vec3f {
    return vec3f((vec2f(pixel) - view.axis) / view.focal, 1.0);
}

// Draws the pixels of a part whose number is `start` modulo `step`: their depths, or in the second sweep their marks.
fn draw_part(tile: Tile, solid: Prepared, mark: u32, part: Part, start: u32, step: u32, second: bool) {
    let count = part.count.x * part.count.y;
    for (var k = start; k < count; k += step) {
        let pixel = part.first + vec2u(k % part.count.x, k / part.count.x);
        let at_tile = pixel - tile.first;
        let place = at_tile.y * TILE_WIDTH + at_tile.x;
        let t = hit(solid, ray_of(pixel, tile.view));
        if t >= NOTHING {
            continue;
        }
        if !second {
            atomicMin(&nearest_bits[place], bitcast<u32>(t));
        } else if t <= bitcast<f32>(atomicLoad(&nearest_bits[place])) * (1.0 + SAME) {
            atomicMin(&first_mark[place], mark);
        }
    }
}

fn draw_solid(tile: Tile, index: u32, start: u32, step: u32, second: bool) {
    let solid = posed[index];
    let mark = (index - tile.view.posed) << 4u;
    let part = part_of(rectangles[index], tile);
    if kind_of(solid) != BLADE {
        draw_part(tile, prepare(solid), mark, part, start, step, second);
        return;
    }
    for (var k = 0u; k < BLADE_CORNERS; k += 3u) {
        let p = corner(solid, k);
        let q = corner(solid, k + 1u);
        let r = corner(solid, k + 2u);
        let own = part_of(rectangle(of_triangle(p, q, r), tile.view), tile);
        draw_part(tile, prepare_triangle(p, q, r), mark + k / 3u, own, start, step, second);
    }
}

@compute @workgroup_size(THREADS)
fn draw(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let view = views[group.y];
    let size = vec2u(view.size & 0xffffu, view.size >> 16u);
    let columns = (size.x + TILE_WIDTH - 1u) / TILE_WIDTH;
    let first = vec2u(group.x % columns * TILE_WIDTH, group.x / columns * TILE_HEIGHT);
    if first.y >= size.y {
        return;
    }
    let last = min(first + vec2u(TILE_WIDTH, TILE_HEIGHT), size) - 1u;
    let tile = Tile(view, first, last);
    for (var k = thread; k < TILE_PIXELS; k += THREADS) {
        atomicStore(&nearest_bits[k], bitcast<u32>(NOTHING));
        atomicStore(&first_mark[k], NO_ITEM);
    }
    for (var sweep = 0u; sweep <= min(view.wants, 1u); sweep++) {
        if thread == 0u {
            atomicStore(&wide_count, 0u);
        }
        workgroupBarrier();
        for (var k = thread; k < view.count; k += THREADS) {
            let index = view.posed + k;
            let part = part_of(rectangles[index], tile);
            let covered = part.count.x * part.count.y;
            if covered == 0u {
                continue;
            }
            if covered > ALONE {
                let slot = atomicAdd(&wide_count, 1u);
                if slot < WIDE_MOST {
                    wide[slot] = index;
                    continue;
                }
            }
            draw_solid(tile, index, 0u, 1u, sweep == 1u);
        }
        workgroupBarrier();
        let together = min(atomicLoad(&wide_count), WIDE_MOST);
        for (var k = 0u; k < together; k++) {
            draw_solid(tile, wide[k], thread, THREADS, sweep == 1u);
        }
        workgroupBarrier();
    }
    let count = last + 1u - first;
    for (var k = thread; k < count.x * count.y; k += THREADS) {
        let at_tile = vec2u(k % count.x, k / count.x);
        let place = at_tile.y * TILE_WIDTH + at_tile.x;
        let z = bitcast<f32>(atomicLoad(&nearest_bits[place]));
        let is_valid = z < NOTHING && z >= view.near && z <= view.far;
        let pixel = view.pixels + (first.y + at_tile.y) * size.x + first.x + at_tile.x;
        depths[pixel] = select(0.0, z, is_valid);
        if view.wants == 0u {
            continue;
        }
        let mark = atomicLoad(&first_mark[place]);
        if !is_valid || mark == NO_ITEM {
            items[pixel] = NO_ITEM;
        } else if view.wants == WANTS_MARKS {
            items[pixel] = mark;
        } else {
            items[pixel] = posed[view.posed + (mark >> 4u)].a.y;
        }
    }
}
