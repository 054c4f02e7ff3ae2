// Contact of the tips of broken limbs with the ground, the plane z = 0, as in `orchard_batch`: a damper that the elimination takes implicitly, and the
// impulse on a tip whose velocity stays unchanged. `held` is the velocity at which the normal impulse vanishes and the tip's vertical velocity before;
// the second is UNBOUNDED if there was no contact.

// Speed below which friction on wood acts as a damper [m/s]: the most that a sticking tip creeps at.
const CREEP: f32 = 1e-3;

// h k t of a contact [kg]; t is the time over which an overlap is removed. Surfaces that are still apart feel only the overlap to come.
fn admittance(is_apart: bool) -> f32 {
    return rules.h * rules.wood_stiffness * select(rules.h + rules.dissipation_time, rules.h, is_apart);
}

// Computes and stores the contact of a tip for the next substep, from its height and velocity; `lift` is the change of its vertical velocity in the
// substep before. Friction follows the normal impulse of the substep before, and a tip that pressed then is held on.
fn meet_ground(row: u32, fourth_word: u32, z: f32, v: vec3f, lift: f32, held: vec2f) {
    let radius = f32((fourth_word >> FOURTH_RADIUS) & 0x7fffu) / RADIUS_UNITS;
    let pressed_before = max(admittance(held.x < 0.0) * (held.x - (held.y + lift)), 0.0);
    let gap = z - radius;
    let time = select(rules.h + rules.dissipation_time, rules.h, gap > 0.0);
    let normal = admittance(gap > 0.0);
    let v_hat = -gap / time;
    let pressed = normal * (v_hat - v.z);
    let at = work_at(row);
    if pressed <= 0.0 && pressed_before == 0.0 {
        set_quad(at, WORK_PROP, vec4f(0.0));
        set_quad(at, WORK_HELD, vec4f(0.0, 0.0, UNBOUNDED, 0.0));
    } else {
        let across = rules.wood_friction * pressed_before / max(length(v.xy), CREEP);
        set_quad(at, WORK_PROP, vec4f(-across * v.x, -across * v.y, pressed, across));
        set_quad(at, WORK_HELD, vec4f(normal, v_hat, v.z, 0.0));
    }
}

// A load, and the contact that holds the tip (`held` in `meet_ground`).
struct Propped {
    borne: Load,
    held: vec2f,
}

// Adds the stored contact of a tip to its load.
fn propped(row: u32, load: Load) -> Propped {
    let at = work_at(row);
    let prop = quad(at, WORK_PROP);
    let held = quad(at, WORK_HELD);
    var borne = load;
    borne.linear[0].x += prop.w;
    borne.linear[1].x += prop.w;
    borne.linear[1].z += held.x;
    borne.force += prop.xyz;
    return Propped(borne, held.yz);
}
