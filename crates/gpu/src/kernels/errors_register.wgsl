// Registration of a stereo camera's images to the view of another camera, without interpolation: each pixel covers its own rectangle, and the nearest counts, which has the
// most steps of disparity. A measured depth is one of few numbers, so that a table of the processor's tells the rectangles.

// First pixel of an image's registered steps among the marks.
fn registered(image: u32) -> u32 {
    return image * law.marks + law.bit_columns * law.size.y;
}

@compute @workgroup_size(PIXEL_THREADS)
fn place(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= law.size.x {
        return;
    }
    let steps = steps_of(id.z, id.x, id.y);
    let entry = u32(steps) - law.first_steps;
    // No depth within the range has other steps.
    if steps <= 0 || entry >= law.table_steps {
        return;
    }
    let columns = entry * (law.size.x + law.size.y + 2u) + id.x;
    let rows = entry * (law.size.x + law.size.y + 2u) + law.size.x + 1u + id.y;
    let first = vec2u(table[columns], table[rows]);
    let end = vec2u(table[columns + 1u], table[rows + 1u]);
    for (var v = first.y; v < end.y; v++) {
        for (var u = first.x; u < end.x; u++) {
            atomicMax(&marks[registered(id.z) + v * law.camera.x + u], u32(steps));
        }
    }
}

@compute @workgroup_size(PIXEL_THREADS)
fn show(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= law.camera.x {
        return;
    }
    let i = id.y * law.camera.x + id.x;
    let steps = atomicLoad(&marks[registered(id.z) + i]);
    var depth = 0.0;
    if steps > 0u {
        depth = depth_of(i32(steps));
    }
    measured[shots[id.z].measured + i] = depth;
}
