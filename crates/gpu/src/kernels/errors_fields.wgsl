// Random fields over an image: bytes of a ChaCha stream, and their sums over windows.

// Random words of an image, a thread a block.
@compute @workgroup_size(WHITE_THREADS)
fn white(@builtin(global_invocation_id) id: vec3u) {
    let total = law.white.w;
    if id.x * BLOCK_WORDS >= total {
        return;
    }
    let shot = &shots[id.y];
    let start = Block(SIGMA, (*shot).key_a, (*shot).key_b, vec4u(id.x, 0u, (*shot).number));
    var x = start;
    for (var k = 0u; k < DOUBLE_ROUNDS; k++) {
        x = quarter_rounds(x);
        x = quarter_rounds(Block(x.a, x.b.yzwx, x.c.zwxy, x.d.wxyz));
        x = Block(x.a, x.b.wxyz, x.c.zwxy, x.d.yzwx);
    }
    // The memory has room for whole blocks.
    let at = (id.y * law.words + id.x * BLOCK_WORDS) / 4u;
    quads[at] = x.a + start.a;
    quads[at + 1u] = x.b + start.b;
    quads[at + 2u] = x.c + start.c;
    quads[at + 3u] = x.d + start.d;
}

// Four bytes of a field from byte `at` on, in pairs: the first and third, the second and fourth.
fn bytes_at(field: u32, at: u32) -> vec2u {
    let word = field + at / 4u;
    let bits = 8u * (at % 4u);
    var four = quads[word / 4u][word % 4u] >> bits;
    if bits > 0u {
        let next = word + 1u;
        four |= quads[next / 4u][next % 4u] << (32u - bits);
    }
    return vec2u(four & 0xff00ffu, (four >> 8u) & 0xff00ffu);
}

// Words of a row of sums: whole quads.
fn stride_of(wide: u32) -> u32 {
    return (wide + 3u) & ~3u;
}

// Sums of bytes down the columns of windows, of four columns at once, marching down some rows. The sums of two columns share a word; each has 16 bits at most, whatever
// the differences on the way.
@compute @workgroup_size(DOWN_THREADS)
fn down(@builtin(global_invocation_id) id: vec3u, @builtin(workgroup_id) group: vec3u) {
    const SPAN: u32 = 2u * RADIUS + 1u;
    let averages = select(LATER_AVERAGES, 1u, group.z == 0u);
    let wide = law.size.x + 2u * RADIUS * averages;
    let blocks = (wide + 4u * DOWN_THREADS - 1u) / (4u * DOWN_THREADS);
    let first_column = 4u * (id.x - group.x / blocks * blocks * DOWN_THREADS);
    let first_row = group.x / blocks * DOWN_ROWS;
    if first_column >= wide || first_row >= law.size.y {
        return;
    }
    let base = group.y * law.words;
    let field = base + law.white[group.z];
    let out = (base + law.down[group.z] + first_column) / 4u;
    let stride = stride_of(wide) / 4u;
    let last_row = min(first_row + DOWN_ROWS, law.size.y);
    var at = first_row * wide + first_column;
    // Sums over a span, over the next one, and over both with weights 1, 2 .. 2, 1.
    var here = vec2u(0u);
    var next = vec2u(0u);
    var both = vec2u(0u);
    for (var k = 0u; k < SPAN; k++) {
        let x = bytes_at(field, at + k * wide);
        here += x;
        both += (k + 1u) * x;
    }
    if averages == 2u {
        for (var k = 1u; k < SPAN; k++) {
            let x = bytes_at(field, at + (SPAN - 1u + k) * wide);
            next += x;
            both += (SPAN - k) * x;
        }
        // The next span ends a row below.
        next += bytes_at(field, at + (2u * SPAN - 1u) * wide);
    }
    for (var row = first_row; row < last_row; row++) {
        let sums = select(both, here, averages == 1u);
        // Columns beyond the last are not read.
        quads[out + row * stride] = vec4u(sums & vec2u(0xffffu), sums >> vec2u(16u));
        let first = bytes_at(field, at);
        let middle = bytes_at(field, at + SPAN * wide);
        if averages == 2u {
            both += next - here;
            next += bytes_at(field, at + 2u * SPAN * wide) - middle;
        }
        here += middle - first;
        at += wide;
    }
}

// Value of a field that is averaged once, from the sums of columns.
fn noise_at(base: u32, first: u32, u: u32, v: u32) -> f32 {
    let at = base + first + v * stride_of(law.size.x + 2u * RADIUS) + u;
    var sum = 0u;
    for (var k = 0u; k <= 2u * RADIUS; k++) {
        sum += memory[at + k];
    }
    return f32(2 * i32(sum) - law.noise_centre) * law.noise_scale;
}

// Value of a field that is averaged twice.
fn shift_at(base: u32, first: u32, u: u32, v: u32) -> f32 {
    let at = base + first + v * stride_of(law.size.x + 4u * RADIUS) + u;
    var sum = 0u;
    for (var k = 0u; k <= 4u * RADIUS; k++) {
        sum += min(k + 1u, 4u * RADIUS + 1u - k) * memory[at + k];
    }
    return f32(2 * i32(sum) - law.shift_centre) * law.shift_scale;
}
