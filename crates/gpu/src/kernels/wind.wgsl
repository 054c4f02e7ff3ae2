// Wind on links and hanging fruit, once a frame (`orchard_treephys::wind`). The gusts are sums over waves at some places of a world; a thread computes four of them at once.

// Coefficients of sin(pi x) / x and cos(pi x) by the square of x, |x| <= 1/2 (interpolated at the Chebyshev nodes), to 5e-8.
const TURN_SINE: array<f32, 5> = array(7.7655912e-2, -5.9829041e-1, 2.5500774, -5.1677101, 3.1415926);
const TURN_COSINE: array<f32, 5> = array(2.1968242e-1, -1.3318730, 4.0584108, -4.9347928, 1.0);

// One turn over 2^32.
const PER_TURN: f32 = 2.3283064e-10;

// Velocities at four places.
struct Four {
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

// Sets the air of the present frame at a share of a world's places.
fn sample_air(warp: u32) {
    let places = bitcast<u32>(world(WORLD_PLACES));
    // Frames since the wind began.
    let clock = rules.frame - 1u - bitcast<u32>(world(WORLD_BEGAN));
    let airs = airs_at();
    for (var four = warp; 4u * four < places; four += WARPS) {
        var air = gusts(four, clock);
        for (var k = 4u * four; k < min(4u * four + 4u, places); k++) {
            let at = air_at(airs, k);
            set_link(at, AIR_WIND, vec4f(air.x.x, air.y.x, air.z.x, link(at, AIR_WIND).w));
            air = Four(air.x.yzwx, air.y.yzwx, air.z.yzwx);
        }
    }
}

// Sets the forces of the air for the present frame on a share of a world's links and fruit.
fn blow(warp: u32) {
    let airs = airs_at();
    let rows = header(TILE_STARTS + PARTS);
    for (var k = warp; k < rows; k += WARPS) {
        let at = air_at(airs, k);
        press_link(at, k, wind_at(airs, link(at, AIR_WIND).w));
    }
    for (var k = warp; k < bitcast<u32>(world(WORLD_FRUIT)); k += WARPS) {
        let at = fruit_at(k);
        press_fruit(at, wind_at(airs, fruit(at, gust_field()).w));
    }
}

// Velocity of the air at a place, given by bits.
fn wind_at(airs: u32, place: f32) -> vec3f {
    return link(air_at(airs, bitcast<u32>(place)), AIR_WIND).xyz;
}

// Air at four places.
fn gusts(four: u32, clock: u32) -> Four {
    var sum = Four(vec4f(rules.wind_x), vec4f(rules.wind_y), vec4f(0.0));
    var at = waves_at();
    let phases = (WAVE_FIELDS / QUAD + four) * LANES;
    for (var k = 0u; k < rules.waves; k++) {
        let wave = links[at + WAVE_COSINE / QUAD * LANES];
        let cosine = wave.xyz;
        let sine = links[at + WAVE_SINE / QUAD * LANES].xyz;
        // Whole numbers keep the phase exact in any frame.
        let back = f32(bitcast<i32>(bitcast<u32>(wave.w) * clock)) * PER_TURN;
        let turns = links[at + phases] - back;
        at += quads_of_wave();
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
    let profile = links[profiles_at() + four * LANES];
    return Four(sum.x * profile, sum.y * profile, sum.z * profile);
}

fn turn_polynomial(c: array<f32, 5>, x: vec4f) -> vec4f {
    return (((c[0] * x + c[1]) * x + c[2]) * x + c[3]) * x + c[4];
}

// Keeps what the wind needs of a link at the end of a frame: its axis, and the velocity of its centre of mass.
fn expose(row: u32, z: vec3f, v: vec3f) {
    let at = air_at(airs_at(), row);
    set_link(at, AIR_V, vec4f(v, z.x));
    links[at + AIR_Z / QUAD * LANES].z = z.y;
    links[at + AIR_Z / QUAD * LANES].w = z.z;
}

// Drag of a link's wood and leaves in air of a velocity. The link's own part of the speed is taken implicitly, as a drag of the link.
fn press_link(at: u32, row: u32, velocity: vec3f) {
    let motion = link(at, AIR_V);
    let sail = link(at, AIR_WOOD);
    let v = motion.xyz;
    let z = vec3f(motion.w, sail.zw);
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
    set_fruit(at, gust_field(), vec4f(select(vec3f(0.0), change, hangs), fruit(at, gust_field()).w));
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
