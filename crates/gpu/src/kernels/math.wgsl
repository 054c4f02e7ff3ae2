// Twin: `twin/math.rs`.

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
