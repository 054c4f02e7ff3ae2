// Light of sun and sky, hidden by what the shadow maps show.

// Colour of the sky in a direction.
fn sky_at(shot: Shot, d: vec3f) -> vec3f {
    let blend = 1.0 - exp(-SKY_RISE * max(d.z, 0.0));
    let glow = pow(max(dot(d, shot.sun_world), 0.0), GLOW_EXPONENT);
    return shot.horizon * (1.0 - blend) + shot.zenith * blend + shot.glow * glow;
}

// A point before the camera of a map: column, row and depth.
fn place_in(map: View, p_world: vec3f) -> vec3f {
    let p = turned(bodies[2u * map.world_pose], p_world) + bodies[2u * map.world_pose + 1u].xyz;
    return vec3f(p.xy / p.z * map.focal + map.axis, p.z);
}

// 1 if light reaches a place of a map, else 0, by the nearest pixel. Beyond the map nothing casts shadow.
fn open_at(map: View, place: vec3f, bias: f32) -> f32 {
    let at = place.xy + 0.5;
    let side = f32(map.size & 0xffffu);
    if any(at < vec2f(0.0)) || any(at >= vec2f(side)) {
        return 1.0;
    }
    let pixel = vec2u(at);
    let z = depths[map.pixels + pixel.y * (map.size & 0xffffu) + pixel.x];
    // 0: nothing is there.
    return select(1.0, 0.0, z > 0.0 && z < place.z - bias);
}

// Share of the sun's light that reaches a point: mean over four pixels around it.
fn sun_at(shot: Shot, p_world: vec3f) -> f32 {
    let map = views[shot.sun];
    let place = place_in(map, p_world);
    return 0.25 * (open_at(map, place + vec3f(-0.75, -0.25, 0.0), shot.sun_bias)
        + open_at(map, place + vec3f(0.25, -0.75, 0.0), shot.sun_bias)
        + open_at(map, place + vec3f(0.75, 0.25, 0.0), shot.sun_bias)
        + open_at(map, place + vec3f(-0.25, 0.75, 0.0), shot.sun_bias));
}

// Sky light, less where other objects hide the sky, and light from the ground.
fn ambient(shot: Shot, s: Surface, k: u32, n: u32) -> vec3f {
    let up = 0.5 + 0.5 * s.n_world.z;
    let sky = shot.from_above * up + shot.from_below * (1.0 - up);
    if shot.sky_count == 0u {
        return sky;
    }
    let p = s.p_world + s.n_world * OFFSET;
    var open = 0.0;
    var all = 1e-9;
    let stride = clamp(n, 1u, MOST_SHARES);
    for (var d = k % stride; d < shot.sky_count; d += stride) {
        let weight = max(dot(s.n_world, quad(SKY_DIRECTIONS + d).xyz) + SKY_BELOW, 0.0);
        let map = views[shot.sky + d];
        all += weight;
        open += weight * open_at(map, place_in(map, p), shot.sky_bias);
    }
    return sky * (SKY_LEAST + (1.0 - SKY_LEAST) * open / all);
}

// Light that a surface sends to the viewer. Sample `k` of `n` of a pixel uses its share of the sky's directions.
fn shade(shot: Shot, s: Surface, m: Material, k: u32, n: u32) -> vec3f {
    let facing = dot(s.n_world, shot.sun_world);
    let front = max(facing, 0.0);
    let lit_side = select(-s.n_world, s.n_world, facing >= 0.0);
    var lit = 0.0;
    if shot.sun != NO_SUN && (front > 0.0 || any(m.transmitted != vec3f(0.0))) {
        lit = sun_at(shot, s.p_world + lit_side * shot.sun_offset);
    }
    let sun = shot.sun_color * lit;
    var out = m.color * sun * front + m.transmitted * sun * max(-facing, 0.0);
    out += m.color * ambient(shot, s, k, n);
    if lit > 0.0 && front > 0.0 && m.gloss > 0.0 {
        let half = normalize(shot.sun_world - s.view_world);
        out += sun * (m.gloss * pow(max(dot(s.n_world, half), 0.0), m.shininess));
    }
    return out;
}
