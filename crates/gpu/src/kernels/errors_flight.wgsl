// Steps of a time-of-flight camera's measurement, as `crates/camera/src/sensor/time_of_flight.rs` explains them, in f32; a pass each.

const RAY_SHARE: f32 = 1.0 / f32(RAYS * RAYS);
// Least share of the average light that a pixel needs.
const LEAST_NEED: f32 = 1e-7;
// Pixels within it of a triangle are its own, so that rounding leaves no cracks.
const CRACK: f32 = 1e-5;

fn light_of(at: u32) -> vec3f {
    let pixels = law.size.x * law.size.y;
    return vec3f(load(at), load(at + pixels), load(at + 2u * pixels));
}

fn put_light(at: u32, sums: vec3f) {
    let pixels = law.size.x * law.size.y;
    store(at, sums.x);
    store(at + pixels, sums.y);
    store(at + 2u * pixels, sums.z);
}

// Light of the rays of each pixel, and its first two moments of depth.
@compute @workgroup_size(PIXEL_THREADS)
fn light(@builtin(global_invocation_id) id: vec3u) {
    let size = law.size;
    if id.x >= size.x {
        return;
    }
    var sums = vec3f(0.0);
    for (var j = 0u; j < RAYS; j++) {
        let row = shots[id.z].pixels + (id.y * RAYS + j) * size.x * RAYS + id.x * RAYS;
        for (var i = 0u; i < RAYS; i++) {
            let z = depths[row + i];
            if z > 0.0 {
                let a = 1.0 / z;
                sums += RAY_SHARE * vec3f(a * a, a, 1.0);
            }
        }
    }
    put_light(id.z * law.words + law.light + id.y * size.x + id.x, sums);
}

// Blur along rows; weights from the middle outwards are in the table.
@compute @workgroup_size(PIXEL_THREADS)
fn blur(@builtin(global_invocation_id) id: vec3u) {
    let size = law.size;
    if id.x >= size.x {
        return;
    }
    let row = id.z * law.words + law.light + id.y * size.x;
    var sums = vec3f(0.0);
    for (var k = 0u; k < BLUR; k++) {
        let weight = bitcast<f32>(table[k]);
        if k <= id.x {
            sums += weight * light_of(row + id.x - k);
        }
        if k > 0u && id.x + k < size.x {
            sums += weight * light_of(row + id.x + k);
        }
    }
    put_light(id.z * law.words + law.blurred + id.y * size.x + id.x, sums);
}

// The measured depth of a pixel; 0 without a measurement.
fn sensed(image: u32, u: u32, v: u32) -> f32 {
    let size = law.size;
    let base = image * law.words;
    let column = base + law.blurred + u;
    var sums = vec3f(0.0);
    for (var k = 0u; k < BLUR; k++) {
        let weight = bitcast<f32>(table[k]);
        if k <= v {
            sums += weight * light_of(column + (v - k) * size.x);
        }
        if k > 0u && v + k < size.y {
            sums += weight * light_of(column + (v + k) * size.x);
        }
    }
    let need = noise_at(base, law.down.y, u, v);
    if sums.x <= law.least_light * max(1.0 + law.reach_spread * need, LEAST_NEED) {
        return 0.0;
    }
    let mean = sums.y / sums.x;
    let variance = max(sums.z / sums.x - mean * mean, 0.0);
    let sd = length(vec2f(law.noise_floor, law.noise_at_metre / sums.x));
    let depth = mean + sd * noise_at(base, law.down.x, u, v);
    return select(0.0, depth, variance <= law.mixing && depth >= law.near && depth <= law.far);
}

// Measured depths of an imager whose images are not registered.
@compute @workgroup_size(PIXEL_THREADS)
fn sense(@builtin(global_invocation_id) id: vec3u) {
    if id.x < law.size.x {
        measured[shots[id.z].measured + id.y * law.size.x + id.x] = sensed(id.z, id.x, id.y);
    }
}

// Measured depths that are to be registered.
@compute @workgroup_size(PIXEL_THREADS)
fn keep(@builtin(global_invocation_id) id: vec3u) {
    if id.x < law.size.x {
        store(id.z * law.words + law.light + id.y * law.size.x + id.x, sensed(id.z, id.x, id.y));
    }
}

// Where the camera sees a pixel with a depth, and the depth.
fn seen_at(u: u32, v: u32, z: f32) -> vec3f {
    return vec3f(law.zoom * vec2f(f32(u), f32(v)) + law.moved - vec2f(law.parallax / z, 0.0), z);
}

// Draws a triangle whose depth is linear in the image.
fn triangle(image: u32, a: vec3f, b: vec3f, c: vec3f) {
    let p = b.xy - a.xy;
    let q = c.xy - a.xy;
    let area = p.x * q.y - q.x * p.y;
    if area <= 0.0 {
        return;
    }
    let low = max(ceil(min(min(a.xy, b.xy), c.xy) - CRACK), vec2f(0.0));
    let high = min(floor(max(max(a.xy, b.xy), c.xy) + CRACK), vec2f(law.camera) - 1.0);
    if any(high < low) {
        return;
    }
    let last = vec2u(high);
    for (var v = u32(low.y); v <= last.y; v++) {
        for (var u = u32(low.x); u <= last.x; u++) {
            let x = vec2f(f32(u), f32(v)) - a.xy;
            let to_b = (x.x * q.y - x.y * q.x) / area;
            let to_c = (x.y * p.x - x.x * p.y) / area;
            if to_b >= -CRACK && to_c >= -CRACK && to_b + to_c <= 1.0 + CRACK {
                let z = a.z + to_b * (b.z - a.z) + to_c * (c.z - a.z);
                // The nearest has the largest mark; nothing has none.
                atomicMax(&marks[image * law.marks + v * law.camera.x + u], ~bitcast<u32>(z));
            }
        }
    }
}

// Triangles between the four pixels up to this one, where the depths differ little.
@compute @workgroup_size(PIXEL_THREADS)
fn bridge(@builtin(global_invocation_id) id: vec3u) {
    let size = law.size;
    if id.x + 1u >= size.x || id.y + 1u >= size.y {
        return;
    }
    let at = id.z * law.words + law.light + id.y * size.x + id.x;
    let z = vec4f(load(at), load(at + 1u), load(at + size.x), load(at + size.x + 1u));
    let nearest = min(min(z.x, z.y), min(z.z, z.w));
    let farthest = max(max(z.x, z.y), max(z.z, z.w));
    if nearest <= 0.0 || farthest - nearest > law.bridge {
        return;
    }
    let a = seen_at(id.x, id.y, z.x);
    let b = seen_at(id.x + 1u, id.y, z.y);
    let c = seen_at(id.x, id.y + 1u, z.z);
    let d = seen_at(id.x + 1u, id.y + 1u, z.w);
    triangle(id.z, a, b, c);
    triangle(id.z, d, c, b);
}

// Registered depths.
@compute @workgroup_size(PIXEL_THREADS)
fn reveal(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= law.camera.x {
        return;
    }
    let i = id.y * law.camera.x + id.x;
    let mark = atomicLoad(&marks[id.z * law.marks + i]);
    measured[shots[id.z].measured + i] = bitcast<f32>(select(0u, ~mark, mark != 0u));
}
