// Motion and inertia of a robot's links, and the system of a substep,
//
//     (M + h D + h^2 K) dv = h (tau - c(q, v) - K (q - q_0 + h v) - D v),
//
// by composite bodies and a dense Cholesky factor (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5 and 6). All vectors are in the axes of
// odom, about the origin of their link.

// A rigid body: mass, first moment, and inertia by its diagonal and by xy, xz, yz.
struct Body {
    mass: f32,
    moment: vec3f,
    diagonal: vec3f,
    products: vec3f,
}

// Of each link: its y and z axes, the vector from its parent's origin, and its angular velocity.
var<private> link_y: array<vec3f, ROBOT_DOFS>;
var<private> link_z: array<vec3f, ROBOT_DOFS>;
var<private> r_parent: array<vec3f, ROBOT_DOFS>;
var<private> omega: array<vec3f, ROBOT_DOFS>;
// Accelerations with all joint rates constant.
var<private> bias_angular: array<vec3f, ROBOT_DOFS>;
var<private> bias_linear: array<vec3f, ROBOT_DOFS>;
// The link itself; then with all that it carries.
var<private> bodies: array<Body, ROBOT_DOFS>;
// Torque and force of weight and velocity products on the link; then on all that it carries.
var<private> torques: array<vec3f, ROBOT_DOFS>;
var<private> forces: array<vec3f, ROBOT_DOFS>;

// The joint-space inertia with the couplings above its diagonal and on it, the Cholesky factor below; inverses of the factor's diagonal.
var<private> matrix: array<f32, ROBOT_DOFS * ROBOT_DOFS>;
var<private> pivot_inverse: array<f32, ROBOT_DOFS>;
// Impulses of weight, velocity products and couplings on the joints; changes of their velocities.
var<private> impulse: array<f32, ROBOT_DOFS>;
var<private> change: array<f32, ROBOT_DOFS>;

fn axes_of_link(link: u32) -> mat3x3f {
    return mat3x3f(cross(link_y[link], link_z[link]), link_y[link], link_z[link]);
}

// Columns of a symmetric matrix.
fn symmetric_matrix(diagonal: vec3f, products: vec3f) -> mat3x3f {
    return mat3x3f(
        vec3f(diagonal.x, products.xy),
        vec3f(products.x, diagonal.y, products.z),
        vec3f(products.yz, diagonal.z),
    );
}

// Inertia about the centre of mass, turned with the axes of its link.
fn turned(inertia: Inertia, axes: mat3x3f) -> mat3x3f {
    return axes * symmetric_matrix(inertia.diagonal, inertia.products) * transpose(axes);
}

// A link as a body about its origin: I - m [c][c].
fn body_of(mass: f32, r_com: vec3f, about_com: mat3x3f) -> Body {
    let c = r_com;
    let moment = mass * c;
    let own = vec3f(about_com[0].x, about_com[1].y, about_com[2].z);
    let across = vec3f(about_com[0].yz, about_com[1].z);
    return Body(mass, moment, own + (dot(moment, c) - moment * c), across - moment.xxy * c.yzz);
}

// A body about an origin from which the old one is `r` away: I - [r][mc] - [mc][r] - m [r][r].
fn shifted(body: Body, r: vec3f) -> Body {
    let half = body.moment + 0.5 * body.mass * r;
    return Body(
        body.mass,
        body.moment + body.mass * r,
        body.diagonal + 2.0 * (dot(half, r) - half * r),
        body.products - (half.xxy * r.yzz + half.yzz * r.xxy),
    );
}

fn joined(a: Body, b: Body) -> Body {
    return Body(a.mass + b.mass, a.moment + b.moment, a.diagonal + b.diagonal, a.products + b.products);
}

// Places the links, root to tips, with their bodies and what acts on each.
fn move_links() {
    for (var j = 0u; j < robot.dofs; j++) {
        let link = robot.links[j];
        var parent = mat3x3f(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), vec3f(0.0, 0.0, 1.0));
        var w = vec3f(0.0);
        var b_w = vec3f(0.0);
        var b_v = vec3f(0.0);
        if link.parent >= 0 {
            let p = u32(link.parent);
            parent = axes_of_link(p);
            w = omega[p];
            b_w = bias_angular[p];
            b_v = bias_linear[p];
        }
        let z = parent * link.z_parent;
        var y = parent * link.y_parent;
        var r = parent * link.p_parent;
        var slip = vec3f(0.0);
        var spin = vec3f(0.0);
        if link.slides != 0u {
            r += z * q(j);
            slip = z * v(j);
        } else {
            let turn = sin_cos(q(j));
            y = y * turn.y - cross(y, z) * turn.x;
            spin = z * v(j);
        }
        b_v += cross(b_w, r) + cross(w, cross(w, r) + 2.0 * slip);
        b_w += cross(w, spin);
        w += spin;
        link_y[j] = y;
        link_z[j] = z;
        r_parent[j] = r;
        omega[j] = w;
        bias_angular[j] = b_w;
        bias_linear[j] = b_v;

        let axes = axes_of_link(j);
        let r_com = axes * link.inertia.p_com;
        let about_com = turned(link.inertia, axes);
        bodies[j] = body_of(link.inertia.mass, r_com, about_com);
        let a_com = b_v + cross(b_w, r_com) + cross(w, cross(w, r_com));
        let force = link.inertia.mass * (vec3f(0.0, 0.0, -robot.gravity) - a_com);
        forces[j] = force;
        torques[j] = cross(r_com, force) - about_com * b_w - cross(w, about_com * w);
    }
}

// Component of a wrench along a joint.
fn along_joint(link: u32, torque: vec3f, force: vec3f) -> f32 {
    return dot(link_z[link], select(torque, force, robot.links[link].slides != 0u));
}

fn entry(row: u32, column: u32) -> u32 {
    return row * ROBOT_DOFS + column;
}

// Fills the matrix and the impulses, tips to root.
fn assemble() {
    for (var j = robot.dofs; j > 0u; ) {
        j--;
        for (var i = 0u; i < j; i++) {
            matrix[entry(i, j)] = 0.0;
        }
        impulse[j] = robot.h * along_joint(j, torques[j], forces[j]);
        // Momentum of all that the joint moves, at its unit velocity.
        let body = bodies[j];
        let z = link_z[j];
        var n = symmetric_matrix(body.diagonal, body.products) * z;
        var f = cross(z, body.moment);
        if robot.links[j].slides != 0u {
            n = cross(body.moment, z);
            f = body.mass * z;
        }
        var link = j;
        loop {
            matrix[entry(link, j)] = along_joint(link, n, f);
            let parent = robot.links[link].parent;
            if parent < 0 {
                break;
            }
            n += cross(r_parent[link], f);
            link = u32(parent);
        }
        let parent = robot.links[j].parent;
        if parent >= 0 {
            let p = u32(parent);
            bodies[p] = joined(bodies[p], shifted(body, r_parent[j]));
            torques[p] += torques[j] + cross(r_parent[j], forces[j]);
            forces[p] += forces[j];
        }
    }
    couple();
}

// Adds the couplings, as springs and dampers at the end of the substep.
fn couple() {
    for (var k = 0u; k < robot.couplings; k++) {
        let coupling = robot.coupled[k];
        let a = coupling.a;
        let b = coupling.b;
        let ratio = coupling.ratio;
        let rate = robot.h * coupling.stiffness + coupling.damping;
        let pull = robot.h * (coupling.stiffness * (q(a) - ratio * q(b)) + rate * (v(a) - ratio * v(b)));
        impulse[a] -= pull;
        impulse[b] += ratio * pull;
        let armature = robot.h * rate;
        matrix[entry(a, a)] += armature;
        matrix[entry(b, b)] += ratio * ratio * armature;
        matrix[entry(min(a, b), max(a, b))] -= ratio * armature;
    }
}

// A joint at the start of a substep: coordinate and velocity; impulse on it and its diagonal entry of the matrix, without servo and losses; and these.
struct Driven {
    q: f32,
    v: f32,
    impulse: f32,
    diagonal: f32,
    servo: Servo,
    loss: Loss,
}

// Impulse on a joint, and its diagonal entry of the matrix, under its present servo and losses.
fn driven(own: Driven) -> vec2f {
    let damping = own.servo.damping + own.loss.damping + own.loss.stuck / robot.creep;
    let stretch = own.q - own.servo.rest + robot.h * own.v;
    return vec2f(
        own.impulse + robot.h * (own.servo.torque + own.loss.torque - damping * own.v - own.servo.stiffness * stretch),
        own.diagonal + robot.h * (damping + robot.h * own.servo.stiffness),
    );
}

fn joint_driven(i: u32) -> Driven {
    return Driven(q(i), v(i), impulse[i], matrix[entry(i, i)], servos[i], losses[i]);
}

// Solves the substep for the changes of the velocities, under the present servos and losses.
fn solve() {
    for (var i = 0u; i < robot.dofs; i++) {
        let own = driven(joint_driven(i));
        var rest = own.x;
        var pivot = own.y;
        for (var j = 0u; j < i; j++) {
            var sum = matrix[entry(j, i)];
            for (var k = 0u; k < j; k++) {
                sum -= matrix[entry(i, k)] * matrix[entry(j, k)];
            }
            let factor = sum * pivot_inverse[j];
            matrix[entry(i, j)] = factor;
            pivot -= factor * factor;
            rest -= factor * change[j];
        }
        pivot_inverse[i] = inverseSqrt(pivot);
        change[i] = rest * pivot_inverse[i];
    }
    for (var i = robot.dofs; i > 0u; ) {
        i--;
        var rest = change[i];
        for (var k = i + 1u; k < robot.dofs; k++) {
            rest -= matrix[entry(k, i)] * change[k];
        }
        change[i] = rest * pivot_inverse[i];
    }
}

// Velocity at the end of the substep, and coordinate.
fn new_v(dof: u32) -> f32 {
    return v(dof) + change[dof];
}

fn new_q(dof: u32) -> f32 {
    return q(dof) + robot.h * new_v(dof);
}
