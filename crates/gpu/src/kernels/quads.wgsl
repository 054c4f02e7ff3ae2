// Quads or words of a buffer at listed places, from or to a packed buffer. A thread moves one.

@group(0) @binding(0) var<storage, read> places: array<u32>;
@group(0) @binding(1) var<storage, read_write> quads: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> gathered: array<vec4f>;

@group(0) @binding(1) var<storage, read_write> words: array<u32>;
@group(0) @binding(2) var<storage, read_write> packed_words: array<u32>;

// Place of a quad or word that is not there.
const NOWHERE: u32 = 0xffffffffu;

@compute @workgroup_size(192)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&places) && places[id.x] != NOWHERE {
        gathered[id.x] = quads[places[id.x]];
    }
}

@compute @workgroup_size(192)
fn scatter(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&places) && places[id.x] != NOWHERE {
        quads[places[id.x]] = gathered[id.x];
    }
}

@compute @workgroup_size(192)
fn scatter_words(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&places) && places[id.x] != NOWHERE {
        words[places[id.x]] = packed_words[id.x];
    }
}
