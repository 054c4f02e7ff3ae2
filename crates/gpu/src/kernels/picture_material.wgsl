// Colours of surfaces by label and item.

struct Material {
    color: vec3f,
    // Diffuse transmittance: light from the other side of a leaf.
    transmitted: vec3f,
    gloss: f32,
    shininess: f32,
}

// Index in the noise's table after hashing one more coordinate.
fn step_to(h: u32, c: i32) -> u32 {
    let at = (h + bitcast<u32>(c)) & 0xffu;
    return table[NOISE_ORDER + at / 4u][at % 4u];
}

fn value_at(h: u32, c: i32) -> f32 {
    let at = step_to(h, c);
    return quad(NOISE_VALUES + at / 4u)[at % 4u];
}

// Trilinear value noise in [0, 1), one cell a unit.
fn noise(p: vec3f) -> f32 {
    let floors = floor(p);
    let t = clamp(p - floors, vec3f(0.0), vec3f(1.0));
    let s = t * t * (3.0 - 2.0 * t);
    let c = vec3i(floors);
    let x = vec2u(step_to(0u, c.x), step_to(0u, c.x + 1));
    let low = vec2u(step_to(x.x, c.y), step_to(x.y, c.y));
    let high = vec2u(step_to(x.x, c.y + 1), step_to(x.y, c.y + 1));
    let edges = vec4f((1.0 - s.x) * (1.0 - s.y), s.x * (1.0 - s.y), (1.0 - s.x) * s.y, s.x * s.y);
    let below = vec4f(value_at(low.x, c.z), value_at(low.y, c.z), value_at(high.x, c.z), value_at(high.y, c.z));
    let lower = dot(edges, below) * (1.0 - s.z);
    if s.z == 0.0 {
        return lower;
    }
    let above = vec4f(
        value_at(low.x, c.z + 1),
        value_at(low.y, c.z + 1),
        value_at(high.x, c.z + 1),
        value_at(high.y, c.z + 1),
    );
    return lower + dot(edges, above) * s.z;
}

// Sum of three octaves.
fn rough(p: vec3f) -> f32 {
    return (noise(p) + SECOND_WEIGHT * noise(p * SECOND_CELLS) + THIRD_WEIGHT * noise(p * THIRD_CELLS)) / OCTAVES;
}

fn blend(a: vec3f, b: vec3f, t: f32) -> vec3f {
    return a + (b - a) * clamp(t, 0.0, 1.0);
}

fn matt(color: vec3f) -> Material {
    return Material(color, vec3f(0.0), 0.0, 1.0);
}

// Apple skin: red over yellow-green, streaked from the stem.
fn apple(place: vec3f, ripeness: f32) -> Material {
    let local = normalize(place);
    let streaks = noise(local * SKIN_STREAKS + vec3f(0.0, 0.0, STREAK_SHIFT * ripeness));
    let cheek = noise(local * CHEEK_CELLS + CHEEK_SHIFT * ripeness);
    let red = blend(SKIN_DARK_RED, SKIN_RED, streaks);
    let blush = BLUSH_LEAST + BLUSH_RIPENESS * ripeness + BLUSH_CHEEK * (cheek - BLUSH_CHEEK_MEAN)
        + BLUSH_STREAKS * (streaks - 0.5);
    return Material(blend(SKIN_GROUND, red, blush), vec3f(0.0), SKIN_GLOSS, SKIN_SHININESS);
}

// Leaf: dark and slightly glossy above, paler below, translucent.
fn leaf(local: vec3f, age: f32, outer_side: bool) -> Material {
    let upper = blend(LEAF_YOUNG, LEAF_OLD, age);
    let color = select(upper * LEAF_BELOW_GAIN + LEAF_BELOW, upper, outer_side);
    let midrib = select(1.0, MIDRIB_GAIN, abs(local.y) < MIDRIB);
    return Material(color * midrib, LEAF_THROUGH, select(0.0, LEAF_GLOSS, outer_side), LEAF_SHININESS);
}

// Bark: grey-brown, cracked along the wood.
fn bark(local: vec3f, p_world: vec3f) -> Material {
    let streak = rough(local * BARK_CELLS);
    let patch_at = rough(p_world * PATCH_CELLS);
    let brown = blend(BARK_CRACK, BARK_RIDGE, BARK_CONTRAST * streak - BARK_DARK);
    return matt(blend(brown, BARK_PATCH, PATCH_CONTRAST * patch_at - PATCH_DARK));
}

// Ground: grass, and bare soil around the trunk.
fn ground(p_world: vec3f) -> Material {
    let p = vec3f(p_world.xy, 0.0);
    let broad = rough(p * BROAD_CELLS);
    let fine = rough(p * FINE_CELLS);
    let blades = noise(p * BLADE_CELLS);
    let tone = GRASS_LEAST + GRASS_FINE * fine + GRASS_BLADES * blades;
    let grass = blend(GRASS_DARK, GRASS_PALE, BROAD_CONTRAST * broad - BROAD_DARK) * tone;
    let soil = blend(SOIL_DARK, SOIL_PALE, SOIL_FINE * fine + SOIL_BLADES * blades);
    return matt(blend(grass, soil, BARE - BARE_FALL * length(p) + BARE_BROAD * (broad - BARE_BROAD_MEAN)));
}

fn material_of(s: Surface) -> Material {
    let head = table[s.item];
    let place = quad(s.item + 2u);
    let turn = quad(s.item + 1u);
    let own = quad(s.item + 3u);
    // In the item's frame.
    let local = turned(vec4f(-turn.xyz, turn.w), s.p_body - place.xyz);
    let variation = place.w;
    var m = matt(own.xyz);
    switch head.x {
        case FRUIT: { m = apple(local, variation); }
        case LEAF: { m = leaf(local, variation, s.outer_side); }
        case WOOD: { m = bark(local, s.p_world); }
        case ROBOT: { m = Material(own.xyz, vec3f(0.0), ROBOT_GLOSS, ROBOT_SHININESS); }
        case GROUND: { m = ground(s.p_world); }
        case SCENERY: {
            let grain = rough(local * GRAIN_CELLS);
            m = matt(blend(POST_DARK, POST_PALE, GRAIN_CONTRAST * grain - GRAIN_DARK));
        }
        default: {}
    }
    if head.y == 1u {
        m.color = own.xyz;
    }
    // Tints lie before the items.
    if head.z > 0u {
        let at = s.items - 3u * head.z;
        let tint = mat3x3f(quad(at).xyz, quad(at + 1u).xyz, quad(at + 2u).xyz);
        m.color = max(tint * m.color, vec3f(0.0));
        m.transmitted = max(tint * m.transmitted, vec3f(0.0));
    }
    return m;
}
