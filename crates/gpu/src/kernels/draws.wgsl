// Random numbers and what the axes draw. Twin: `twin/draws.rs`, which explains the functions.

const HIGH_BITS: u32 = 21u;
const HIGH_UNIT: f32 = 0x1p-21;
const LOW_UNIT: f32 = 0x1p-53;
const REDRAWS: u32 = 1000u;
const NEAR_ONE: f32 = 0.25;
const TAU: f32 = 6.28318531;

fn low_word(pair: vec2u) -> f32 {
    return f32((pair.y << HIGH_BITS) | (pair.x >> (32u - HIGH_BITS))) * LOW_UNIT;
}

fn unit_of(pair: vec2u) -> f32 {
    return fma(f32(pair.y >> (32u - HIGH_BITS)), HIGH_UNIT, low_word(pair));
}

fn rest_of(pair: vec2u) -> f32 {
    let high = (1u << HIGH_BITS) - (pair.y >> (32u - HIGH_BITS));
    return max(fma(f32(high), HIGH_UNIT, -low_word(pair)), LOW_UNIT);
}

fn uniform_of(stream: ptr<function, Stream>, low: f32, high: f32) -> f32 {
    return fma(high - low, unit_of(next_pair(stream)), low);
}

fn normal_of(stream: ptr<function, Stream>) -> f32 {
    let pair = next_pair(stream);
    let u = unit_of(pair);
    var log = 0.0;
    if u < NEAR_ONE {
        log = ln_1p(-u);
    } else {
        log = ln(rest_of(pair));
    }
    return sqrt(-2.0 * log) * sin_cos(TAU * unit_of(next_pair(stream))).y;
}

fn at_strength(factor: f32, strength: f32) -> f32 {
    return e_to(strength * ln(factor));
}

fn dial_at(axis: u32) -> u32 {
    return (BASE_FIELDS + axis * DIAL_FIELDS) / QUAD;
}

// Strength of an axis, and the two numbers of its distribution.
fn dial_of(entry: u32) -> vec3f {
    return bitcast<vec4f>(table[entry + DIAL_STRENGTH / QUAD]).xyz;
}

fn limits_of(entry: u32) -> vec2f {
    return bitcast<vec4f>(table[entry + DIAL_LEAST / QUAD]).xy;
}

fn factor_of(axis: u32) -> f32 {
    var stream = stream_of(axis);
    let dial = dial_of(stream.entry);
    return at_strength(uniform_of(&stream, dial.y, dial.z), dial.x);
}

fn angle_drawn(axis: u32) -> f32 {
    var stream = stream_of(axis);
    let dial = dial_of(stream.entry);
    return uniform_of(&stream, dial.y, dial.z) * dial.x;
}

fn lean_drawn() -> vec3f {
    var stream = stream_of(AXIS_LEAN);
    let dial = dial_of(stream.entry);
    let angle = uniform_of(&stream, dial.y, dial.z) * dial.x;
    let azimuth = sin_cos(uniform_of(&stream, 0.0, TAU));
    return vec3f(azimuth.y * angle, azimuth.x * angle, 0.0);
}

fn next_factor(stream: ptr<function, Stream>) -> f32 {
    let dial = dial_of((*stream).entry);
    if dial.x == 0.0 {
        return 1.0;
    }
    let ends = limits_of((*stream).entry);
    var factor = dial.y;
    for (var k = 0u; k < REDRAWS; k++) {
        let drawn = fma(dial.z, normal_of(stream), dial.y);
        if drawn >= ends.x && drawn <= ends.y {
            factor = drawn;
            break;
        }
    }
    return at_strength(factor, dial.x);
}

// The next bend, and the azimuth of its axis.
fn next_bend(stream: ptr<function, Stream>) -> vec2f {
    let dial = dial_of((*stream).entry);
    if dial.x == 0.0 {
        return vec2f(0.0);
    }
    let angle = dial.z * normal_of(stream) * dial.x;
    return vec2f(angle, uniform_of(stream, 0.0, TAU));
}
