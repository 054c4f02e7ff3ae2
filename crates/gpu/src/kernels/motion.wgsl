// Motion of links, and joints between them. `joint_outward` and `axes_of` have twins in `twin/motion.rs`.

// Orthonormal axes, in world coordinates.
struct Axes {
    x: vec3f,
    y: vec3f,
    z: vec3f,
}

// Motion of a link's tip: angular and linear velocity, and the bias accelerations, which are those with all joint rates constant.
struct Motion {
    axes: Axes,
    w: vec3f,
    b_w: vec3f,
    v: vec3f,
    b_v: vec3f,
}

// A joint turned by its angles: the first joint axis, the link's axes (y is the second joint axis), and the direction into which the rate about the
// second axis turns the first.
struct Joint {
    first: vec3f,
    third: vec3f,
    axes: Axes,
}

// Constants and state of a link, read at once so that the thread waits for memory once.
struct Link {
    direction: vec3f,
    length: f32,
    mass: f32,
    across: f32,
    excess: f32,
    stiffness: f32,
    q: vec2f,
    v: vec2f,
}

// The part of them that the outward pass needs.
struct Hinge {
    direction: vec3f,
    length: f32,
    q: vec2f,
    v: vec2f,
}

// A joint, and the axes of the parent computed from it.
struct JointInward {
    joint: Joint,
    parent: Axes,
}

fn read_link(at: u32) -> Link {
    return link_of(link(at, LINK_DIRECTION), link(at, LINK_MASS), link(at, LINK_Q));
}

fn link_of(a: vec4f, b: vec4f, d: vec4f) -> Link {
    return Link(a.xyz, a.w, b.x, b.y, b.z, b.w, d.xy, d.zw);
}

fn read_hinge(at: u32) -> Hinge {
    return hinge_of(link(at, LINK_DIRECTION), link(at, LINK_Q));
}

fn hinge_of(a: vec4f, b: vec4f) -> Hinge {
    return Hinge(a.xyz, a.w, b.xy, b.zw);
}

fn axes_of(y: vec3f, z: vec3f) -> Axes {
    return Axes(cross(y, z), y, z);
}

fn world_axes() -> Axes {
    return Axes(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), vec3f(0.0, 0.0, 1.0));
}

// Motion of the ground.
fn still() -> Motion {
    let zero = vec3f(0.0);
    return Motion(world_axes(), zero, zero, zero, zero);
}

// A joint from its parent's axes: the smallest rotation that carries z onto the direction c, with u = z + (c_x x + c_y y) / (1 + c_z), then the two
// joint angles.
fn joint_outward(parent: Axes, c: vec3f, q: vec2f) -> Joint {
    let across = parent.x * c.x + parent.y * c.y;
    let u = across * (1.0 / (1.0 + c.z)) + parent.z;
    let first = parent.x - u * c.x;
    let frame_y = parent.y - u * c.y;
    let frame_z = parent.z * c.z + across;
    let t_1 = sin_cos(q.x);
    let t_2 = sin_cos(q.y);
    let y = frame_y * t_1.y + frame_z * t_1.x;
    let third = frame_z * t_1.y - frame_y * t_1.x;
    return Joint(first, third, Axes(first * t_2.y - third * t_2.x, y, first * t_2.x + third * t_2.y));
}

// A joint and its parent's axes from the link's axes: the inverse of `joint_outward`.
fn joint_inward(own: Axes, c: vec3f, q: vec2f) -> JointInward {
    let t_1 = sin_cos(q.x);
    let t_2 = sin_cos(q.y);
    let first = own.x * t_2.y + own.z * t_2.x;
    let third = own.z * t_2.y - own.x * t_2.x;
    let frame_y = own.y * t_1.y - third * t_1.x;
    let frame_z = own.y * t_1.x + third * t_1.y;
    let across = first * c.x + frame_y * c.y;
    let u = frame_z - across * (1.0 / (1.0 + c.z));
    let parent = Axes(first + u * c.x, frame_y + u * c.y, frame_z * c.z - across);
    return JointInward(Joint(first, third, own), parent);
}

// A motion as it stands in memory. It is unpacked where it is used, since computing with it earlier would be a wait.
struct Packed {
    a: vec4f,
    b: vec4f,
    c: vec4f,
    d: vec4f,
    e: vec4f,
}

fn packed_motion(at: u32, field: u32) -> Packed {
    return Packed(
        quad(at, field),
        quad(at, field + 4u),
        quad(at, field + 8u),
        quad(at, field + 12u),
        quad(at, field + 16u),
    );
}

fn unpacked(p: Packed) -> Motion {
    return Motion(
        axes_of(p.a.xyz, vec3f(p.a.w, p.b.xy)),
        vec3f(p.b.zw, p.c.x),
        p.c.yzw,
        p.d.xyz,
        vec3f(p.d.w, p.e.xy),
    );
}

fn motion(at: u32, field: u32) -> Motion {
    return unpacked(packed_motion(at, field));
}

fn awaited_motion(at: u32, field: u32) -> Motion {
    let p = packed_motion(at, field);
    return unpacked(Packed(awaited(p.a), awaited(p.b), awaited(p.c), awaited(p.d), awaited(p.e)));
}

// `more`: the last two numbers, which are free for another use.
fn set_motion(at: u32, field: u32, value: Motion, more: vec2f) {
    set_quad(at, field, vec4f(value.axes.y, value.axes.z.x));
    set_quad(at, field + 4u, vec4f(value.axes.z.yz, value.w.xy));
    set_quad(at, field + 8u, vec4f(value.w.z, value.b_w));
    set_quad(at, field + 12u, vec4f(value.v, value.b_v.x));
    set_quad(at, field + 16u, vec4f(value.b_v.yz, more));
}
