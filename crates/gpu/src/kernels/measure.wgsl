// Mechanical energy of a world as `orchard_multibody::energy` defines it, zero at the height of the world's origin. A workgroup is a tile, a thread a part of
// a world.

// Sums up a world's energy in the fixed order of its warps. It changes nothing that a frame starts from.
@compute @workgroup_size(LANES * TEAM)
fn measure(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let warp = thread / LANES;
    enter(group.x, warp, thread % LANES);
    var energy = 0.0;
    for (var level = 0u; level <= LEVELS; level++) {
        if is_there() && (level > 0u || warp == 0u) {
            energy += energy_of(select((level - 1u) * WARPS + warp + 1u, 0u, level == 0u));
        }
        storageBarrier();
        workgroupBarrier();
    }
    peaks[thread] = energy;
    workgroupBarrier();
    if warp == 0u && is_there() {
        for (var k = 1u; k < TEAM; k++) {
            energy += peaks[k * LANES + lane];
        }
        set_world(WORLD_ENERGY, energy);
    }
}

// Energy of a part [J].
fn energy_of(part: u32) -> f32 {
    let start = header(TILE_STARTS + part);
    let end = header(TILE_STARTS + part + 1u);
    var tip = ground_tip();
    var energy = 0.0;
    for (var row = start; row < end; row++) {
        let operation = operations[operation_at(row)];
        if (operation.x & FIRST_ACTIVE) == 0u {
            continue;
        }
        let bits = states[operation_at(row)];
        let own = read_link(link_at(row));
        if (operation.x & FIRST_ROOT) != 0u {
            tip = ground_tip();
        } else if (operation.x & (FIRST_FROM_SLOT | FIRST_FROM_CROSS)) != 0u {
            tip = fork(parent_fork_at(operation.x));
        }
        let p_joint = tip.p;
        let at_joint = kinematics(read_hinge(link_at(row)), tip.motion);
        let d = at_joint.axes.z * own.length;
        let v_d = cross(at_joint.w, d);
        tip.motion = at_joint;
        tip.motion.v += v_d;
        tip.p += d;

        let v_com = at_joint.v + v_d * 0.5;
        let along = dot(at_joint.w, at_joint.axes.z);
        let turning = own.across * dot(at_joint.w, at_joint.w) + own.excess * along * along;
        energy += 0.5 * (own.mass * dot(v_com, v_com) + turning);
        energy += own.mass * rules.gravity * (p_joint.z + 0.5 * d.z);
        energy += select(0.5 * own.stiffness * dot(own.q, own.q), 0.0, (bits & STATE_BROKEN) != 0u);
        let first_fruit = (operation.z >> THIRD_FIRST_FRUIT) & 0xfffu;
        let last_fruit = first_fruit + ((operation.z >> THIRD_FRUIT) & 0x3fu);
        for (var k = first_fruit; k < last_fruit; k++) {
            let stem = read_stem(fruit_at(k));
            if STEMS {
                energy += energy_on_rod(stem, read_rod(fruit_at(k)), at_joint, p_joint);
            } else {
                energy += energy_of_fruit(stem, at_joint.axes, p_joint, (bits & STATE_DEBRIS) != 0u);
            }
        }
        if (operation.x & FIRST_TO_SLOT) != 0u {
            set_fork(slot_at((operation.x >> FIRST_SLOT) & 0xffu), tip);
        }
        if (operation.x & FIRST_TO_CROSS) != 0u {
            set_fork(cross_fork_at(operation.x >> FIRST_FORK), tip);
        }
    }
    return energy;
}

// Of a fruit and its rod, which stays when the fruit has come off.
fn energy_on_rod(stem: Stem, rod: Rod, own: Motion, p_joint: vec3f) -> f32 {
    let inertia = BALL * stem.mass * stem.radius * stem.radius;
    let direction = direction_of(rod.q, rod.rest);
    let bent = deflection(rod, direction);
    let bend = angle_of(sqrt(bent.square_sine), bent.cosine);
    let w = own.w + in_world(own.axes, rod.rate);
    let stretch = stem.p - (p_joint + in_world(own.axes, stem.anchor - direction * stem.drop));
    let spin = select(stem.arm, vec3f(0.0), stem.stiffness > 0.0);
    return stem.mass * (0.5 * dot(stem.v, stem.v) + rules.gravity * stem.p.z)
        + 0.5 * inertia * (dot(w, w) + dot(spin, spin))
        + 0.5 * (rules.stem_bending * bend * bend + rules.stem_twisting * bent.twist * bent.twist)
        + 0.5 * stem.stiffness * dot(stretch, stretch);
}

fn energy_of_fruit(stem: Stem, axes: Axes, p_joint: vec3f, is_debris: bool) -> f32 {
    let energy = stem.mass * (0.5 * dot(stem.v, stem.v) + rules.gravity * stem.p.z);
    if stem.stiffness == 0.0 {
        let inertia = BALL * stem.mass * stem.radius * stem.radius;
        return energy + 0.5 * inertia * dot(stem.arm, stem.arm);
    }
    let p_anchor = p_joint + axes.x * stem.anchor.x + axes.y * stem.anchor.y + axes.z * stem.anchor.z;
    var stretch = stem.p - p_anchor;
    stretch.z -= stem.drop;
    let bias = select(stem.bias, 0.0, is_debris);
    return energy + 0.5 * stem.stiffness * dot(stretch, stretch) - bias * p_anchor.z;
}
