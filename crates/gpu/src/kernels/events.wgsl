// Events at the end of a frame. A thread is a world.

// Axes and tip of a link as `place_links` has computed them.
struct Placed {
    axes: Axes,
    p: vec3f,
}

// Acts on what the tests of a frame have found: breaks joints, detaches fruit, or stops a world that is not finite. Workgroups of the wind's own press the links of worlds of which nothing was
// found: the notice of another world is not 0, whatever becomes of it meanwhile, but where it stops.
@compute @workgroup_size(LANES)
fn apply_events(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    tile_number = group.x;
    lane = thread;
    let found = bitcast<u32>(world(WORLD_NOTICE));
    if PRESS_ASIDE && group.y > 0u {
        enter(group.x, 0u, thread);
        if is_there() {
            if found == 0u {
                press_links(group.y - 1u, groups.y - 1u, rules.frame);
            }
            set_air_of_fruit(group.y - 1u, groups.y - 1u, rules.frame + 1u);
        }
        return;
    }
    if (found & NOTICE_NON_FINITE) != 0u {
        set_world(WORLD_STOPPED, bitcast<f32>(rules.frame));
    }
    if (found & (NOTICE_NON_FINITE | NOTICE_SNAPS | NOTICE_DETACHES)) == 0u {
        return;
    }
    enter(group.x, 0u, thread);
    var left = 0u;
    if (found & NOTICE_NON_FINITE) == 0u {
        if (found & NOTICE_SNAPS) != 0u {
            snap();
        }
        if (found & NOTICE_DETACHES) != 0u {
            detach();
        }
        left = NOTICE_STALE;
    }
    set_world(WORLD_NOTICE, bitcast<f32>(left));
}

// Adds one to a count of the world.
fn count(field: u32) {
    set_world(field, bitcast<f32>(bitcast<u32>(world(field)) + 1u));
}

// Breaks the joints that were over their limits for enough frames, those nearest to the trunk first: what hangs from them is no longer loaded.
fn snap() {
    place_links();
    let rows = header(TILE_STARTS + PARTS);
    for (var row = 0u; row < rows; row++) {
        let place = operation_at(row);
        let bits = states[place];
        let is_live = (operations[place].x & FIRST_ACTIVE) != 0u && (bits & STATE_DEBRIS) == 0u;
        if is_live && (bits & STATE_FRAMES_OVER) >= rules.rupture_frames {
            break_joint(row, rows);
        }
    }
}

// Computes axes and tip of every link and stores them in the rows' work. Parents have smaller rows.
fn place_links() {
    let rows = header(TILE_STARTS + PARTS);
    for (var row = 0u; row < rows; row++) {
        let operation = operations[operation_at(row)];
        if (operation.x & FIRST_ACTIVE) == 0u {
            continue;
        }
        let parent = placed_parent(operation.x, operation.w);
        let own = read_link(link_at(row));
        let joint = joint_outward(parent.axes, own.direction, own.q);
        let p = parent.p + joint.axes.z * own.length;
        let at = work_at(row);
        set_quad(at, 0u, vec4f(joint.axes.y, joint.axes.z.x));
        set_quad(at, 4u, vec4f(joint.axes.z.yz, p.xy));
        set_quad(at, 8u, vec4f(p.z, 0.0, 0.0, 0.0));
    }
}

// Axes and tip of a link's parent.
fn placed_parent(first_word: u32, fourth_word: u32) -> Placed {
    if (first_word & FIRST_ROOT) != 0u {
        return Placed(world_axes(), p_trunk());
    }
    return placed(work_at(fourth_word >> FOURTH_PARENT_ROW));
}

// Axes and tip of a placed link; `at` is its row's work.
fn placed(at: u32) -> Placed {
    let a = quad(at, 0u);
    let b = quad(at, 4u);
    return Placed(axes_of(a.xyz, vec3f(a.w, b.xy)), vec3f(b.zw, quad(at, 8u).x));
}

// Breaks a joint as `treephys::Rupture` does: the spring is removed, and the sub-tree becomes debris with less drag. The sub-tree's fruit count towards
// the moment and the inertia.
fn break_joint(broken: u32, rows: u32) {
    let own = operations[operation_at(broken)];
    let p_joint = placed_parent(own.x, own.w).p;
    var moment = vec3f(0.0);
    var inertia = 0.0;
    for (var row = broken; row < rows; row++) {
        let place = operation_at(row);
        let operation = operations[place];
        if row != broken && !is_of_broken_limb(operation.x, operation.w) {
            continue;
        }
        states[place] |= STATE_DEBRIS | STATE_BREAKING;
        let member = read_link(link_at(row));
        let here = placed(work_at(row));
        let half = here.axes.z * (0.5 * member.length);
        let arm = here.p - half - p_joint;
        moment += arm * member.mass;
        inertia += member.mass * dot(arm, arm) + member.across + member.excess * (1.0 / 3.0);
        let first_fruit = (operation.z >> THIRD_FIRST_FRUIT) & 0xfffu;
        let last_fruit = first_fruit + ((operation.z >> THIRD_FRUIT) & 0x3fu);
        for (var k = first_fruit; k < last_fruit; k++) {
            let stem = fruit_at(k);
            let hanging = read_stem(stem);
            if hanging.stiffness > 0.0 {
                let to_fruit = hanging.p - p_joint;
                moment += to_fruit * hanging.mass;
                inertia += hanging.mass * dot(to_fruit, to_fruit);
            }
        }
    }
    for (var row = broken; row < rows; row++) {
        states[operation_at(row)] &= ~STATE_BREAKING;
    }
    states[operation_at(broken)] |= STATE_BROKEN | (rules.frame << STATE_BROKE);
    let at = link_at(broken);
    let friction = rules.friction_ratio * rules.gravity * length(moment);
    set_link(at, LINK_LIMIT, vec4f(link(at, LINK_LIMIT).x, inertia, friction, 0.0));
    count(WORLD_SNAPPED);
}

// True if a link's parent belongs to the limb that is breaking off.
fn is_of_broken_limb(first_word: u32, fourth_word: u32) -> bool {
    if (first_word & FIRST_ACTIVE) == 0u || (first_word & FIRST_ROOT) != 0u {
        return false;
    }
    return (states[operation_at(fourth_word >> FOURTH_PARENT_ROW)] & STATE_BREAKING) != 0u;
}

// Detaches the fruit whose stems were over a limit for enough frames, or have worn out.
fn detach() {
    let count_of_fruit = bitcast<u32>(world(WORLD_FRUIT));
    for (var row = 0u; row < count_of_fruit; row++) {
        let at = fruit_at(row);
        let stem = read_stem(at);
        let frames = stem.frames_over;
        var is_over = (frames & 0xffu) >= rules.tension_frames || (frames >> 8u) >= rules.pull_frames;
        if STEMS {
            is_over = frames != 0u;
        }
        if stem.stiffness == 0.0 || !is_over {
            continue;
        }
        // From now on the angular velocity stands there: that of a stem that bends does so already.
        if !STEMS {
            set_fruit(at, FRUIT_ARM, vec4f(0.0));
        }
        set_fruit(at, FRUIT_P, vec4f(stem.p, bitcast<f32>(rules.frame)));
        count(WORLD_DETACHED);
    }
}
