// Tells the host what happened to the worlds of lanes in a frame, and gives the motion of a tree only where something did. A workgroup is a lane.

@group(0) @binding(0) var<storage, read> tables: array<vec4u>;
@group(0) @binding(1) var<storage, read> meetings: array<vec4f>;
@group(0) @binding(2) var<storage, read> worlds: array<f32>;
@group(0) @binding(3) var<storage, read> links: array<vec4f>;
@group(0) @binding(4) var<storage, read> fruits: array<vec4f>;
@group(0) @binding(5) var<storage, read> asked: array<u32>;
@group(0) @binding(6) var<storage, read_write> told: array<vec4f>;
// Number of slots given so far.
@group(0) @binding(7) var<storage, read_write> given: atomic<u32>;

const THREADS: u32 = 64u;
// Place of a quad, or slot, that is not there.
const NOWHERE: u32 = 0xffffffffu;
const RECORD_QUADS: u32 = (MEETING_FIELDS + MEETING_MOST_CONTACTS * CONTACT_FIELDS) / QUAD;

// Number of contacts that bear load, or are not finite.
var<workgroup> loaded: atomic<u32>;
var<workgroup> own_slot: u32;

fn head(field: u32) -> u32 {
    return tables[field / QUAD][field % QUAD];
}

@compute @workgroup_size(THREADS)
fn tell(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let lane = group.x;
    let wish = asked[ASKED_FIELDS + lane];
    if wish == WISH_NOTHING {
        return;
    }
    let record = head(HEAD_RECORDS) + lane * head(HEAD_RECORD);
    let numbers = array(meetings[record], meetings[record + 1u]);
    let contacts = min(bitcast<u32>(numbers[MEETING_LAST / QUAD][MEETING_LAST % QUAD]), MEETING_MOST_CONTACTS);
    if thread == 0u {
        atomicStore(&loaded, 0u);
    }
    workgroupBarrier();
    if thread < contacts {
        let impulse = meetings[record + (MEETING_FIELDS + thread * CONTACT_FIELDS) / QUAD].xyz;
        if any(impulse != vec3f(0.0)) {
            atomicAdd(&loaded, 1u);
        }
    }
    workgroupBarrier();
    if thread == 0u {
        let own_world = tables[head(HEAD_PLACES) + lane * head(HEAD_PLACE) + PLACE_WORLD / QUAD][PLACE_WORLD % QUAD];
        let notice = bitcast<u32>(worlds[own_world + WORLD_NOTICE * LANES]) & ~NOTICE_STALE;
        let is_stopped = bitcast<u32>(worlds[own_world + WORLD_STOPPED * LANES]) != 0u;
        var slot = NOWHERE;
        if wish == WISH_WHOLE || notice != 0u || is_stopped || atomicLoad(&loaded) != 0u {
            slot = atomicAdd(&given, 1u);
        }
        own_slot = slot;
        told[2u * lane] = vec4f(bitcast<f32>(slot), numbers[0].yz, numbers[1].x);
        let excess = worlds[own_world + WORLD_EXCESS * LANES];
        let tension = worlds[own_world + WORLD_TENSION * LANES];
        told[2u * lane + 1u] = vec4f(numbers[1].y, excess, tension, 0.0);
    }
    workgroupBarrier();
    let slot = own_slot;
    let lanes = asked[ASKED_LANES];
    let most_links = asked[ASKED_LINKS];
    let most_fruit = asked[ASKED_FRUIT];
    let link_places = ASKED_FIELDS + lanes + lane * most_links;
    let fruit_places = ASKED_FIELDS + lanes * (1u + most_links) + lane * 3u * most_fruit;
    let before = TOLD_FIELDS / QUAD * lanes + lane * most_fruit;
    let each = most_links + 4u * most_fruit + RECORD_QUADS;
    let own = TOLD_FIELDS / QUAD * lanes + most_fruit * lanes + slot * each;
    if slot != NOWHERE {
        for (var k = thread; k < most_links; k += THREADS) {
            let place = asked[link_places + k];
            if place != NOWHERE {
                told[own + k] = links[place];
            }
        }
        for (var k = thread; k < 3u * most_fruit; k += THREADS) {
            let place = asked[fruit_places + k];
            if place != NOWHERE {
                told[own + most_links + k] = fruits[place];
            }
        }
        for (var k = thread; k < RECORD_QUADS; k += THREADS) {
            told[own + most_links + 3u * most_fruit + k] = meetings[record + k];
        }
    }
    // The velocities of this frame are those of a frame ago in the next one.
    for (var k = thread; k < most_fruit; k += THREADS) {
        if slot != NOWHERE {
            told[own + each - most_fruit + k] = told[before + k];
        }
        let place = asked[fruit_places + 3u * k + 1u];
        if place != NOWHERE {
            told[before + k] = fruits[place];
        }
    }
}
