//! Cases made from a valid file: a few edits, so that most of the file can still be read.

use arbitrary::{Arbitrary, Unstructured};

#[derive(Debug)]
enum Edit {
    /// Overwrites bytes.
    Set { at: u32, bytes: Vec<u8> },
    /// Inserts bytes.
    Insert { at: u32, bytes: Vec<u8> },
    /// Removes bytes.
    Remove { at: u32, length: u16 },
    /// Repeats bytes.
    Repeat { at: u32, length: u16, times: u8 },
    /// Puts a value in the place of the next number.
    Number { at: u32, value: u8 },
}

// By hand: the derive macro would switch on features of a macro parser that all builds here share, and all would be compiled again.
impl<'a> Arbitrary<'a> for Edit {
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let (kind, at): (u8, u32) = u.arbitrary()?;
        Ok(match kind % 5 {
            0 => Self::Set { at, bytes: u.arbitrary()? },
            1 => Self::Insert { at, bytes: u.arbitrary()? },
            2 => Self::Remove { at, length: u.arbitrary()? },
            3 => Self::Repeat { at, length: u.arbitrary()?, times: u.arbitrary()? },
            _ => Self::Number { at, value: u.arbitrary()? },
        })
    }
}

/// Values at the ends of ranges.
const VALUES: [&str; 16] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "9007199254740993",
    "NaN",
    "inf",
    "null",
    "[]",
    "{}",
    "\"a\\u001b[2J\"",
    "true",
];
/// Longest result \[bytes\].
const LONGEST: usize = 1 << 20;

/// A case: the bytes themselves, or edits of a valid file, as the first byte says.
pub fn case(valid: &[u8], bytes: &[u8]) -> Vec<u8> {
    match bytes.split_first() {
        Some((choice, rest)) if choice % 2 == 1 => edited(valid, rest),
        Some((_, rest)) => rest.to_vec(),
        None => valid.to_vec(),
    }
}

/// A valid file after edits.
pub fn edited(valid: &[u8], bytes: &[u8]) -> Vec<u8> {
    let mut file = valid.to_vec();
    for edit in Vec::<Edit>::arbitrary_take_rest(Unstructured::new(bytes)).unwrap_or_default() {
        apply(&mut file, &edit);
    }
    file.truncate(LONGEST);
    file
}

fn apply(file: &mut Vec<u8>, edit: &Edit) {
    let place = |at: u32| at as usize % (file.len() + 1);
    let end = |at: usize, length: u16| (at + usize::from(length)).min(file.len());
    match edit {
        Edit::Set { at, bytes } => {
            let at = place(*at);
            let end = (at + bytes.len()).min(file.len());
            file.splice(at..end, bytes.iter().copied());
        }
        Edit::Insert { at, bytes } => {
            let at = place(*at);
            file.splice(at..at, bytes.iter().copied());
        }
        Edit::Remove { at, length } => {
            let at = place(*at);
            let end = end(at, *length);
            file.drain(at..end);
        }
        Edit::Repeat { at, length, times } => {
            let at = place(*at);
            let piece = file[at..end(at, *length)].repeat(usize::from(*times));
            if file.len() + piece.len() <= LONGEST {
                file.splice(at..at, piece);
            }
        }
        Edit::Number { at, value } => {
            let Some(digit) = file[place(*at)..].iter().position(u8::is_ascii_digit) else { return };
            let first = place(*at) + digit;
            let is_number = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'e' | b'-' | b'+');
            let length = file[first..].iter().take_while(|b| is_number(b)).count();
            let value = VALUES[usize::from(*value) % VALUES.len()];
            file.splice(first..first + length, value.bytes());
        }
    }
}
