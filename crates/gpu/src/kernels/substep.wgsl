// One substep of worlds with a robot, in two passes: the contacts are solved between the way in and the way out. `frame` does both in one pass, without contacts.

// Goes inwards, level by level; first step 0 of `frame` in the first substep of a frame.
@compute @workgroup_size(LANES * TEAM)
fn substep_inward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let runs = enter_substep(group.x, thread);
    let is_stale = rules.substep == 0u && (bitcast<u32>(world(WORLD_NOTICE)) & NOTICE_STALE) != 0u;
    let warp = thread / LANES;
    // The air acts from the end of this frame on, that of the frame before where the motion is stale.
    if BLOWS && runs && rules.substep == 0u {
        sample_air(warp, TEAM, own_frame());
        if is_stale {
            sample_air(warp, TEAM, own_frame() - 1u);
        }
    }
    storageBarrier();
    for (var level = 0u; level <= LEVELS; level++) {
        if runs && is_stale && (level > 0u || warp == 0u) {
            outward(part_of(level, warp), LOOK);
        }
        storageBarrier();
    }
    for (var inner = 0u; inner <= LEVELS; inner++) {
        let level = LEVELS - inner;
        if runs && (level > 0u || warp == 0u) {
            inward(part_of(level, warp));
        }
        storageBarrier();
    }
}

// Goes outwards; at the end of a frame with its tests.
@compute @workgroup_size(LANES * TEAM)
fn substep_outward(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let runs = enter_substep(group.x, thread);
    let is_last = rules.substep + 1u == rules.substeps;
    let warp = thread / LANES;
    found_notice = 0u;
    found_peak = 0.0;
    found_excess = 0.0;
    found_tension = 0.0;
    for (var level = 0u; level <= LEVELS; level++) {
        if runs && (level > 0u || warp == 0u) {
            outward(part_of(level, warp), select(ADVANCE, TEST, is_last));
        }
        storageBarrier();
    }
    if is_last {
        conclude(thread, runs);
        conclude_strain(thread, runs);
    }
}

// Rise of the largest square of an angle that is told: the peak of the host may be too low by the rounding of f32, our own choice.
const RISE: f32 = 1.00001;

// Stores what the parts of a world have found of its strain. The tension, which is not negative, has the order of its bits.
fn conclude_strain(thread: u32, runs: bool) {
    workgroupBarrier();
    notices[thread] = bitcast<u32>(found_tension);
    peaks[thread] = found_excess;
    workgroupBarrier();
    if thread < LANES && runs {
        var tension = 0u;
        var excess = 0.0;
        for (var k = 0u; k < TEAM; k++) {
            tension = max(tension, notices[k * LANES + lane]);
            excess = max(excess, peaks[k * LANES + lane]);
        }
        set_world(WORLD_TENSION, bitcast<f32>(tension));
        set_world(WORLD_EXCESS, excess);
        let peak = world(WORLD_PEAK);
        if peak > world(WORLD_TOLD_PEAK) * RISE {
            set_world(WORLD_TOLD_PEAK, peak);
            set_world(WORLD_NOTICE, bitcast<f32>(bitcast<u32>(world(WORLD_NOTICE)) | NOTICE_PEAKED));
        }
    }
}

// Sets a thread to its world and this substep; true if the world runs.
fn enter_substep(tile: u32, thread: u32) -> bool {
    enter(tile, thread / LANES, thread % LANES);
    substep = rules.substep;
    damping_time = rules.damped * world(WORLD_DAMPING_TIME);
    return is_there() && bitcast<u32>(world(WORLD_STOPPED)) == 0u;
}

// Part of a warp in a level.
fn part_of(level: u32, warp: u32) -> u32 {
    return select((level - 1u) * WARPS + warp + 1u, 0u, level == 0u);
}
