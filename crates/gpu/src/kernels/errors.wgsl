// The errors of cameras, step by step as the processor adds them: `crates/camera/src/sensor/` and docs/computation/sensor.md explain them. All numbers of a stereo camera
// have the bits of the processor's: whole numbers, and sums, products and quotients of f32, each rounded once, in its order.

// Figures of a camera: `images/errors/law.rs`.
struct Law {
    // Columns and rows of an image of the imager.
    size: vec2u,
    // Words of memory that an image takes, and of marks.
    words: u32,
    marks: u32,
    // First words of the random bytes of the three fields, and the number of all of them.
    white: vec4u,
    // First words of the sums of those bytes down the columns; words of a row of bits.
    down: vec3u,
    bit_columns: u32,
    // First words of disparities, of the numbers of matched pixels along rows, of disparities at wavy edges, and of the numbers of disparities along rows for ramps. Their sums take the place of disparities, and
    // the sums of their squares that of the numbers of matched pixels, which nothing reads any more.
    disparity: u32,
    along: u32,
    taken: u32,
    ramp: u32,
    // Twice the means of the sums of noise and of displacements.
    noise_centre: i32,
    shift_centre: i32,
    noise_scale: f32,
    shift_scale: f32,
    focal_baseline: f32,
    surface_step: f32,
    disparity_sd: f32,
    disparity_step: f32,
    edge_shift: f32,
    least_support: f32,
    // The square of the limit.
    edge_limit: f32,
    near: f32,
    far: f32,
    // Zero, which no compiler knows.
    zero: u32,
    // Columns and rows of the registered image; none if images are not registered.
    camera: vec2u,
    // Least number of steps of the table of registration, and number of its numbers of steps.
    first_steps: u32,
    table_steps: u32,
    // Of time of flight: first words of light and of light blurred along rows.
    light: u32,
    blurred: u32,
    least_light: f32,
    reach_spread: f32,
    noise_floor: f32,
    noise_at_metre: f32,
    // The square of the largest standard deviation.
    mixing: f32,
    bridge: f32,
    // Where another camera sees a pixel: the place times `zoom`, and `moved`, less `parallax` over the depth along a row.
    zoom: vec2f,
    moved: vec2f,
    parallax: f32,
    unused: u32,
}

// An image: `images/errors/law.rs`.
struct Shot {
    // First of its exact depths among all, and of its measured ones.
    pixels: u32,
    measured: u32,
    // First of its faults among all, and their number.
    faults: u32,
    fault_count: u32,
    // Number of its random stream.
    number: vec2u,
    unused: vec2u,
    key_a: vec4u,
    key_b: vec4u,
}

@group(0) @binding(0) var<storage, read> law: Law;
@group(0) @binding(1) var<storage, read> shots: array<Shot>;
@group(0) @binding(2) var<storage, read> faults: array<u32>;
@group(0) @binding(3) var<storage, read> depths: array<f32>;
@group(0) @binding(4) var<storage, read_write> memory: array<u32>;
// Bits of pixels whose window has a fault, then numbers of steps of the pixels of registered images; of time of flight: depths of registered images.
@group(0) @binding(5) var<storage, read_write> marks: array<atomic<u32>>;
// Of a stereo camera: first columns, then first rows, that each column and row of the imager covers in the registered image, by number of steps; of time of flight: weights of
// the blur.
@group(0) @binding(6) var<storage, read> table: array<u32>;
@group(0) @binding(7) var<storage, read_write> measured: array<f32>;

// The same memory, four words at once; no kernel uses both.
@group(0) @binding(4) var<storage, read_write> quads: array<vec4u>;

const MANTISSA: u32 = 0x7fffffu;
const HIDDEN: u32 = 0x800000u;
// Bits of 1.
const ONE: u32 = 0x3f800000u;
// Exponents of f32 that are normal.
const EXPONENTS: i32 = 254;

// A product that no compiler joins with a sum.
fn rounded(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ law.zero);
}

// The quotient of two positive numbers, rounded to the nearest: devices divide with an error of some units in the last place, from which whole numbers find
// the right one.
fn quotient(a: f32, b: f32) -> f32 {
    let x = bitcast<u32>(a);
    let y = bitcast<u32>(b);
    let p = (x & MANTISSA) | HIDDEN;
    let q = (y & MANTISSA) | HIDDEN;
    // So many binary places give 24 bits.
    let places = select(24u, 23u, p >= q);
    let exponent = i32(x >> 23u) - i32(y >> 23u) + 150 - i32(places);
    if exponent < 1 || exponent >= EXPONENTS {
        return a / b;
    }
    let ratio = bitcast<f32>((x & MANTISSA) | ONE) / bitcast<f32>((y & MANTISSA) | ONE);
    // A whole number, since it has 24 bits.
    var whole = u32(ratio * f32(1u << places));
    // Modulo 2^32, which holds the true rest. It is never half of q: that would take a quotient of 25 bits, whose odd part would divide p.
    var twice = bitcast<i32>(2u * ((p << places) - whole * q));
    let size = i32(q);
    while twice > size {
        whole += 1u;
        twice -= 2 * size;
    }
    while twice < -size {
        whole -= 1u;
        twice += 2 * size;
    }
    return bitcast<f32>((u32(exponent) << 23u) + whole - HIDDEN);
}

fn load(at: u32) -> f32 {
    return bitcast<f32>(memory[at]);
}

fn store(at: u32, x: f32) {
    memory[at] = bitcast<u32>(x);
}
