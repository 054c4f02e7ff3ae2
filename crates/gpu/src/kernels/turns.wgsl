// Rotations as quaternions (vector, scalar). Twin: `twin/turns.rs`, which explains the functions.

const NO_TURN: vec4f = vec4f(0.0, 0.0, 0.0, 1.0);
const STRAIGHT_BACK: f32 = 1e-12;

fn product(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(b.xyz * a.w + a.xyz * b.w + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}

fn turned(turn: vec4f, v: vec3f) -> vec3f {
    let twice = cross(turn.xyz, v) * 2.0;
    return v + twice * turn.w + cross(turn.xyz, twice);
}

fn unit_turn(turn: vec4f) -> vec4f {
    return turn * (1.0 / sqrt(dot(turn, turn)));
}

fn unit_vector(v: vec3f) -> vec3f {
    return v * (1.0 / sqrt(dot(v, v)));
}

fn turn_by(v: vec3f) -> vec4f {
    let angle = sqrt(dot(v, v));
    if angle == 0.0 {
        return NO_TURN;
    }
    let half = sin_cos(0.5 * angle);
    return vec4f(v * (half.x / angle), half.y);
}

fn turn_between(start: vec3f, end: vec3f) -> vec4f {
    let turn = vec4f(cross(start, end), 1.0 + dot(start, end));
    if turn.w < STRAIGHT_BACK {
        return vec4f(1.0, 0.0, 0.0, 0.0);
    }
    return unit_turn(turn);
}

fn spread_turn(along: vec3f, heading: vec3f, factor: f32) -> vec4f {
    let axis = cross(along, heading);
    let sine = sqrt(dot(axis, axis));
    if sine == 0.0 {
        return NO_TURN;
    }
    let angle = angle_of(sine, dot(along, heading));
    return turn_by(axis * ((min(angle * factor, PI) - angle) / sine));
}

fn droop_turn(heading: vec3f, angle: f32) -> vec4f {
    let axis = vec3f(-heading.y, heading.x, 0.0);
    let sine = sqrt(dot(axis, axis));
    if sine == 0.0 {
        return NO_TURN;
    }
    let to_ground = angle_of(sine, -heading.z);
    return turn_by(axis * (clamp(angle, to_ground - PI, to_ground) / sine));
}

fn bend_turn(heading: vec3f, bend: vec2f) -> vec4f {
    let azimuth = sin_cos(bend.y);
    let across = vec2f(azimuth.y, azimuth.x);
    var w = 1.0 + heading.z;
    if heading.z < 0.0 {
        w = dot(heading.xy, heading.xy) / (1.0 - heading.z);
    }
    if w < STRAIGHT_BACK {
        return turn_by(vec3f(across.x, -across.y, 0.0) * bend.x);
    }
    let along = dot(heading.xy, across);
    return turn_by(vec3f(across - heading.xy * (along / w), -along) * bend.x);
}
