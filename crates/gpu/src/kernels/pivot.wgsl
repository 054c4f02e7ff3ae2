// Numbers of a rod's elimination, which the way in, the way out and the contacts of a robot share.

// True if fruit hang on stems that bend.
override STEMS: bool = false;

struct RodPivot {
    // From the joint to the centre of the fruit [m].
    length: f32,
    // Inertia that the tether adds to the fruit, and mass that both add to the end of the rod, mu [kg].
    kappa: f32,
    added: f32,
    // J, and P = J + mu L^2 [kg m^2].
    inertia: f32,
    swing: f32,
    // mu L [kg m].
    lever: f32,
    // Armatures a of bending and twist; 1 / (P + a), and 1 / (J + a) of the twist.
    armature: vec2f,
    inverse: vec2f,
}

// The pivot of a rod of a length, with a ball of a mass and radius on a tether of some stiffness and damping at its end; its own stiffness and damping are those of bending and twist.
fn pivot_of_rod(length: f32, ball: vec2f, tether: vec2f, stiffness: vec2f, damping: vec2f) -> RodPivot {
    let h = rules.h;
    let mass = ball.x;
    let kappa = h * (tether.y + h * tether.x);
    let added = mass * kappa / (mass + kappa);
    let inertia = BALL * mass * ball.y * ball.y;
    let lever = added * length;
    let swing = inertia + lever * length;
    let armature = (damping * rules.damped + stiffness * h) * h;
    let inverse = vec2f(1.0) / (vec2f(swing, inertia) + armature);
    return RodPivot(length, kappa, added, inertia, swing, lever, armature, inverse);
}

// Part of a vector along a direction.
fn along(e: vec3f, v: vec3f) -> vec3f {
    return e * dot(e, v);
}

// Product with a tensor that has one number across a direction and another along it.
fn about(across_and_along: vec2f, e: vec3f, v: vec3f) -> vec3f {
    return v * across_and_along.x + along(e, v) * (across_and_along.y - across_and_along.x);
}
