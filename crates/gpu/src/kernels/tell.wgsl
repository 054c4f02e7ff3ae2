// Tells the host what happened to the worlds of lanes in a frame, and gives the motion of a tree only from the first frame on in which something did. After its last frame a world is held until it is given frames anew.

@group(0) @binding(0) var<storage, read> tables: array<vec4u>;
@group(0) @binding(1) var<storage, read> meetings: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> worlds: array<f32>;
@group(0) @binding(3) var<storage, read> links: array<vec4f>;
@group(0) @binding(4) var<storage, read> fruits: array<vec4f>;
@group(0) @binding(5) var<storage, read> asked: array<u32>;
@group(0) @binding(6) var<storage, read_write> told: array<vec4f>;
// Number of slots given so far.
@group(0) @binding(7) var<storage, read_write> given: atomic<u32>;

const THREADS: u32 = 64u;
// Impulse of two fruit on each other below which nothing has happened [N s], our own choice: half a millimetre a second of a fruit.
const FAINT: f32 = 1e-4;
// Place of a quad, or slot, that is not there.
const NOWHERE: u32 = 0xffffffffu;
const RECORD_QUADS: u32 = (MEETING_FIELDS + MEETING_MOST_CONTACTS * CONTACT_FIELDS) / QUAD;

// Number of contacts that bear load, or are not finite.
var<workgroup> loaded: atomic<u32>;
var<workgroup> own_slot: u32;
// Number of the frame among those that the world was given.
var<workgroup> own_frame: u32;

fn head(field: u32) -> u32 {
    return tables[field / QUAD][field % QUAD];
}

// First field of the world of a lane.
fn world_of(lane: u32) -> u32 {
    return tables[head(HEAD_PLACES) + lane * head(HEAD_PLACE) + PLACE_WORLD / QUAD][PLACE_WORLD % QUAD];
}

fn world_bits(own_world: u32, field: u32) -> u32 {
    return bitcast<u32>(worlds[own_world + field * LANES]);
}

fn set_world_bits(own_world: u32, field: u32, value: u32) {
    worlds[own_world + field * LANES] = bitcast<f32>(value);
}

fn frames_of(lane: u32) -> u32 {
    return asked[ASKED_FIELDS + lane] >> WISH_FRAMES_BIT;
}

// Gives worlds the frames that they are to take, and holds the others. A thread is a lane.
@compute @workgroup_size(THREADS)
fn give(@builtin(global_invocation_id) id: vec3u) {
    let lane = id.x;
    if lane >= asked[ASKED_LANES] {
        return;
    }
    let own_world = world_of(lane);
    let stopped = world_bits(own_world, WORLD_STOPPED);
    if frames_of(lane) == 0u && stopped == 0u {
        set_world_bits(own_world, WORLD_STOPPED, WORLD_HELD);
    } else if frames_of(lane) != 0u && stopped == WORLD_HELD {
        set_world_bits(own_world, WORLD_STOPPED, 0u);
    }
    set_world_bits(own_world, WORLD_TAKEN, 0u);
    set_world_bits(own_world, WORLD_STIRRED, 0u);
    set_world_bits(own_world, WORLD_MISSED, asked[ASKED_FIELDS + asked[ASKED_LANES] + lane]);
}

// Number of the frame that a lane has just taken, or 0 if it was given none and is asked nevertheless, once.
fn frame_of(lane: u32) -> u32 {
    let own_world = world_of(lane);
    if frames_of(lane) == 0u {
        let is_told = world_bits(own_world, WORLD_TAKEN) != 0u;
        return select(0u, NOWHERE, asked[ASKED_FIELDS + lane] == WISH_NOTHING || is_told);
    }
    return select(world_bits(own_world, WORLD_TAKEN), NOWHERE, world_bits(own_world, WORLD_STOPPED) == WORLD_HELD);
}

// A workgroup is a lane.
@compute @workgroup_size(THREADS)
fn tell(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let lane = group.x;
    if thread == 0u {
        own_frame = frame_of(lane);
    }
    let frame = workgroupUniformLoad(&own_frame);
    if frame == NOWHERE {
        return;
    }
    let wish = asked[ASKED_FIELDS + lane] & ((1u << WISH_FRAMES_BIT) - 1u);
    let is_last = frame + 1u >= frames_of(lane);
    let record = head(HEAD_RECORDS) + lane * head(HEAD_RECORD);
    let numbers = array(meetings[record], meetings[record + 1u]);
    let contacts = min(bitcast<u32>(numbers[MEETING_LAST / QUAD][MEETING_LAST % QUAD]), MEETING_MOST_CONTACTS);
    if thread == 0u {
        atomicStore(&loaded, 0u);
    }
    workgroupBarrier();
    if thread < contacts {
        let contact = meetings[record + (MEETING_FIELDS + thread * CONTACT_FIELDS) / QUAD];
        let sizes = tables[head(HEAD_PLACES) + lane * head(HEAD_PLACE) + PLACE_SEGMENTS / QUAD];
        let solids = sizes[PLACE_SEGMENTS % QUAD] + sizes[PLACE_FRUITS % QUAD];
        let is_of_fruit = (bitcast<u32>(contact.w) & PAIR_NUMBER) < solids;
        if any(contact.xyz != vec3f(0.0)) && !(is_of_fruit && dot(contact.xyz, contact.xyz) < FAINT * FAINT) {
            atomicAdd(&loaded, 1u);
        }
    }
    workgroupBarrier();
    if thread == 0u {
        let own_world = world_of(lane);
        let notice = world_bits(own_world, WORLD_NOTICE) & ~NOTICE_STALE;
        let is_stopped = world_bits(own_world, WORLD_STOPPED) != 0u;
        if notice != 0u || is_stopped || atomicLoad(&loaded) != 0u {
            set_world_bits(own_world, WORLD_STIRRED, 1u);
        }
        var slot = NOWHERE;
        if wish == WISH_EACH || (wish == WISH_LAST && is_last) || world_bits(own_world, WORLD_STIRRED) != 0u {
            slot = atomicAdd(&given, 1u);
        }
        own_slot = slot;
        let at = 2u * (frame * asked[ASKED_LANES] + lane);
        told[at] = vec4f(bitcast<f32>(slot), numbers[0].yz, numbers[1].x);
        let excess = worlds[own_world + WORLD_EXCESS * LANES];
        let tension = worlds[own_world + WORLD_TENSION * LANES];
        told[at + 1u] = vec4f(numbers[1].y, excess, tension, 0.0);
        set_world_bits(own_world, WORLD_TAKEN, frame + 1u);
        if is_last || is_stopped {
            set_world_bits(own_world, WORLD_STOPPED, WORLD_HELD);
        }
    }
    workgroupBarrier();
    let slot = own_slot;
    let lanes = asked[ASKED_LANES];
    let most_links = asked[ASKED_LINKS];
    let most_fruit = asked[ASKED_FRUIT];
    let motion = asked[ASKED_MOTION];
    let link_places = ASKED_FIELDS + 2u * lanes + lane * most_links;
    let fruit_places = ASKED_FIELDS + lanes * (2u + most_links) + lane * motion * most_fruit;
    let numbers_end = TOLD_FIELDS / QUAD * asked[ASKED_FRAMES] * lanes;
    let before = numbers_end + lane * most_fruit;
    let each = most_links + (motion + 1u) * most_fruit + RECORD_QUADS;
    let own = numbers_end + most_fruit * lanes + slot * each;
    if slot != NOWHERE {
        for (var k = thread; k < most_links; k += THREADS) {
            let place = asked[link_places + k];
            if place != NOWHERE {
                told[own + k] = links[place];
            }
        }
        for (var k = thread; k < motion * most_fruit; k += THREADS) {
            let place = asked[fruit_places + k];
            if place != NOWHERE {
                told[own + most_links + k] = fruits[place];
            }
        }
        for (var k = thread; k < RECORD_QUADS; k += THREADS) {
            told[own + most_links + motion * most_fruit + k] = meetings[record + k];
        }
    }
    // The velocities of this frame are those of a frame ago in the next one.
    for (var k = thread; k < most_fruit; k += THREADS) {
        if slot != NOWHERE {
            told[own + each - most_fruit + k] = told[before + k];
        }
        let place = asked[fruit_places + motion * k + 1u];
        if place != NOWHERE {
            told[before + k] = fruits[place];
        }
    }
}
