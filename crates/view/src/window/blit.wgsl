// One triangle over the part of the window that the picture fills; each pixel takes the picture's nearest.

@group(0) @binding(0) var picture: texture_2d<f32>;

struct Corner {
    @builtin(position) place: vec4<f32>,
    @location(0) share: vec2<f32>,
}

@vertex
fn corner(@builtin(vertex_index) number: u32) -> Corner {
    let share = vec2<f32>(f32((number << 1u) & 2u), f32(number & 2u));
    return Corner(vec4<f32>(2.0 * share.x - 1.0, 1.0 - 2.0 * share.y, 0.0, 1.0), share);
}

fn colour(share: vec2<f32>) -> vec3<f32> {
    let size = vec2<i32>(textureDimensions(picture));
    let at = clamp(vec2<i32>(share * vec2<f32>(size)), vec2<i32>(0), size - 1);
    return textureLoad(picture, at, 0).rgb;
}

@fragment
fn copy(corner: Corner) -> @location(0) vec4<f32> {
    return vec4<f32>(colour(corner.share), 1.0);
}

// The curve of sRGB (IEC 61966-2-1).
@fragment
fn linear(corner: Corner) -> @location(0) vec4<f32> {
    let c = colour(corner.share);
    let high = pow((c + 0.055) / 1.055, vec3<f32>(2.4));
    return vec4<f32>(select(high, c / 12.92, c < vec3<f32>(0.04045)), 1.0);
}
