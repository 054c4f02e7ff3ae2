// Masks of depth images: 1 where a depth was measured, a byte a pixel, four pixels a word.

@group(0) @binding(0) var<storage, read> depths: array<f32>;
@group(0) @binding(1) var<storage, read_write> masks: array<u32>;

@compute @workgroup_size(MASK_THREADS)
fn mask(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let word = id.y * groups.x * MASK_THREADS + id.x;
    if word >= arrayLength(&masks) {
        return;
    }
    var bits = 0u;
    for (var k = 0u; k < 4u; k++) {
        let pixel = 4u * word + k;
        if pixel < arrayLength(&depths) && depths[pixel] > 0.0 {
            bits |= 1u << (8u * k);
        }
    }
    masks[word] = bits;
}
