// One frame of all running worlds. A workgroup is a tile, a thread a part of a world.

// True for the settling steps of worlds that are reset: each substep starts at rest, and the other worlds are left alone.
override SETTLES: bool = false;
// True if the wind acts in these steps.
override BLOWS: bool = false;

var<workgroup> notices: array<u32, LANES * WARPS>;
var<workgroup> peaks: array<f32, LANES * WARPS>;

@compute @workgroup_size(LANES * TEAM)
fn frame(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let warp = thread / LANES;
    enter(group.x, warp, thread % LANES);
    let runs = is_there() && bitcast<u32>(world(WORLD_STOPPED)) == 0u && (!SETTLES || world(WORLD_RESET) != 0.0);
    let is_stale = (bitcast<u32>(world(WORLD_NOTICE)) & NOTICE_STALE) != 0u;
    // Workgroups of the wind's own set the air of the next frame meanwhile.
    if BLOWS && AIR_ASIDE && group.y > 0u {
        if runs {
            sample_air((group.y - 1u) * TEAM + warp, (groups.y - 1u) * TEAM, rules.frame + 1u);
        }
        return;
    }
    found_notice = 0u;
    found_peak = 0.0;
    damping_time = rules.damped * world(WORLD_DAMPING_TIME);
    // Step 0 computes the motion of worlds whose stored motion is stale. Then each substep goes level by level inwards, through the trunk inwards and
    // outwards, and level by level outwards.
    for (var step = 0u; step <= rules.substeps; step++) {
        substep = step - 1u;
        let mode = select(select(ADVANCE, TEST, step == rules.substeps && !SETTLES), LOOK, step == 0u);
        for (var phase = 0u; phase <= 2u * LEVELS; phase++) {
            let level = max(phase, LEVELS) - min(phase, LEVELS);
            let is_trunk = level == 0u;
            let part = select((level - 1u) * WARPS + warp + 1u, 0u, is_trunk);
            if runs && (!is_trunk || warp == 0u) && (step > 0u || is_stale) {
                if phase <= LEVELS && step > 0u {
                    inward(part);
                }
                if phase >= LEVELS {
                    outward(part, mode);
                }
            }
            // Without them the warps that wait for the trunk's set it, a share in every substep.
            if BLOWS && !AIR_ASIDE && is_trunk && runs && step > 0u && warp > 0u {
                sample_air((step - 1u) * (TEAM - 1u) + warp - 1u, rules.substeps * (TEAM - 1u), rules.frame + 1u);
            }
            storageBarrier();
        }
        if BLOWS && PRESS_ASIDE && step == 0u {
            if runs && is_stale {
                press_links(warp, TEAM, rules.frame - 1u);
            }
            storageBarrier();
        }
    }
    conclude(thread, runs);
}

// Stores what the parts of a world have found. Settling leaves motions of another substep, which are stale.
fn conclude(thread: u32, runs: bool) {
    notices[thread] = found_notice;
    peaks[thread] = found_peak;
    workgroupBarrier();
    if thread < LANES && runs {
        var peak = world(WORLD_PEAK);
        for (var k = 0u; k < TEAM; k++) {
            found_notice |= notices[k * LANES + lane];
            peak = max(peak, peaks[k * LANES + lane]);
        }
        set_world(WORLD_NOTICE, bitcast<f32>(select(found_notice, NOTICE_STALE, SETTLES)));
        set_world(WORLD_PEAK, peak);
    }
}
