// Twin: `twin/ground.rs`.

const CREEP: f32 = 1e-3;

fn admittance(is_apart: bool) -> f32 {
    return rules.h * rules.wood_stiffness * select(rules.h + rules.dissipation_time, rules.h, is_apart);
}

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

// A load, and what holds the tip.
struct Propped {
    borne: Load,
    held: vec2f,
}

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
