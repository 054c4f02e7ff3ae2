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

// Sets the air at the end of a frame, which counts from 0, at every `stride`-th four of a world's places.
fn sample_air(first: u32, stride: u32, frame: u32) {
    // Frames since the wind began.
    let clock = frame - bitcast<u32>(world(WORLD_BEGAN));
    let winds = winds_at(frame);
    for (var four = first; four < rules.fours; four += stride) {
        var air = gusts(four, clock);
        for (var k = 4u * four; k < 4u * four + 4u; k++) {
            links[winds + k * LANES] = vec4f(air.x.x, air.y.x, air.z.x, 0.0);
            air = Four(air.x.yzwx, air.y.yzwx, air.z.yzwx);
        }
    }
}

// Sets the air at the ends of the last and of the coming frame in worlds that have just begun, before their first frame.
@compute @workgroup_size(LANES * WARPS)
fn begin_wind(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let warp = thread / LANES;
    enter(group.x, warp, thread % LANES);
    if is_there() && (bitcast<u32>(world(WORLD_NOTICE)) & NOTICE_STALE) != 0u {
        sample_air(warp, WARPS, rules.frame);
        sample_air(warp, WARPS, rules.frame + 1u);
    }
    storageBarrier();
    if PRESS_ASIDE && is_there() {
        set_air_of_fruit(warp, WARPS, rules.frame + 1u);
    }
}

// What is read of a wave for four places. A wave is `C cos t + S sin t` with the phase `t` at the place less the turn back in time: cosine and sine of the former
// are stored, those of the latter are the same at all places.
struct Wave {
    // Amplitudes; the last number of the first is the turn back per frame.
    cosine: vec4f,
    sine: vec4f,
    cosines: vec4f,
    sines: vec4f,
}

fn read_wave(at: u32, phases: u32) -> Wave {
    return Wave(
        links[at + WAVE_COSINE / QUAD * LANES],
        links[at + WAVE_SINE / QUAD * LANES],
        links[at + phases],
        links[at + phases + LANES],
    );
}

// Air at four places. Waves are read some at a time, as the reads take longer than the arithmetic.
fn gusts(four: u32, clock: u32) -> Four {
    var sum = Four(vec4f(rules.wind_x), vec4f(rules.wind_y), vec4f(0.0));
    var at = waves_at();
    let each = quads_of_wave();
    let phases = (WAVE_FIELDS / QUAD + 2u * four) * LANES;
    for (var k = 0u; k < rules.waves; k += WAVE_AT_ONCE) {
        let first = read_wave(at, phases);
        let second = read_wave(at + each, phases);
        let third = read_wave(at + 2u * each, phases);
        let fourth = read_wave(at + 3u * each, phases);
        at += WAVE_AT_ONCE * each;
        sum = with_wave(sum, first, clock);
        sum = with_wave(sum, second, clock);
        sum = with_wave(sum, third, clock);
        sum = with_wave(sum, fourth, clock);
    }
    let profile = links[profiles_at() + four * LANES];
    return Four(sum.x * profile, sum.y * profile, sum.z * profile);
}

fn with_wave(air: Four, wave: Wave, clock: u32) -> Four {
    // Whole numbers keep the turn exact in any frame.
    let back = turned_by(f32(bitcast<i32>(bitcast<u32>(wave.cosine.w) * clock)) * PER_TURN);
    let by_cosine = wave.cosine.xyz * back.x - wave.sine.xyz * back.y;
    let by_sine = wave.cosine.xyz * back.y + wave.sine.xyz * back.x;
    return Four(
        air.x + (wave.cosines * by_cosine.x + wave.sines * by_sine.x),
        air.y + (wave.cosines * by_cosine.y + wave.sines * by_sine.y),
        air.z + (wave.cosines * by_cosine.z + wave.sines * by_sine.z),
    );
}

// Cosine and sine of a part of a turn, from -1/2 to 1/2, by those of half of it.
fn turned_by(part: f32) -> vec2f {
    let z = part * part;
    let s = part * turn_polynomial(TURN_SINE, z);
    let c = turn_polynomial(TURN_COSINE, z);
    return vec2f(1.0 - s * s * 2.0, s * c * 2.0);
}

fn turn_polynomial(c: array<f32, 5>, x: f32) -> f32 {
    return (((c[0] * x + c[1]) * x + c[2]) * x + c[3]) * x + c[4];
}

// What the wind takes hold of on a link, and the air there.
struct Sail {
    // Half air density times drag coefficient times area of wood and of leaves [kg/m].
    wood: f32,
    leaves: f32,
    // 1 over the mass of the link [1/kg].
    per_mass: f32,
    air: vec3f,
}

fn sail_of(quad: vec4f, air: vec4f) -> Sail {
    return Sail(quad.x, quad.y, quad.z, air.xyz);
}

// The air of the place of a link, from what is stored of its sail.
fn air_of(winds: u32, sail: vec4f) -> vec4f {
    return links[winds + bitcast<u32>(sail.w) * LANES];
}

// Drag of a link's wood and leaves; `z` is its axis and `v` the velocity of its centre of mass. The link's own part of the speed is taken implicitly, as a drag of the link.
fn press_link(at: u32, sail: Sail, z: vec3f, v: vec3f) {
    let w = sail.air - v;
    let across = w - z * dot(w, z);
    let of_wood = sail.wood * length(across);
    let of_leaves = sail.leaves * min(length(w), rules.folding_speed);
    let force = across * of_wood + w * of_leaves + v * (of_wood + of_leaves);
    set_link(at, AIR_IMPULSE, vec4f(force * rules.h, rules.linear_drag + (of_wood + of_leaves) * sail.per_mass));
}

// Leaves the axis of a link and the velocity of its centre of mass to workgroups that press it, in numbers that the next inward pass writes anew.
fn leave_to_wind(row: u32, z: vec3f, v: vec3f) {
    set_link(air_at(airs_at(), row), AIR_IMPULSE, vec4f(v, 0.0));
    set_quad(work_at(row), WORK_G_2N, vec4f(z, 0.0));
}

// Presses every `stride`-th link that was left, in the air at the end of a frame.
fn press_links(first: u32, stride: u32, frame: u32) {
    let rows = header(TILE_STARTS + PARTS);
    let airs = airs_at();
    let winds = winds_at(frame);
    for (var row = first; row < rows; row += stride) {
        let at = air_at(airs, row);
        let sail = link(at, AIR_WOOD);
        let v = link(at, AIR_IMPULSE).xyz;
        press_link(at, sail_of(sail, air_of(winds, sail)), quad(work_at(row), WORK_G_2N).xyz, v);
    }
}

// Sets the air of every `stride`-th fruit at the end of a frame.
fn set_air_of_fruit(first: u32, stride: u32, frame: u32) {
    let rows = bitcast<u32>(world(WORLD_FRUIT));
    let winds = winds_at(frame);
    for (var row = first; row < rows; row += stride) {
        let at = fruit_at(row);
        let place = bitcast<u32>(fruit(at, pull_field() + PULL_PLACE).w);
        set_fruit(at, pull_field() + PULL_AIR, links[winds + place * LANES]);
    }
}

// A fruit under the drag of a frame in some air, and under a force that is applied besides. Fruit off its stem feels still air.
fn pressed(at: u32, from_stem: Stem, pull: vec3f, air: vec3f) -> Stem {
    var stem = from_stem;
    let w = air - stem.v;
    let drag = w * (stem.air_drag * length(w));
    stem.force = pull + select(vec3f(0.0), drag, stem.stiffness > 0.0);
    set_fruit(at, FRUIT_FORCE, vec4f(stem.force, bitcast<f32>(stem.frames_over)));
    return stem;
}
