// Whole worlds: memory that robots, contacts and trees share (`layout::worlds`). The robots' kernels precede this file, and the struct `Rules` of the trees'.

@group(0) @binding(3) var<uniform> rules: Rules;
@group(0) @binding(4) var<storage, read> tables: array<vec4u>;
@group(0) @binding(5) var<storage, read_write> meetings: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> works: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> fruits: array<vec4f>;
@group(0) @binding(8) var<storage, read_write> worlds: array<f32>;
// Number of worlds whose contacts a workgroup of `answer` has taken up in the substep.
@group(0) @binding(9) var<storage, read_write> taken: atomic<u32>;

// Rotational inertia of a ball by mass and square of the radius.
const BALL: f32 = 0.4;
// The segment above the root.
const NO_PARENT: u32 = 0xffffu;

// A world's places in the trees' buffers, its robot's start, and its sizes.
struct Place {
    touch: u32,
    work: u32,
    fruit: u32,
    world: u32,
    turn: vec2f,
    p: vec3f,
    segments: u32,
    fruits: u32,
    overlaps: u32,
    // 1 if the ground is level.
    ground: u32,
}

var<private> world_index: u32;
var<private> place: Place;

// Sets these for a world.
fn enter_world(index: u32) {
    world_index = index;
    let at = place_at();
    let a = tables[at];
    let b = tables[at + 1u];
    let c = tables[at + 2u];
    let start = bitcast<vec4f>(b);
    place = Place(a.x, a.y, a.z, a.w, start.xy, vec3f(start.zw, bitcast<f32>(c.x)), c.y, c.z, c.w, tables[at + 3u].x);
}

fn head(field: u32) -> u32 {
    return tables[field / QUAD][field % QUAD];
}

fn place_at() -> u32 {
    return head(HEAD_PLACES) + world_index * head(HEAD_PLACE);
}

// Rows and parents of a segment, or of a fruit behind all segments: the row below, the segment that bears it above.
fn row_word(collider: u32) -> u32 {
    return tables[place_at() + PLACE_FIELDS / QUAD + collider / QUAD][collider % QUAD];
}

// A word of the world's pairs of fruit that have grown into each other.
fn overlap_word(index: u32) -> u32 {
    let word = head(HEAD_PLACE) * QUAD - 2u * PLACE_MOST_OVERLAPS + index;
    return tables[place_at() + word / QUAD][word % QUAD];
}

fn system_at(field: u32) -> u32 {
    return ((world_index / LANES) * (SYSTEM_FIELDS / QUAD) + field / QUAD) * LANES + world_index % LANES;
}

fn system(field: u32) -> f32 {
    return meetings[system_at(field)][field % QUAD];
}

// First quad of what a world keeps of its contacts.
fn record_at() -> u32 {
    return head(HEAD_RECORDS) + world_index * head(HEAD_RECORD);
}

fn contact_at(contact: u32) -> u32 {
    return record_at() + (MEETING_FIELDS + contact * CONTACT_FIELDS) / QUAD;
}

// Four pairs of near colliders.
fn pairs_at(four: u32) -> u32 {
    return contact_at(MEETING_MOST_CONTACTS) + four;
}

// Number of the workgroup's desk: its memory for the world whose contacts it solves.
var<private> desk: u32;

// Responses of the robot's joints to a unit impulse along a row.
fn response_at(row: u32) -> u32 {
    return head(HEAD_DESKS) + desk * head(HEAD_DESK) + row * (ROBOT_DOFS / QUAD);
}

fn path_at(way: u32, step: u32) -> u32 {
    return response_at(3u * MEETING_MOST_CONTACTS) + (way * head(HEAD_DEPTH) + step) * (PATH_FIELDS / QUAD);
}

// What follows the paths: blocks of the contacts' inverse inertia.
fn blocks_at() -> u32 {
    return path_at(MEETING_MOST_WAYS, 0u);
}

// Fields of a link of the tree, and of a fruit.
fn touch(row: u32, field: u32) -> vec4f {
    return works[touch_place(row, field)];
}

fn touch_place(row: u32, field: u32) -> u32 {
    return place.touch + (row * (TOUCH_FIELDS / QUAD) + field / QUAD) * LANES;
}

fn work_at(row: u32, field: u32) -> u32 {
    return place.work + (row * (WORK_FIELDS / QUAD) + field / QUAD) * LANES;
}

// True if a wind blows.
override WIND: bool = false;

fn fruit_at(row: u32, field: u32) -> u32 {
    let fields = select(FRUIT_FIELDS, ROD_FIELDS, STEMS) + select(0u, PULL_FIELDS, WIND);
    return place.fruit + (row * (fields / QUAD) + field / QUAD) * LANES;
}

fn fruit(row: u32, field: u32) -> vec4f {
    return fruits[fruit_at(row, field)];
}

// True if a fruit that the robot meets is off its stem: a ball in the hand, which spins.
fn is_off_stem(row: u32) -> bool {
    return fruit(row, FRUIT_STIFFNESS).x == 0.0;
}

// 1 over the rotational inertia of a ball, 2/5 m r^2.
fn inverse_spin_inertia(row: u32) -> f32 {
    let ball = fruit(row, FRUIT_MASS);
    return 1.0 / (BALL * ball.x * ball.y * ball.y);
}

// Factor by which a ball loses its spin in a substep.
fn spin_divisor() -> f32 {
    return 1.0 + robot.h * rules.spin_loss;
}

fn world_at(field: u32) -> u32 {
    return place.world + field * LANES;
}

// A vector of odom, in the world.
fn in_world(v: vec3f) -> vec3f {
    return vec3f(place.turn.x * v.x - place.turn.y * v.y, place.turn.y * v.x + place.turn.x * v.y, v.z);
}

// Numbers of a pair of colliders (`layout::pair`).
fn pair_of(first: u32, second: u32) -> u32 {
    return (first << PAIR_FIRST) | second;
}

fn first_of(pair: u32) -> u32 {
    return pair >> PAIR_FIRST;
}

fn second_of(pair: u32) -> u32 {
    return pair & PAIR_NUMBER;
}

// Numbers of the first collider of the robot, of the first that stands still, and of the ground.
fn first_solid() -> u32 {
    return place.segments + place.fruits;
}

fn first_still() -> u32 {
    return first_solid() + head(HEAD_COLLIDERS);
}

fn ground_number() -> u32 {
    return first_still() + head(HEAD_STILL);
}

fn is_fruit(collider: u32) -> bool {
    return collider >= place.segments && collider < first_solid();
}

// True for two fruit.
fn is_of_fruit(pair: u32) -> bool {
    return is_fruit(second_of(pair));
}

fn is_solid(collider: u32) -> bool {
    return collider >= first_solid() && collider < first_still();
}
