// Access to the buffers for one lane. `layout.rs` lists the fields; its constants precede this file.

struct Rules {
    h: f32,
    gravity: f32,
    substeps: u32,
    frame: u32,
    pushes_each: u32,
    rupture_frames: u32,
    pull_frames: u32,
    tension_frames: u32,
    tension_factor: f32,
    damped: f32,
    linear_drag: f32,
    angular_drag: f32,
    broken_linear_drag: f32,
    broken_angular_drag: f32,
    friction_ratio: f32,
    friction_ramp: f32,
    friction_ramp_time: f32,
    friction_regularisation: f32,
    residual_damping: f32,
    residual_damping_max: f32,
    rate_limit: f32,
    rate_brake: f32,
    ground_stiffness: f32,
    dissipation_time: f32,
    ground_friction: f32,
    spin_loss: f32,
    wood_stiffness: f32,
    wood_friction: f32,
    stem_bending: f32,
    stem_twisting: f32,
    stem_bent: f32,
    stem_wear: f32,
    stem_exponent: f32,
    stem_least_load: f32,
    waves: u32,
    fours: u32,
    wind_x: f32,
    wind_y: f32,
    folding_speed: f32,
    substep: u32,
    slow_rate: f32,
}

@group(0) @binding(0) var<uniform> rules: Rules;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
// Only `vary` writes it. It is not declared read-only: a compiler may move a read-only read to its first use, where the thread then waits for it.
@group(0) @binding(2) var<storage, read_write> operations: array<vec4u>;
@group(0) @binding(3) var<storage, read_write> states: array<u32>;
@group(0) @binding(4) var<storage, read_write> links: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> fruits: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> works: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> worlds: array<f32>;
@group(0) @binding(8) var<storage, read> pushes: array<f32>;
// `vary` binds the base table in the place of forces.
@group(0) @binding(8) var<storage, read> table: array<vec4u>;

const NO_SEGMENT: u32 = 0xffffffffu;

// Number of the tile, the lane in it, and where the tile's parts of the buffers begin for this lane. Slots belong to a warp.
var<private> tile_number: u32;
var<private> lane: u32;
var<private> operations_at: u32;
var<private> links_at: u32;
var<private> fruits_at: u32;
var<private> works_at: u32;
var<private> leaves_at: u32;
var<private> slots_at: u32;
var<private> cross_forks_at: u32;
var<private> cross_loads_at: u32;

// Sets these for a thread.
fn enter(tile: u32, warp: u32, lane_of_tile: u32) {
    tile_number = tile;
    lane = lane_of_tile;
    operations_at = header(TILE_ROWS) * LANES + lane;
    links_at = header(TILE_LINKS) + lane;
    fruits_at = header(TILE_FRUIT) * quads_of_fruit() + lane;
    works_at = header(TILE_WORK) + lane;
    leaves_at = header(TILE_LEAVES) + lane;
    slots_at = header(TILE_SLOTS) + warp * header(TILE_SLOTS_EACH) * (FORK_FIELDS / QUAD * LANES) + lane;
    cross_forks_at = header(TILE_CROSS_FORKS) + lane;
    cross_loads_at = header(TILE_CROSS_LOADS) + lane;
}

// Waits for a number here and returns it: the factor is 1, which no compiler knows. A number that a loop has from before it, or that one branch reads, would
// otherwise be waited for inside the loop, row after row, together with all reads issued since (`docs/computation/gpu.md`, Reading ahead).
fn awaited(x: vec4f) -> vec4f {
    return x * f32(min(rules.substeps, 1u));
}

// The same of numbers in the place of bits, which are no numbers to multiply: a small whole number would become zero.
fn awaited_bits(x: vec4f) -> vec4f {
    return bitcast<vec4f>(awaited_words(bitcast<vec4u>(x)));
}

fn awaited_words(x: vec4u) -> vec4u {
    return x * min(rules.substeps, 1u);
}

fn header(field: u32) -> u32 {
    return tiles[tile_number * TILE_FIELDS + field];
}

fn operation_at(row: u32) -> u32 {
    return operations_at + row * LANES;
}

fn link_at(row: u32) -> u32 {
    return links_at + row * (LINK_FIELDS / QUAD * LANES);
}

fn link(at: u32, field: u32) -> vec4f {
    return links[at + field / QUAD * LANES];
}

fn set_link(at: u32, field: u32, value: vec4f) {
    links[at + field / QUAD * LANES] = value;
}

// Number of warps of a tile that work; the parts of the others are empty (`laws.rs`).
override TEAM: u32 = WARPS;
// True if a wind blows.
override WIND: bool = false;
// True if workgroups of its own set the air, and if such press the links (`laws.rs`).
override AIR_ASIDE: bool = false;
override PRESS_ASIDE: bool = false;

// First field of the pull in a row of fruit.
fn pull_field() -> u32 {
    return select(FRUIT_FIELDS, ROD_FIELDS, STEMS);
}

// Quads of a row of fruit in all lanes.
fn quads_of_fruit() -> u32 {
    return (pull_field() + select(0u, PULL_FIELDS, WIND)) / QUAD * LANES;
}

fn fruit_at(row: u32) -> u32 {
    return fruits_at + row * quads_of_fruit();
}

fn fruit(at: u32, field: u32) -> vec4f {
    return fruits[at + field / QUAD * LANES];
}

fn set_fruit(at: u32, field: u32, value: vec4f) {
    fruits[at + field / QUAD * LANES] = value;
}

fn world_at(field: u32) -> u32 {
    return (tile_number * WORLD_FIELDS + field) * LANES + lane;
}

fn world(field: u32) -> f32 {
    return worlds[world_at(field)];
}

// True if the tile has a world in this lane.
fn is_there() -> bool {
    return bitcast<u32>(world(WORLD_LINKS)) != 0u;
}

fn set_world(field: u32, value: f32) {
    worlds[world_at(field)] = value;
}

// True if every joint has a damper of its own and the springs lead (`orchard_treephys::TreeBody::lead_springs`).
override MODAL: bool = false;

// Damping of the world's joints over their stiffness [s], read once a frame.
var<private> damping_time: f32;

// First quad of the dampers of the joints: behind the links.
fn dampers_at() -> u32 {
    return link_at(header(TILE_STARTS + PARTS));
}

// Damping over stiffness of the joint of a row [s]; `at` is that of `dampers_at`.
fn damper_time(at: u32, row: u32) -> f32 {
    return links[at + row * (DAMPER_FIELDS / QUAD * LANES)].x;
}

// First quad of the air at the links, behind the dampers; in worlds without wind nothing is there.
fn airs_at() -> u32 {
    return dampers_at() + header(TILE_STARTS + PARTS) * (select(0u, DAMPER_FIELDS, MODAL) / QUAD * LANES);
}

// First quad of the air at the link of a row; `at` is that of `airs_at`. It is read as the link is.
fn air_at(at: u32, row: u32) -> u32 {
    return at + row * (AIR_FIELDS / QUAD * LANES);
}

// First quad of the waves of the gusts, behind the air.
fn waves_at() -> u32 {
    return air_at(airs_at(), select(0u, header(TILE_STARTS + PARTS), WIND));
}

// Quads of a wave with its phases, in all lanes.
fn quads_of_wave() -> u32 {
    return (WAVE_FIELDS / QUAD + 2u * rules.fours) * LANES;
}

// First quad of the shares of the mean speed at the places, behind the waves.
fn profiles_at() -> u32 {
    return waves_at() + select(0u, rules.waves * quads_of_wave(), WIND);
}

// First quad of the velocities of the air at the places at the end of a frame, behind these shares: those of three frames in turn.
fn winds_at(frame: u32) -> u32 {
    return profiles_at() + select(0u, (1u + 4u * (frame % 3u)) * rules.fours * LANES, WIND);
}

// First quad behind them.
fn behind_air_at() -> u32 {
    return profiles_at() + select(0u, 13u * rules.fours * LANES, WIND);
}

// Number of the frame, less those in which the world stood still.
fn own_frame() -> u32 {
    if TOUCHES {
        return rules.frame - bitcast<u32>(world(WORLD_MISSED));
    }
    return rules.frame;
}

fn p_trunk() -> vec3f {
    return vec3f(world(WORLD_P), world(WORLD_P + 1u), world(WORLD_P + 2u));
}

fn work_at(row: u32) -> u32 {
    return works_at + row * (WORK_FIELDS / QUAD * LANES);
}

fn leaf_at(leaf: u32) -> u32 {
    return leaves_at + leaf * (LEAF_FIELDS / QUAD * LANES);
}

fn slot_at(slot: u32) -> u32 {
    return slots_at + slot * (FORK_FIELDS / QUAD * LANES);
}

fn cross_fork_at(fork: u32) -> u32 {
    return cross_forks_at + fork * (FORK_FIELDS / QUAD * LANES);
}

fn cross_load_at(load: u32) -> u32 {
    return cross_loads_at + load * (LOAD_FIELDS / QUAD * LANES);
}

fn quad(at: u32, field: u32) -> vec4f {
    return works[at + field / QUAD * LANES];
}

fn set_quad(at: u32, field: u32, value: vec4f) {
    works[at + field / QUAD * LANES] = value;
}

// First quad of the fork that a link's parent has stored, for a link that does not follow its parent in the next row.
fn parent_fork_at(word: u32) -> u32 {
    let place = (word >> FIRST_PARENT) & 0xffu;
    if (word & FIRST_FROM_CROSS) != 0u {
        return cross_fork_at(place);
    }
    return slot_at(place);
}
