// Quads or words to places of a buffer, from records: the place, then the quad or word. A thread moves one.

@group(0) @binding(0) var<storage, read> records: array<u32>;
@group(0) @binding(1) var<storage, read_write> quads: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> words: array<u32>;

@compute @workgroup_size(192)
fn scatter_quads(@builtin(global_invocation_id) id: vec3u) {
    let first = 5 * id.x;
    if first + 4 < arrayLength(&records) {
        let bits = vec4u(records[first + 1], records[first + 2], records[first + 3], records[first + 4]);
        quads[records[first]] = bitcast<vec4f>(bits);
    }
}

@compute @workgroup_size(192)
fn scatter_words(@builtin(global_invocation_id) id: vec3u) {
    let first = 2 * id.x;
    if first + 1 < arrayLength(&records) {
        words[records[first]] = records[first + 1];
    }
}
