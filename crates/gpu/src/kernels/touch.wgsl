// Numbers of the links that contacts with a robot need (`layout::touch`).

// True if a robot may touch wood and fruit.
override TOUCHES: bool = false;

fn touch_at(row: u32) -> u32 {
    return header(TILE_TOUCHES) + lane + row * (TOUCH_FIELDS / QUAD * LANES);
}

// Keeps the place of a link's joint for the next substep.
fn keep_place(row: u32, p_joint: vec3f, is_debris: bool) {
    let at = touch_at(row);
    let radius = abs(quad(at, TOUCH_P).w);
    set_quad(at, TOUCH_P, vec4f(p_joint, select(radius, -radius, is_debris)));
}

// Keeps the motion of a link, and its joint; `d_inverse` are the numbers xx, xy and yy of the inverse of the joint's pivot.
fn keep_link(row: u32, own: Link, body: Body, d_inverse: vec3f) {
    let at = touch_at(row);
    let first = body.joint.first;
    let second = body.joint.axes.y;
    let c_11 = sqrt(d_inverse.x);
    let c_21 = d_inverse.y / c_11;
    let c_22 = sqrt(d_inverse.z - c_21 * c_21);
    set_quad(at, TOUCH_Z, vec4f(body.joint.axes.z, own.length));
    set_quad(at, TOUCH_FIRST, vec4f(first, c_11));
    set_quad(at, TOUCH_SECOND, vec4f(second, c_22));
    set_quad(at, TOUCH_W, vec4f(body.parent.w + first * own.v.x + second * own.v.y, c_21));
    set_quad(at, TOUCH_V, vec4f(body.parent.v, 0.0));
}
