// Colour pictures: lights the surfaces that the samples of each pixel show, which the kernels of images have found, with shadow maps, which they
// have drawn too. Equations: `orchard_camera::picture`; figures have its names. Bindings are those of images, with two buffers in the place of others.

// Numbers: noise and directions of the sky, items of scenes that stay, shots, and items that are sent.
@group(0) @binding(1) var<storage, read> table: array<vec4u>;
// A word a pixel: red, green and blue from the lowest byte.
@group(0) @binding(5) var<storage, read_write> colours: array<u32>;
// The same without gaps, picture after picture, in whole words.
@group(0) @binding(7) var<storage, read_write> packed: array<u32>;

// A picture that is to be lit.
struct Shot {
    view: u32,
    // Records of its items that stay, and of those that are sent.
    items: u32,
    loose: u32,
    // View of the sun's map, or NO_SUN.
    sun: u32,
    // First view of the sky's maps.
    sky: u32,
    // Samples a pixel side.
    side: u32,
    // 1 if each object of a pixel is lit once.
    once: u32,
    // Number of the sky's maps.
    sky_count: u32,
    // First of its pixels in `colours`, and of its words in `packed`.
    pixels: u32,
    words: u32,
    turn: vec4f,
    place: vec3f,
    haze_length: f32,
    sun_world: vec3f,
    // Offset and tolerance of the sun's map.
    sun_offset: f32,
    sun_color: vec3f,
    sun_bias: f32,
    glow: vec3f,
    sky_bias: f32,
    horizon: vec3f,
    zenith: vec3f,
    from_above: vec3f,
    from_below: vec3f,
}

const NO_SUN: u32 = 0xffffffffu;
const NOTHING_MET: u32 = 0xffffffffu;

fn quad(at: u32) -> vec4f {
    return bitcast<vec4f>(table[at]);
}

fn shot_of(k: u32) -> Shot {
    let at = table[0].x + SHOT_QUADS * k;
    let head = table[at];
    let next = table[at + 1u];
    let rest = table[at + 2u];
    let place = quad(at + 4u);
    let sun = quad(at + 5u);
    let color = quad(at + 6u);
    let glow = quad(at + 7u);
    return Shot(
        head.x, head.y, rest.y, head.z, head.w,
        next.x, next.y, next.z, next.w,
        rest.x,
        quad(at + 3u),
        place.xyz, place.w,
        sun.xyz, sun.w,
        color.xyz, color.w,
        glow.xyz, glow.w,
        quad(at + 8u).xyz, quad(at + 9u).xyz, quad(at + 10u).xyz, quad(at + 11u).xyz,
    );
}

// A surface that a ray of the picture meets.
struct Surface {
    p_world: vec3f,
    // Unit normal on the viewer's side.
    n_world: vec3f,
    // True if that is the outer side of the geometry.
    outer_side: bool,
    // Unit direction from the viewer.
    view_world: vec3f,
    // Record of its item, and the first of such records; the point in the frame of the item's body.
    item: u32,
    items: u32,
    p_body: vec3f,
}

// Normal of a solid (not normalised) where a ray meets it, before the camera.
fn normal_at(solid: Solid, triangle: u32, p: vec3f) -> vec3f {
    switch kind_of(solid) {
        case BALL: { return p - p_of(solid); }
        case CAPSULE: {
            let axis = q_of(solid);
            let along = clamp(dot(p - p_of(solid), axis), 0.0, end_of(solid).x);
            return p - p_of(solid) - axis * along;
        }
        case BOX: {
            let box = prepare(solid);
            let local = vec3f(dot(box.a.xyz, p) + box.a.w, dot(box.b.xyz, p) + box.b.w, dot(box.c.xyz, p) + box.c.w);
            let at = local / box.d.xyz;
            let size = abs(at);
            if size.x >= size.y && size.x >= size.z {
                return box.a.xyz * sign(at.x);
            }
            if size.y >= size.z {
                return box.b.xyz * sign(at.y);
            }
            return box.c.xyz * sign(at.z);
        }
        case PLANE: { return p_of(solid); }
        case TRIANGLE: { return cross(q_of(solid) - p_of(solid), end_of(solid).xyz - p_of(solid)); }
        default: {
            let a = corner(solid, 3u * triangle);
            return cross(corner(solid, 3u * triangle + 1u) - a, corner(solid, 3u * triangle + 2u) - a);
        }
    }
}

// Linear light of a sample, the `k`-th of `n` of its pixel.
fn light_of(shot: Shot, view: View, sample: vec2u, mark: u32, k: u32, n: u32) -> vec3f {
    let ray = vec3f((vec2f(sample) - view.axis) / view.focal, 1.0);
    let view_world = normalize(turned(shot.turn, ray));
    if mark == NOTHING_MET {
        return sky_at(shot, view_world);
    }
    let z = depths[view.pixels + sample.y * (view.size & 0xffffu) + sample.x];
    let solid = posed[view.posed + (mark >> 4u)];
    let p = ray * z;
    let normal = normal_at(solid, mark & 15u, p);
    let outer_side = dot(normal, ray) < 0.0;
    let n_world = normalize(turned(shot.turn, select(-normal, normal, outer_side)));
    let p_world = shot.place + turned(shot.turn, p);
    let body = 2u * (view.bodies + (solid.a.x >> 16u));
    let turn = bodies[body];
    let p_body = turned(vec4f(-turn.xyz, turn.w), p_world - bodies[body + 1u].xyz);
    // Items that are sent have the highest bit.
    let items_at = select(shot.items, shot.loose, solid.a.y > 0x7fffffffu);
    let item = items_at + ITEM_QUADS * (solid.a.y & 0x7fffffffu);
    let surface = Surface(p_world, n_world, outer_side, view_world, item, items_at, p_body);
    let color = shade(shot, surface, material_of(surface), k, n);
    // Haze: distance blends into the horizon.
    let clear = exp(-z * length(ray) / shot.haze_length);
    return color * clear + shot.horizon * (1.0 - clear);
}

fn mark_at(view: View, sample: vec2u) -> u32 {
    return items[view.pixels + sample.y * (view.size & 0xffffu) + sample.x];
}

// Maps linear light to sRGB values, 0 to 1, by a filmic curve with a small toe and a soft shoulder.
fn display(linear: vec3f) -> vec3f {
    let x = EXPOSURE * max(linear, vec3f(0.0));
    let y = x * (x + TOE) / (x * (x + SHOULDER) + SHOULDER * TOE);
    return select(1.055 * pow(y, vec3f(1.0 / 2.4)) - 0.055, 12.92 * y, y <= vec3f(0.0031308));
}

@compute @workgroup_size(PICTURE_THREADS)
fn light(@builtin(global_invocation_id) id: vec3u) {
    let shot = shot_of(id.y);
    let view = views[shot.view];
    let columns = (view.size & 0xffffu) / shot.side;
    let rows = (view.size >> 16u) / shot.side;
    if id.x >= columns * rows {
        return;
    }
    let pixel = vec2u(id.x % columns, id.x / columns);
    let n = shot.side * shot.side;
    var sum = vec3f(0.0);
    for (var k = 0u; k < n; k++) {
        let sample = pixel * shot.side + vec2u(k % shot.side, k / shot.side);
        let mark = mark_at(view, sample);
        if shot.once == 0u || n == 1u {
            sum += display(light_of(shot, view, sample, mark, k, n));
            continue;
        }
        // The first sample of each object of the pixel stands for all: how many of them follow, and whether one came before.
        let own = object_of(view, mark);
        var count = 0u;
        var is_first = true;
        for (var other = 0u; other < n; other++) {
            let there = pixel * shot.side + vec2u(other % shot.side, other / shot.side);
            if object_of(view, mark_at(view, there)) == own {
                is_first = is_first && other >= k;
                count++;
            }
        }
        if is_first {
            // Neighbouring pixels share out the directions of the sky.
            let share = (pixel.x + shot.side * pixel.y) % n;
            sum += f32(count) * display(light_of(shot, view, sample, mark, share, n));
        }
    }
    let bytes = vec3u(round(255.0 * clamp(sum / f32(n), vec3f(0.0), vec3f(1.0))));
    colours[shot.pixels + id.x] = bytes.x | (bytes.y << 8u) | (bytes.z << 16u);
}

// Item that a mark shows.
fn object_of(view: View, mark: u32) -> u32 {
    if mark == NOTHING_MET {
        return NOTHING_MET;
    }
    return posed[view.posed + (mark >> 4u)].a.y;
}

// Bytes of a picture, four a word.
@compute @workgroup_size(PICTURE_THREADS)
fn pack(@builtin(global_invocation_id) id: vec3u) {
    let shot = shot_of(id.y);
    let view = views[shot.view];
    let bytes = 3u * ((view.size & 0xffffu) / shot.side) * ((view.size >> 16u) / shot.side);
    if 4u * id.x >= bytes {
        return;
    }
    var word = 0u;
    for (var k = 0u; k < 4u; k++) {
        let byte = 4u * id.x + k;
        if byte < bytes {
            word |= (colours[shot.pixels + byte / 3u] >> (8u * (byte % 3u)) & 0xffu) << (8u * k);
        }
    }
    packed[shot.words + id.x] = word;
}
