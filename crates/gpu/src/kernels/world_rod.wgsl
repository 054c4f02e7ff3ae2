// Fruit on stems that bend, as contacts see them: a ball on a tether at the end of a rod, which turns with the rod. An impulse on the ball reaches the rod's end by the tether, and its lever about the
// centre turns the rod (`docs/decisions/0021-a-stem-is-a-link.md`). The rod is one more joint between the fruit and its link, of three degrees of freedom.

// A rod at the start of the substep.
struct Rod {
    pivot: RodPivot,
    // Direction.
    e: vec3f,
    // Part of an impulse on the ball that the tether passes on.
    share: f32,
}

fn rod_of(row: u32) -> Rod {
    let ball = fruit(row, FRUIT_MASS);
    let tether = fruit(row, FRUIT_STIFFNESS);
    let pivot = pivot_of_rod(-fruit(row, FRUIT_ANCHOR).w, ball.xy, tether.xy, vec2f(rules.stem_bending, rules.stem_twisting), tether.zw);
    return Rod(pivot, fruit(row, ROD_DIRECTION).xyz, pivot.kappa * fruit(row, FRUIT_V).w);
}

// Torques about the rod's joint by unit impulses on the ball at `r` from its centre.
fn torques_on_rod(rod: Rod, r: vec3f, directions: mat3x3f) -> mat3x3f {
    return crossed(rod.e * (rod.pivot.length * rod.share) + r, directions);
}

fn about_each(across_and_along: vec2f, e: vec3f, columns: mat3x3f) -> mat3x3f {
    return mat3x3f(
        about(across_and_along, e, columns[0]), about(across_and_along, e, columns[1]), about(across_and_along, e, columns[2]),
    );
}

// What the rod of a fruit passes on to its segment of unit impulses at `p`; `change` is that of the ball's velocity without them if the rod's end does not move.
fn start_on_rod(row: u32, segment: u32, p: vec3f, directions: mat3x3f, change: vec3f) -> Walk {
    let rod = rod_of(row);
    let r = p - fruit(row, FRUIT_P).xyz;
    let n = torques_on_rod(rod, r, directions);
    let y = about_each(rod.pivot.inverse, rod.e, n);
    let forces = directions * rod.share + crossed(rod.e, y) * rod.pivot.lever;
    let link = row_word(segment) & 0xffffu;
    let second = touch(link, TOUCH_SECOND).xyz;
    let z = touch(link, TOUCH_Z).xyz;
    let axes = mat3x3f(cross(second, z), second, z);
    let turning = n - about_each(vec2f(rod.pivot.swing, rod.pivot.inertia), rod.e, y);
    let torques = turning + crossed(axes * fruit(row, FRUIT_ANCHOR).xyz, forces);
    let w = touch(link, TOUCH_W).xyz + axes * fruit(row, ROD_RATE).xyz;
    return Walk(torques, forces, segment, change + cross(w, r), fruit(row, ROD_Y).xyz * n, false);
}

// Inverse inertia of two contacts with one fruit by the turning of its rod.
fn of_rod(row: u32, own: vec2u) -> mat3x3f {
    let rod = rod_of(row);
    let centre = fruit(row, FRUIT_P).xyz;
    let one = torques_on_rod(rod, place_of(own.x) - centre, frame_of(own.x));
    let other = torques_on_rod(rod, place_of(own.y) - centre, frame_of(own.y));
    return transpose(one) * about_each(rod.pivot.inverse, rod.e, other);
}

// Adds the change of a rod's rate by an impulse on its ball and the lever of that about the centre.
fn turn_rod(row: u32, impulse: vec3f, turn: vec3f) {
    let rod = rod_of(row);
    let n = cross(rod.e * (rod.pivot.length * rod.share), impulse) + turn;
    fruits[fruit_at(row, ROD_Y)] += vec4f(about(rod.pivot.inverse, rod.e, n), 0.0);
}
