//! ChaCha8 (Bernstein 2008) in the layout of `rand_chacha`: the block counter in words 12 and 13, the number of the stream in words 14 and 15. No stream here is
//! longer than 2^32 blocks, and no stream's number longer than 32 bits.

use super::Lane;
use crate::layout::{LANES, QUAD, base, dial};

/// A row of a block.
pub(super) type Row = [u32; 4];

/// Sixteen words in four rows: constants, key (2), counter and number.
type Block = [Row; 4];

/// A random stream.
#[derive(Clone, Copy)]
pub(super) struct Stream {
    /// First quad of its axis's entry in the table, which begins with the key.
    pub entry: usize,
    pub number: u32,
    /// Number of pairs of words drawn so far.
    pub given: u32,
    block: Block,
}

/// Constants of ChaCha: "expand 32-byte k".
const SIGMA: Row = [0x6170_7865, 0x3320_646e, 0x7962_2d32, 0x6b20_6574];
/// Number of double rounds of ChaCha8.
const DOUBLE_ROUNDS: u32 = 4;
/// Number of pairs of words in a block.
const PAIRS_EACH: u32 = 8;

fn rotated(x: Row, bits: u32) -> Row {
    x.map(|word| word.rotate_left(bits))
}

/// Quarter rounds of all four columns.
fn quarter_rounds([a, b, c, d]: Block) -> Block {
    let sum = |x: Row, y: Row| std::array::from_fn(|k| x[k].wrapping_add(y[k]));
    let differ = |x: Row, y: Row| std::array::from_fn(|k| x[k] ^ y[k]);
    let a = sum(a, b);
    let d = rotated(differ(d, a), 16);
    let c = sum(c, d);
    let b = rotated(differ(b, c), 12);
    let a = sum(a, b);
    let d = rotated(differ(d, a), 8);
    let c = sum(c, d);
    let b = rotated(differ(b, c), 7);
    [a, b, c, d]
}

impl Lane<'_> {
    fn block_of(&self, entry: usize, counter: u32, number: u32) -> Block {
        // The words of a row from the k-th on.
        let from = |x: Row, k: usize| std::array::from_fn(|i| x[(i + k) % 4]);
        let (key_a, key_b) = (self.memory.table[entry], self.memory.table[entry + 1]);
        let start = [SIGMA, key_a, key_b, [counter, 0, number, 0]];
        let mut x = start;
        for _ in 0..DOUBLE_ROUNDS {
            let [a, b, c, d] = quarter_rounds(x);
            let [a, b, c, d] = quarter_rounds([a, from(b, 1), from(c, 2), from(d, 3)]);
            x = [a, from(b, 3), from(c, 2), from(d, 1)];
        }
        std::array::from_fn(|row| std::array::from_fn(|k| x[row][k].wrapping_add(start[row][k])))
    }

    /// Stream of an axis, as in `Mode::stream`.
    pub(super) fn stream_of(&self, axis: usize) -> Stream {
        let entry = self.dial_at(axis);
        let by_episode = self.memory.table[entry + dial::BY_EPISODE / QUAD][dial::BY_EPISODE % QUAD] != 0;
        let world = (self.number * LANES + self.lane) as u32;
        let number = if by_episode { self.memory.table[0][base::EPISODE] } else { world };
        Stream { entry, number, given: 0, block: Block::default() }
    }

    /// The next 64 bits, lower half first.
    pub(super) fn next_pair(&self, stream: &mut Stream) -> [u32; 2] {
        let pair = stream.given % PAIRS_EACH;
        if pair == 0 {
            stream.block = self.block_of(stream.entry, stream.given / PAIRS_EACH, stream.number);
        }
        stream.given += 1;
        let row = stream.block[pair as usize / 2];
        if pair & 1 == 0 { [row[0], row[1]] } else { [row[2], row[3]] }
    }
}
