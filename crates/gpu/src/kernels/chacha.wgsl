// The random streams of the axes. Twin: `twin/chacha.rs`, which explains the functions.

// Sixteen words in four rows.
struct Block {
    a: vec4u,
    b: vec4u,
    c: vec4u,
    d: vec4u,
}

// A random stream: the table entry with its key, its number, and how many pairs of words it has given.
struct Stream {
    entry: u32,
    number: u32,
    given: u32,
    block: Block,
}

const SIGMA: vec4u = vec4u(0x61707865u, 0x3320646eu, 0x79622d32u, 0x6b206574u);
const DOUBLE_ROUNDS: u32 = 4u;
const PAIRS_EACH: u32 = 8u;

fn rotated(x: vec4u, bits: u32) -> vec4u {
    return (x << vec4u(bits)) | (x >> vec4u(32u - bits));
}

fn quarter_rounds(x: Block) -> Block {
    var a = x.a + x.b;
    var d = rotated(x.d ^ a, 16u);
    var c = x.c + d;
    var b = rotated(x.b ^ c, 12u);
    a += b;
    d = rotated(d ^ a, 8u);
    c += d;
    b = rotated(b ^ c, 7u);
    return Block(a, b, c, d);
}

fn block_of(entry: u32, counter: u32, number: u32) -> Block {
    let key_a = table[entry];
    let key_b = table[entry + 1u];
    let last = vec4u(counter, 0u, number, 0u);
    var x = Block(SIGMA, key_a, key_b, last);
    for (var k = 0u; k < DOUBLE_ROUNDS; k++) {
        x = quarter_rounds(x);
        x = quarter_rounds(Block(x.a, x.b.yzwx, x.c.zwxy, x.d.wxyz));
        x = Block(x.a, x.b.wxyz, x.c.zwxy, x.d.yzwx);
    }
    return Block(x.a + SIGMA, x.b + key_a, x.c + key_b, x.d + last);
}

fn stream_of(axis: u32) -> Stream {
    let entry = dial_at(axis);
    let by_episode = table[entry + DIAL_BY_EPISODE / QUAD].w != 0u;
    let world_number = tile_number * LANES + lane;
    let number = select(world_number, table[BASE_EPISODE / QUAD].y, by_episode);
    return Stream(entry, number, 0u, Block(vec4u(0u), vec4u(0u), vec4u(0u), vec4u(0u)));
}

fn next_pair(stream: ptr<function, Stream>) -> vec2u {
    let given = (*stream).given;
    let pair = given % PAIRS_EACH;
    if pair == 0u {
        (*stream).block = block_of((*stream).entry, given / PAIRS_EACH, (*stream).number);
    }
    (*stream).given = given + 1u;
    var row = (*stream).block.a;
    switch pair / 2u {
        case 1u: { row = (*stream).block.b; }
        case 2u: { row = (*stream).block.c; }
        case 3u: { row = (*stream).block.d; }
        default: {}
    }
    return select(row.xy, row.zw, (pair & 1u) != 0u);
}
