// Loads of links.

// Load on a link's tip: articulated inertia and impulses of everything beyond. Symmetric matrices are kept as their columns from the diagonal
// down, (xx, xy, xz) and (yy, yz, zz); the columns of the coupling are torques by linear motion along x, y and z.
struct Load {
    angular: array<vec3f, 2>,
    coupling: array<vec3f, 3>,
    linear: array<vec3f, 2>,
    torque: vec3f,
    force: vec3f,
}

fn nothing() -> Load {
    let zero = vec3f(0.0);
    return Load(array(zero, zero), array(zero, zero, zero), array(zero, zero), zero, zero);
}

fn plus(a: Load, b: Load) -> Load {
    return Load(
        array(a.angular[0] + b.angular[0], a.angular[1] + b.angular[1]),
        array(a.coupling[0] + b.coupling[0], a.coupling[1] + b.coupling[1], a.coupling[2] + b.coupling[2]),
        array(a.linear[0] + b.linear[0], a.linear[1] + b.linear[1]),
        a.torque + b.torque,
        a.force + b.force,
    );
}

// Adds a point mass at an arm.
fn plus_point_mass(to: Load, mass: f32, arm: vec3f) -> Load {
    let m = arm * mass;
    var sum = to;
    sum.angular[0] += vec3f(m.y * arm.y + m.z * arm.z, -m.x * arm.y, -m.x * arm.z);
    sum.angular[1] += vec3f(m.x * arm.x + m.z * arm.z, -m.y * arm.z, m.x * arm.x + m.y * arm.y);
    sum.coupling[0] += vec3f(0.0, m.z, -m.y);
    sum.coupling[1] += vec3f(-m.z, 0.0, m.x);
    sum.coupling[2] += vec3f(m.y, -m.x, 0.0);
    sum.linear[0].x += mass;
    sum.linear[1].x += mass;
    sum.linear[1].z += mass;
    return sum;
}

fn load(at: u32) -> Load {
    let a = quad(at, 0u);
    let b = quad(at, 4u);
    let c = quad(at, 8u);
    let d = quad(at, 12u);
    let e = quad(at, 16u);
    let f = quad(at, 20u);
    let g = quad(at, 24u);
    return Load(
        array(a.xyz, vec3f(a.w, b.xy)),
        array(vec3f(b.zw, c.x), c.yzw, d.xyz),
        array(vec3f(d.w, e.xy), vec3f(e.zw, f.x)),
        f.yzw,
        g.xyz,
    );
}

fn set_load(at: u32, value: Load) {
    set_quad(at, 0u, vec4f(value.angular[0], value.angular[1].x));
    set_quad(at, 4u, vec4f(value.angular[1].yz, value.coupling[0].xy));
    set_quad(at, 8u, vec4f(value.coupling[0].z, value.coupling[1]));
    set_quad(at, 12u, vec4f(value.coupling[2], value.linear[0].x));
    set_quad(at, 16u, vec4f(value.linear[0].yz, value.linear[1].xy));
    set_quad(at, 20u, vec4f(value.linear[1].z, value.torque));
    set_quad(at, 24u, vec4f(value.force, 0.0));
}
