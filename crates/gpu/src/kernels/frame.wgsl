// Twin: `twin/frame.rs`. A workgroup is a tile, a thread a world's part.

var<workgroup> notices: array<u32, LANES * WARPS>;
var<workgroup> peaks: array<f32, LANES * WARPS>;

@compute @workgroup_size(LANES * WARPS)
fn frame(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    enter(group.x, thread % LANES);
    let warp = thread / LANES;
    let runs = bitcast<u32>(world(WORLD_STOPPED)) == 0u;
    let is_stale = (bitcast<u32>(world(WORLD_NOTICE)) & NOTICE_STALE) != 0u;
    found_notice = 0u;
    found_peak = 0.0;
    // Step 0 looks where something has changed. Then each substep: the warps' parts inwards, the trunk's in and out, the warps' outwards.
    for (var step = 0u; step <= rules.substeps; step++) {
        substep = step - 1u;
        let way = select(select(ADVANCE, TEST, step == rules.substeps), LOOK, step == 0u);
        for (var phase = 0u; phase < 3u; phase++) {
            let is_trunk = phase == 1u;
            let part = select(warp + 1u, 0u, is_trunk);
            if runs && (!is_trunk || warp == 0u) && (step > 0u || is_stale) {
                if phase < 2u && step > 0u {
                    inward(part);
                }
                if phase > 0u {
                    outward(part, way);
                }
            }
            if phase < 2u {
                storageBarrier();
                workgroupBarrier();
            }
        }
    }
    notices[thread] = found_notice;
    peaks[thread] = found_peak;
    workgroupBarrier();
    if warp == 0u && runs {
        var peak = world(WORLD_PEAK);
        for (var k = 0u; k < WARPS; k++) {
            found_notice |= notices[k * LANES + lane];
            peak = max(peak, peaks[k * LANES + lane]);
        }
        set_world(WORLD_NOTICE, bitcast<f32>(found_notice));
        set_world(WORLD_PEAK, peak);
    }
}
