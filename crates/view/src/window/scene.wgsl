// Draws instances of small meshes. A vertex lies at a x + b y + c z under the sizes (x, y, z) of its instance, in the instance's frame.

struct View {
    clip_world: mat4x4<f32>,
    eye: vec4<f32>,
    sun: vec4<f32>,
    sky: vec4<f32>,
    // Half the side of the ground.
    ground: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;

struct Vertex {
    @location(0) a: vec3<f32>,
    @location(1) b: vec3<f32>,
    @location(2) c: vec3<f32>,
    @location(3) normal: vec3<f32>,
    @location(4) place: vec3<f32>,
    @location(5) turn: vec4<f32>,
    @location(6) sizes: vec3<f32>,
    @location(7) colour: vec3<f32>,
    @location(8) kind: f32,
}

struct Shown {
    @builtin(position) clip: vec4<f32>,
    @location(0) at: vec3<f32>,
    @location(1) up: vec3<f32>,
    @location(2) @interpolate(flat) tint: vec3<f32>,
    @location(3) @interpolate(flat) kind: f32,
}

fn turned(q: vec4<f32>, v: vec3<f32>) -> vec3<f32> {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

fn placed(v: Vertex) -> vec3<f32> {
    return v.place + turned(v.turn, v.a * v.sizes.x + v.b * v.sizes.y + v.c * v.sizes.z);
}

@vertex
fn vertex(v: Vertex) -> Shown {
    let at = placed(v);
    return Shown(view.clip_world * vec4<f32>(at, 1.0), at, turned(v.turn, v.normal), v.colour, v.kind);
}

// Onto the ground along the light, a little above it.
@vertex
fn shadow_vertex(v: Vertex) -> @builtin(position) vec4<f32> {
    let at = placed(v);
    let down = at.xy - view.sun.xy / view.sun.z * max(at.z, 0.0);
    return view.clip_world * vec4<f32>(down, 0.003, 1.0);
}

fn light(n: vec3<f32>) -> f32 {
    return 0.62 + 0.18 * n.z + 0.42 * max(dot(n, view.sun.xyz), 0.0);
}

fn towards(n: vec3<f32>, to_eye: vec3<f32>) -> vec3<f32> {
    return select(n, -n, dot(n, to_eye) < 0.0);
}

fn lit(s: Shown) -> vec3<f32> {
    let flat_normal = cross(dpdx(s.at), dpdy(s.at));
    let n = select(flat_normal, s.up, dot(s.up, s.up) > 0.0);
    return s.tint * light(towards(n / max(length(n), 1e-12), view.eye.xyz - s.at));
}

// Meshes with normals are lit by the corner, which costs less than by the pixel.
struct Lit {
    @builtin(position) clip: vec4<f32>,
    @location(0) colour: vec3<f32>,
}

@vertex
fn closed_vertex(v: Vertex) -> Lit {
    return Lit(view.clip_world * vec4<f32>(placed(v), 1.0), v.colour * light(turned(v.turn, v.normal)));
}

// Both sides are seen.
@vertex
fn open_vertex(v: Vertex) -> Lit {
    let at = placed(v);
    let n = towards(turned(v.turn, v.normal), view.eye.xyz - at);
    return Lit(view.clip_world * vec4<f32>(at, 1.0), v.colour * light(n));
}

@fragment
fn lit_fragment(s: Lit) -> @location(0) vec4<f32> {
    return vec4<f32>(s.colour, 1.0);
}

// Ground with lines a metre apart, which fades into the sky.
fn ground(lit: vec3<f32>, at: vec2<f32>) -> vec4<f32> {
    let cell = abs(fract(at - 0.5) - 0.5) / max(fwidth(at), vec2<f32>(1e-9, 1e-9));
    let line = mix(0.9, 1.0, clamp(min(cell.x, cell.y), 0.0, 1.0));
    let far = smoothstep(0.33 * view.ground.x, 0.96 * view.ground.x, length(at));
    return vec4<f32>(mix(lit * line, view.sky.xyz, far), 1.0);
}

@fragment
fn fragment(s: Shown) -> @location(0) vec4<f32> {
    let is_ground = s.kind > 0.5;
    let shown = lit(s);
    let on_ground = ground(shown, s.at.xy);
    return select(vec4<f32>(shown, 1.0), on_ground, is_ground);
}

struct Level {
    @builtin(position) clip: vec4<f32>,
    @location(0) at: vec2<f32>,
    @location(1) @interpolate(flat) colour: vec3<f32>,
}

@vertex
fn level_vertex(v: Vertex) -> Level {
    let at = placed(v);
    return Level(view.clip_world * vec4<f32>(at, 1.0), at.xy, v.colour * light(v.normal));
}

@fragment
fn level_fragment(s: Level) -> @location(0) vec4<f32> {
    return ground(s.colour, s.at);
}

@fragment
fn shadow_fragment() -> @location(0) vec4<f32> {
    return vec4<f32>(0.36, 0.35, 0.33, 1.0);
}

// Marks: their kind is the opacity, negative.
@fragment
fn mark_fragment(s: Shown) -> @location(0) vec4<f32> {
    return vec4<f32>(mix(lit(s), s.tint, 0.5), clamp(-s.kind, 0.0, 1.0));
}
