// Elementary functions. Twin: `twin/math.rs`, which explains the functions.

fn sin_cos(x: f32) -> vec2f {
    let n = round(x * 0.63661977);
    var r = fma(-n, 1.5703125, x);
    r = fma(-n, 4.837513e-4, r);
    r = fma(-n, 7.54979e-8, r);
    let z = r * r;
    let p = fma(fma(-1.9515296e-4, z, 8.332161e-3), z, -1.6666655e-1);
    let sine = fma(p * z, r, r);
    let q = fma(fma(2.4433157e-5, z, -1.3887316e-3), z, 4.1666646e-2);
    let cosine = fma(q * z, z, fma(-0.5, z, 1.0));
    let quarter = i32(n);
    var s = select(sine, cosine, (quarter & 1) != 0);
    var c = select(cosine, sine, (quarter & 1) != 0);
    s = select(s, -s, (quarter & 2) != 0);
    c = select(c, -c, ((quarter + 1) & 2) != 0);
    return vec2f(s, c);
}

fn symmetric(a: vec3f, b: vec3f, v: vec3f) -> vec3f {
    return vec3f(dot(a, v), dot(vec3f(a.y, b.x, b.y), v), dot(vec3f(a.z, b.y, b.z), v));
}

fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x * x) & 0x7f800000u) != 0x7f800000u;
}

const LN_2_HIGH: f32 = 0.693359375;
const LN_2_LOW: f32 = -2.12194440e-4;
const HALF_ROOT: f32 = 0.70710678;
const TAN_22: f32 = 0.41421356;
const TAN_67: f32 = 2.41421356;
const QUARTER_PI: f32 = 0.78539816;
const HALF_PI: f32 = 1.57079633;
const TINY: f32 = 1e-30;
const PI: f32 = 3.14159265;

// For -0.3 < x < 0.42.
fn ln_1p(x: f32) -> f32 {
    var p = fma(7.0376836292e-2, x, -1.1514610310e-1);
    p = fma(p, x, 1.1676998740e-1);
    p = fma(p, x, -1.2420140846e-1);
    p = fma(p, x, 1.4249322787e-1);
    p = fma(p, x, -1.6668057665e-1);
    p = fma(p, x, 2.0000714765e-1);
    p = fma(p, x, -2.4999993993e-1);
    p = fma(p, x, 3.3333331174e-1);
    let z = x * x;
    return x + fma(p * z, x, -0.5 * z);
}

fn ln(x: f32) -> f32 {
    let bits = bitcast<u32>(x);
    var power = f32(bits >> 23u) - 126.0;
    var part = bitcast<f32>((bits & 0x7fffffu) | 0x3f000000u);
    if part < HALF_ROOT {
        power -= 1.0;
        part += part;
    }
    let rest = ln_1p(part - 1.0) + power * LN_2_LOW;
    return fma(power, LN_2_HIGH, rest);
}

fn e_to(x: f32) -> f32 {
    let power = round(x * 1.44269504);
    let r = fma(-power, LN_2_LOW, fma(-power, LN_2_HIGH, x));
    var p = fma(1.9875691500e-4, r, 1.3981999507e-3);
    p = fma(p, r, 8.3334519073e-3);
    p = fma(p, r, 4.1665795894e-2);
    p = fma(p, r, 1.6666665459e-1);
    p = fma(p, r, 0.5);
    return (fma(p * r, r, r) + 1.0) * bitcast<f32>(u32(i32(power) + 127) << 23u);
}

// (atan(t) / t - 1) / t^2 by the square of t, up to that of the tangent of 22.5 degrees.
fn angle_rest(z: f32) -> f32 {
    var p = fma(8.05374449538e-2, z, -1.38776856032e-1);
    p = fma(p, z, 1.99777106478e-1);
    return fma(p, z, -3.33329491539e-1);
}

// Of the point (x, y) with y not below zero.
fn angle_of(y: f32, x: f32) -> f32 {
    let a = abs(x);
    var t = y / max(a, TINY);
    var start = 0.0;
    if y > TAN_67 * a {
        start = HALF_PI;
        t = -a / y;
    } else if y > TAN_22 * a {
        start = QUARTER_PI;
        t = (y - a) / (y + a);
    }
    let z = t * t;
    let angle = start + fma(angle_rest(z) * z, t, t);
    return select(angle, PI - angle, x < 0.0);
}
