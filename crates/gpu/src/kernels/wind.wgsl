// Wind on links and hanging fruit, once a frame (`orchard_treephys::wind`). The waves of a world's gusts are sums over all its links and fruit: a thread computes four places at once.

// Coefficients of sin(pi x) / x and cos(pi x) by the square of x, |x| <= 1/2 (interpolated at the Chebyshev nodes), to 5e-8.
const TURN_SINE: array<f32, 5> = array(7.7655912e-2, -5.9829041e-1, 2.5500774, -5.1677101, 3.1415926);
const TURN_COSINE: array<f32, 5> = array(2.1968242e-1, -1.3318730, 4.0584108, -4.9347928, 1.0);

// One turn over 2^32.
const PER_TURN: f32 = 2.3283064e-10;

// Four places, or velocities there.
struct Four {
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

// Number of links and fruit of a world, and the place of one of them: links first.
fn count_of_points(rows: u32) -> u32 {
    return rows + bitcast<u32>(world(WORLD_FRUIT));
}

fn point(k: u32, rows: u32) -> vec3f {
    if k < rows {
        return link(air_at(airs_at(), k), AIR_P).xyz;
    }
    return fruit(fruit_at(k - rows), FRUIT_P).xyz;
}

// Sets the forces of the air for the present frame at a share of a world's links and fruit.
fn blow(warp: u32) {
    let rows = header(TILE_STARTS + PARTS);
    let count = count_of_points(rows);
    // Frames since the wind began.
    let clock = rules.frame - 1u - bitcast<u32>(world(WORLD_BEGAN));
    for (var first = 4u * warp; first < count; first += 4u * WARPS) {
        let last = count - 1u;
        let a = point(first, rows);
        let b = point(min(first + 1u, last), rows);
        let c = point(min(first + 2u, last), rows);
        let d = point(min(first + 3u, last), rows);
        var here = Four(vec4f(a.x, b.x, c.x, d.x), vec4f(a.y, b.y, c.y, d.y), vec4f(a.z, b.z, c.z, d.z));
        var air = gusts(here, clock);
        for (var k = first; k < min(first + 4u, count); k++) {
            let velocity = vec3f(air.x.x + rules.wind_x, air.y.x + rules.wind_y, air.z.x) * profile(here.z.x);
            if k < rows {
                press_link(k, velocity);
            } else {
                press_fruit(fruit_at(k - rows), velocity);
            }
            air = Four(air.x.yzwx, air.y.yzwx, air.z.yzwx);
            here.z = here.z.yzwx;
        }
    }
}

// Gusts at four places, at the height of the canopy.
fn gusts(here: Four, clock: u32) -> Four {
    var sum = Four(vec4f(0.0), vec4f(0.0), vec4f(0.0));
    var at = waves_at();
    for (var k = 0u; k < rules.waves; k++) {
        let wave = links[at + WAVE_TURNS / QUAD * LANES];
        let cosine = links[at + WAVE_COSINE / QUAD * LANES].xyz;
        let sine = links[at + WAVE_SINE / QUAD * LANES].xyz;
        at += WAVE_FIELDS / QUAD * LANES;
        // Whole numbers keep the phase exact in any frame.
        let back = f32(bitcast<i32>(bitcast<u32>(wave.w) * clock)) * PER_TURN;
        let turns = here.x * wave.x + here.y * wave.y + here.z * wave.z - back;
        // Sine and cosine of the whole turn from those of half of it.
        let part = turns - round(turns);
        let z = part * part;
        let s = part * turn_polynomial(TURN_SINE, z);
        let c = turn_polynomial(TURN_COSINE, z);
        let sines = s * c * 2.0;
        let cosines = 1.0 - s * s * 2.0;
        sum.x += cosines * cosine.x + sines * sine.x;
        sum.y += cosines * cosine.y + sines * sine.y;
        sum.z += cosines * cosine.z + sines * sine.z;
    }
    return sum;
}

fn turn_polynomial(c: array<f32, 5>, x: vec4f) -> vec4f {
    return (((c[0] * x + c[1]) * x + c[2]) * x + c[3]) * x + c[4];
}

// Mean speed at a height over that at the height of the canopy: exponential within, logarithmic above.
fn profile(height: f32) -> f32 {
    let part = max(height, 0.0) / rules.canopy;
    if part <= 1.0 {
        return e_to(rules.attenuation * (part - 1.0));
    }
    return ln((part - rules.displacement) / rules.roughness) * rules.profile;
}

// Keeps what the wind needs of a link at the end of a frame: its axis, and place and velocity of its centre of mass.
fn expose(row: u32, z: vec3f, p: vec3f, v: vec3f) {
    let at = air_at(airs_at(), row);
    set_link(at, AIR_P, vec4f(p, z.x));
    set_link(at, AIR_V, vec4f(v, z.y));
    links[at + AIR_Z / QUAD * LANES].w = z.z;
}

// Drag of a link's wood and leaves in air of a velocity. The link's own part of the speed is taken implicitly, as a drag of the link.
fn press_link(row: u32, velocity: vec3f) {
    let at = air_at(airs_at(), row);
    let p = link(at, AIR_P);
    let motion = link(at, AIR_V);
    let sail = link(at, AIR_WOOD);
    let v = motion.xyz;
    let z = vec3f(p.w, motion.w, sail.w);
    let w = velocity - v;
    let across = w - z * dot(w, z);
    let of_wood = sail.x * length(across);
    let of_leaves = sail.y * min(length(w), rules.folding_speed);
    let force = across * of_wood + w * of_leaves + v * (of_wood + of_leaves);
    let mass = max(link(link_at(row), LINK_MASS).x, TINY);
    set_link(at, AIR_IMPULSE, vec4f(force * rules.h, rules.linear_drag + (of_wood + of_leaves) / mass));
}

// Drag of a hanging fruit, as the change of velocity that it would give a free one in a substep. Fruit off its stem feels still air.
fn press_fruit(at: u32, velocity: vec3f) {
    let numbers = fruit(at, FRUIT_MASS);
    let w = velocity - fruit(at, FRUIT_V).xyz;
    let hangs = bitcast<u32>(fruit(at, FRUIT_P).w) == 0u && fruit(at, FRUIT_STIFFNESS).x > 0.0;
    let change = w * (numbers.w * length(w) * rules.h / numbers.x);
    set_fruit(at, gust_field(), vec4f(select(vec3f(0.0), change, hangs), 0.0));
}

fn gust_on(at: u32) -> vec3f {
    return fruit(at, gust_field()).xyz;
}

// Reaction on a tether's anchor, and the mass that the fruit adds there, with the wind on the fruit; above the cap its size is the cap's and the fruit adds no mass.
fn in_wind(at: u32, still: vec4f, cap: f32) -> vec4f {
    let reaction = still.xyz + gust_on(at) * still.w;
    let size = length(reaction);
    let is_capped = size > cap;
    if CONJUGATE && is_capped {
        // Its products with the inertia read the mass there.
        set_fruit(at, FRUIT_REACTION, vec4f(still.xyz, 0.0));
    }
    return vec4f(select(reaction, reaction * (cap / size), is_capped), select(still.w, 0.0, is_capped));
}
