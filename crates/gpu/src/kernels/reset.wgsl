// Resets. A thread is a world.

// Puts a marked world back to its start: unbroken, straight and at rest, without forces on its fruit (the host clears those on its links). Settling steps follow (`SETTLES`).
@compute @workgroup_size(LANES)
fn reset(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    enter(group.x, 0u, thread);
    if world(WORLD_RESET) == 0.0 {
        return;
    }
    straighten();
    place_links();
    hang_fruit();
    set_world(WORLD_STOPPED, 0.0);
    set_world(WORLD_NOTICE, bitcast<f32>(NOTICE_STALE));
    set_world(WORLD_SNAPPED, 0.0);
    set_world(WORLD_DETACHED, 0.0);
    set_world(WORLD_PEAK, 0.0);
    set_world(WORLD_BEGAN, bitcast<f32>(rules.frame));
}

// Removes breaks, and sets all angles and rates to zero.
fn straighten() {
    let rows = header(TILE_STARTS + PARTS);
    for (var row = 0u; row < rows; row++) {
        let at = link_at(row);
        states[operation_at(row)] = 0u;
        set_link(at, LINK_LIMIT, vec4f(link(at, LINK_LIMIT).x, 0.0, 0.0, 0.0));
        set_link(at, LINK_Q, vec4f(0.0));
    }
}

// Removes forces on fruit, straightens and mends stems, and puts fruit under them, on the links that `place_links` has placed.
fn hang_fruit() {
    let rows = header(TILE_STARTS + PARTS);
    for (var row = 0u; row < rows; row++) {
        let operation = operations[operation_at(row)];
        if (operation.x & FIRST_ACTIVE) == 0u {
            continue;
        }
        let own = placed(work_at(row));
        let p_joint = own.p - own.axes.z * link(link_at(row), LINK_DIRECTION).w;
        let first_fruit = (operation.z >> THIRD_FIRST_FRUIT) & 0xfffu;
        let last_fruit = first_fruit + ((operation.z >> THIRD_FRUIT) & 0x3fu);
        for (var k = first_fruit; k < last_fruit; k++) {
            let at = fruit_at(k);
            set_fruit(at, FRUIT_FORCE, vec4f(0.0));
            if WIND {
                set_fruit(at, pull_field(), vec4f(vec3f(0.0), fruit(at, pull_field()).w));
            }
            if STEMS {
                set_fruit(at, ROD_Q, vec4f(0.0, 0.0, 0.0, 1.0));
                set_fruit(at, ROD_RATE, vec4f(0.0));
                set_fruit(at, ROD_REST, vec4f(fruit(at, ROD_REST).xyz, 0.0));
            }
            if fruit(at, FRUIT_STIFFNESS).x > 0.0 {
                let anchor = fruit(at, FRUIT_ANCHOR);
                let arm = own.axes.x * anchor.x + own.axes.y * anchor.y + own.axes.z * anchor.z;
                var p = p_joint + arm;
                if STEMS {
                    p -= in_world(own.axes, fruit(at, ROD_REST).xyz) * anchor.w;
                } else {
                    p.z += anchor.w;
                }
                set_fruit(at, FRUIT_P, vec4f(p, 0.0));
                set_fruit(at, FRUIT_V, vec4f(0.0));
            }
        }
    }
}
