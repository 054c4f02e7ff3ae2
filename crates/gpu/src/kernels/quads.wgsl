// Quads of a buffer at listed places, to a packed buffer. A thread moves one.

@group(0) @binding(0) var<storage, read> places: array<u32>;
@group(0) @binding(1) var<storage, read_write> quads: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> gathered: array<vec4f>;

// Place of a quad that is not there.
const NOWHERE: u32 = 0xffffffffu;

@compute @workgroup_size(192)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&places) && places[id.x] != NOWHERE {
        gathered[id.x] = quads[places[id.x]];
    }
}
