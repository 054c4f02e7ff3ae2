// Fruit: eliminated as leaves of the tree on their stems, point masses that fly, roll or rest off them.

// Regularisation of a contact as a share of its own inverse inertia, as in `orchard_multibody`.
const NEAR_RIGID: f32 = 1e-4;
// Rotational inertia of a ball by mass and square of the radius.
const BALL: f32 = 0.4;

// A fruit with its stem, read at once.
struct Stem {
    mass: f32,
    radius: f32,
    threshold: f32,
    air_drag: f32,
    stiffness: f32,
    damping: f32,
    bias: f32,
    cap: f32,
    anchor: vec3f,
    drop: f32,
    force: vec3f,
    frames_over: u32,
    p: vec3f,
    came_off: f32,
    v: vec3f,
    inverse_mass: f32,
    arm: vec3f,
    impulse: vec3f,
}

fn read_stem(at: u32) -> Stem {
    let a = fruit(at, FRUIT_MASS);
    let b = fruit(at, FRUIT_STIFFNESS);
    let c = fruit(at, FRUIT_ANCHOR);
    let d = fruit(at, FRUIT_FORCE);
    let e = fruit(at, FRUIT_P);
    let f = fruit(at, FRUIT_V);
    let g = fruit(at, FRUIT_ARM);
    let i = fruit(at, FRUIT_IMPULSE);
    let hangs = bitcast<u32>(e.w) == 0u;
    return Stem(
        a.x, a.y, a.z, a.w,
        select(0.0, b.x, hangs), select(0.0, b.y, hangs), b.z, b.w,
        c.xyz, c.w,
        d.xyz, bitcast<u32>(d.w),
        e.xyz, e.w,
        f.xyz, f.w,
        g.xyz,
        i.xyz,
    );
}

// Computes what the next substep starts from, with the link's motion and position at its joint; returns the square of the stem's stretch.
fn stem_start(at: u32, stem: Stem, own: Motion, p: vec3f, is_debris: bool) -> f32 {
    let h = rules.h;
    let arm = own.axes.x * stem.anchor.x + own.axes.y * stem.anchor.y + own.axes.z * stem.anchor.z;
    var stretch = stem.p - (p + arm);
    stretch.z -= stem.drop;
    let u_relative = stem.v - (own.v + cross(own.w, arm));

    // Impulse of the stem on the anchor, with both velocities unchanged.
    let kappa = h * (stem.damping + h * stem.stiffness);
    let pull = stretch * (h * stem.stiffness) + u_relative * kappa;
    let hangs = stem.stiffness > 0.0;
    let drag = select(stem.air_drag * length(stem.v), 0.0, hangs);
    let mass = stem.mass + h * drag;
    let inverse_mass = 1.0 / (mass + kappa);
    let share = kappa * inverse_mass;
    var impulse = (stem.force - stem.v * drag) * h - pull;
    impulse.z -= h * stem.mass * rules.gravity;

    // Reaction on the anchor. On live wood the weight at rest is taken off it; above the cap its size is the cap's and the fruit adds no mass.
    var reaction = pull + impulse * share;
    let is_live = hangs && !is_debris;
    reaction.z += h * select(0.0, stem.bias, is_live);
    let size = length(reaction);
    let largest = h * select(UNBOUNDED, stem.cap, is_live);
    let is_capped = size > largest;
    set_fruit(at, FRUIT_V, vec4f(stem.v, inverse_mass));
    set_fruit(at, FRUIT_ARM, vec4f(select(stem.arm, arm, hangs), 0.0));
    set_fruit(
        at,
        FRUIT_REACTION,
        vec4f(select(reaction, reaction * (largest / size), is_capped), select(mass * share, 0.0, is_capped)),
    );
    set_fruit(at, FRUIT_IMPULSE, vec4f(impulse, 0.0));
    return select(0.0, dot(stretch, stretch), hangs);
}

// The fruit at the end of a substep; `turn` and `shift` are the changes of velocity of its link at the joint.
fn stem_end(at: u32, from_stem: Stem, turn: vec3f, shift: vec3f) -> Stem {
    let h = rules.h;
    var stem = from_stem;
    var impulse = stem.impulse;
    if stem.stiffness > 0.0 {
        let kappa = h * (stem.damping + h * stem.stiffness);
        impulse += (shift + cross(turn, stem.arm)) * kappa;
    } else {
        let met = ground_impulse(stem);
        impulse += met.impulse;
        // `stem_start` writes it.
        stem.arm = met.spin;
    }
    return moved(at, stem, impulse);
}

// The fruit after an impulse over a substep.
fn moved(at: u32, from_stem: Stem, impulse: vec3f) -> Stem {
    var stem = from_stem;
    stem.v += impulse * stem.inverse_mass;
    stem.p += stem.v * rules.h;
    if SETTLES {
        stem.v = vec3f(0.0);
    }
    // What starts the next substep writes the velocity.
    set_fruit(at, FRUIT_P, vec4f(stem.p, stem.came_off));
    return stem;
}

// Impulse of the ground on a loose fruit, and the fruit's spin after it.
struct Met {
    impulse: vec3f,
    spin: vec3f,
}

// Contact of a loose fruit with the ground in closed form, as in `orchard_batch`. That of one at the hand of a robot is among the robot's contacts.
fn ground_impulse(stem: Stem) -> Met {
    // Velocity at the end of the substep without contact.
    let v = stem.v + stem.impulse * stem.inverse_mass;
    let inertia = BALL * stem.mass * stem.radius * stem.radius;
    var spin = stem.arm / (1.0 + rules.h * rules.spin_loss);
    let gap = stem.p.z - stem.radius;
    let time = select(rules.h + rules.dissipation_time, rules.h, gap > 0.0);
    let admittance = rules.h * rules.ground_stiffness * time;
    let compliance = max(1.0 / admittance, NEAR_RIGID * stem.inverse_mass);
    let pressed = (-gap / time - v.z) / (compliance + stem.inverse_mass);
    let is_at_hand = TOUCHES && bitcast<u32>(stem.came_off) == 0u;
    var impulse = vec3f(0.0);
    if pressed > 0.0 && !is_at_hand {
        let arm = vec3f(0.0, 0.0, -stem.radius);
        let slip = v + cross(spin, arm);
        let across = stem.inverse_mass + stem.radius * stem.radius / inertia;
        var held = vec3f(slip.x, slip.y, 0.0) * (-1.0 / ((1.0 + NEAR_RIGID) * across));
        let size = length(held);
        let most = rules.ground_friction * pressed;
        if size > most {
            held = held * (most / size);
        }
        spin += cross(arm, held) / inertia;
        impulse = held + vec3f(0.0, 0.0, pressed);
    }
    return Met(impulse, spin);
}
