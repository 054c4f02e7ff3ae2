// Steps of a stereo camera's measurement; a pass each.

// Disparities of a row; the sign tells whether both imagers see the surface.
var<workgroup> row_disparity: array<f32, COLUMNS>;
// Bits of the pixels that both imagers see, with a word before them and behind them.
var<workgroup> row_seen: array<atomic<u32>, COLUMNS / 32u + 3u>;
// Bits of the largest disparity in each column of the other imager's picture.
var<workgroup> row_nearest: array<atomic<u32>, COLUMNS>;

const NO_COLUMN: u32 = 0xffffffffu;

// Column of the other imager's picture.
fn column(u: u32, d: f32) -> u32 {
    let there = f32(u) - d;
    return select(NO_COLUMN, min(u32(max(there, 0.0) + 0.5), u), d > 0.0 && there >= 0.0);
}

// Disparities of a row of the imager and the pixels that both imagers see, a workgroup a row.
@compute @workgroup_size(ROW_THREADS)
fn pairs(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let width = law.size.x;
    let first = shots[group.y].pixels + group.x * width;
    for (var u = thread; u < width; u += ROW_THREADS) {
        let z = depths[first + u];
        var d = 0.0;
        if z > 0.0 {
            d = quotient(law.focal_baseline, z);
        }
        row_disparity[u] = d;
        atomicStore(&row_nearest[u], 0u);
    }
    for (var word = thread; word < COLUMNS / 32u + 3u; word += ROW_THREADS) {
        atomicStore(&row_seen[word], 0u);
    }
    workgroupBarrier();
    for (var u = thread; u < width; u += ROW_THREADS) {
        let d = row_disparity[u];
        let there = column(u, d);
        if there == NO_COLUMN {
            continue;
        }
        atomicMax(&row_nearest[there], bitcast<u32>(d));
        if u > 0u {
            let d_last = row_disparity[u - 1u];
            let last = column(u - 1u, d_last);
            if last != NO_COLUMN && there == last + 2u && abs(d - d_last) <= law.surface_step {
                atomicMax(&row_nearest[last + 1u], bitcast<u32>(min(d, d_last)));
            }
        }
    }
    workgroupBarrier();
    let to = group.y * law.words + group.x * width;
    for (var u = thread; u < width; u += ROW_THREADS) {
        let d = row_disparity[u];
        let there = column(u, d);
        let is_seen =
            there != NO_COLUMN && bitcast<f32>(atomicLoad(&row_nearest[min(there, width - 1u)])) <= d + law.surface_step;
        if is_seen {
            atomicOr(&row_seen[u / 32u + 1u], 1u << (u % 32u));
        }
        store(to + law.disparity + u, select(-d, d, is_seen));
    }
    workgroupBarrier();
    for (var u = thread; u < width; u += ROW_THREADS) {
        // The bits of the window, whose first is that of pixel u - RADIUS.
        let first_bit = u + 32u - RADIUS;
        let shift = first_bit % 32u;
        var bits = atomicLoad(&row_seen[first_bit / 32u]) >> shift;
        if shift > 0u {
            bits |= atomicLoad(&row_seen[first_bit / 32u + 1u]) << (32u - shift);
        }
        memory[to + law.along + u] = countOneBits(bits & ((1u << (2u * RADIUS + 1u)) - 1u));
    }
}

// Bits of the pixels whose window has a fault, a thread a fault.
@compute @workgroup_size(FAULT_THREADS)
fn refuse(@builtin(global_invocation_id) id: vec3u) {
    let shot = &shots[id.y];
    if id.x >= (*shot).fault_count {
        return;
    }
    let fault = faults[(*shot).faults + id.x];
    let wide = law.size.x + 2u * RADIUS;
    let last = vec2u(fault % wide, fault / wide);
    let first = max(last, vec2u(2u * RADIUS)) - 2u * RADIUS;
    let end = min(last, law.size - 1u);
    for (var v = first.y; v <= end.y; v++) {
        for (var u = first.x; u <= end.x; u++) {
            atomicOr(&marks[id.y * law.marks + v * law.bit_columns + u / 32u], 1u << (u % 32u));
        }
    }
}

// Index of the pixel `shift` away along an axis.
fn moved(at: u32, shift: f32, length: u32) -> u32 {
    return min(u32(max(f32(at) + rounded(shift) + 0.5, 0.0)), length - 1u);
}

// Pixels that a window has along an axis within the image.
fn within(at: u32, length: u32) -> u32 {
    return min(at + RADIUS, length - 1u) - (max(at, RADIUS) - RADIUS) + 1u;
}

// The disparity of each pixel with support, light and wavy edges.
@compute @workgroup_size(PIXEL_THREADS)
fn take(@builtin(global_invocation_id) id: vec3u) {
    let size = law.size;
    if id.x >= size.x {
        return;
    }
    let base = id.z * law.words;
    let i = id.y * size.x + id.x;
    var support = 0u;
    // Loops of a known number of turns; a row above the first wraps to one below the last.
    for (var k = 0u; k <= 2u * RADIUS; k++) {
        let v = id.y + k - RADIUS;
        if v < size.y {
            support += memory[base + law.along + v * size.x + id.x];
        }
    }
    var taken = 0.0;
    let needed = rounded(law.least_support * f32(within(id.y, size.y) * within(id.x, size.x)));
    if f32(support) >= needed {
        let shift_u = law.edge_shift * shift_at(base, law.down.y, id.x, id.y);
        let shift_v = law.edge_shift * shift_at(base, law.down.z, id.x, id.y);
        let at = vec2u(moved(id.x, shift_u, size.x), moved(id.y, shift_v, size.y));
        let own = load(base + law.disparity + i);
        var d = load(base + law.disparity + at.y * size.x + at.x);
        if !(abs(abs(d) - abs(own)) > law.surface_step) {
            d = own;
        }
        let bits = atomicLoad(&marks[id.z * law.marks + at.y * law.bit_columns + at.x / 32u]);
        let is_sound = ((bits >> (at.x % 32u)) & 1u) == 0u;
        if d > 0.0 && is_sound && f32(id.x) >= d {
            taken = d;
        }
    }
    store(base + law.taken + i, taken);
}

// Number, sum and sum of squares of disparities along rows.
@compute @workgroup_size(PIXEL_THREADS)
fn ramp(@builtin(global_invocation_id) id: vec3u) {
    let size = law.size;
    if id.x >= size.x {
        return;
    }
    let row = id.z * law.words + law.taken + id.y * size.x;
    var n = 0.0;
    var sum = 0.0;
    var squares = 0.0;
    for (var k = 0u; k <= 2u * RAMP; k++) {
        let u = id.x + k - RAMP;
        if u < size.x {
            let d = load(row + u);
            n += select(0.0, 1.0, d > 0.0);
            sum += d;
            squares += rounded(d * d);
        }
    }
    let base = id.z * law.words;
    let i = id.y * size.x + id.x;
    store(base + law.ramp + i, n);
    store(base + law.disparity + i, sum);
    store(base + law.along + i, squares);
}

// The steps of disparity that a pixel measures; 0 without a measurement.
fn steps_of(image: u32, u: u32, v: u32) -> i32 {
    let size = law.size;
    let base = image * law.words;
    if !(load(base + law.taken + v * size.x + u) > 0.0) {
        return 0;
    }
    var n = 0.0;
    var sum = 0.0;
    var squares = 0.0;
    for (var k = 0u; k <= 2u * RAMP; k++) {
        let row = v + k - RAMP;
        if row < size.y {
            let at = base + row * size.x + u;
            n += load(at + law.ramp);
            sum += load(at + law.disparity);
            squares += load(at + law.along);
        }
    }
    let mean = quotient(sum, n);
    let variance = max(quotient(squares, n) - rounded(mean * mean), 0.0);
    if !(variance <= law.edge_limit) {
        return 0;
    }
    let d = mean + rounded(law.disparity_sd * noise_at(base, law.down.x, u, v));
    if !(d > 0.0) {
        return 0;
    }
    let steps = i32(quotient(d, law.disparity_step) + 0.5);
    if steps <= 0 {
        return 0;
    }
    let depth = depth_of(steps);
    return select(0, steps, depth >= law.near && depth <= law.far);
}

// Depth of a positive number of steps.
fn depth_of(steps: i32) -> f32 {
    return quotient(law.focal_baseline, f32(steps) * law.disparity_step);
}

// Measured depths.
@compute @workgroup_size(PIXEL_THREADS)
fn finish(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= law.size.x {
        return;
    }
    let steps = steps_of(id.z, id.x, id.y);
    var depth = 0.0;
    if steps > 0 {
        depth = depth_of(steps);
    }
    measured[shots[id.z].measured + id.y * law.size.x + id.x] = depth;
}
