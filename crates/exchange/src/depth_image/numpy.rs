//! Depth images as NumPy arrays, by the format's specification (NEP 1): a header that is a Python dictionary, then the values.

use std::io::{Cursor, Read};

use zip::ZipArchive;

use super::{DepthError, RawDepth, Values, check_size};
use crate::intrinsics::MOST_PIXELS;

const ARRAY: &str = ".npy array";
const ARCHIVE: &str = ".npz archive";

/// Longest header \[bytes\]; NumPy itself reads 10,000 letters.
const LONGEST_HEADER: usize = 10_000;

/// Reads an array of two axes, rows and columns; axes of length 1 before or after them are left out.
pub(super) fn read_array(bytes: &[u8]) -> Result<RawDepth, DepthError> {
    let (header, data) = parted(bytes)?;
    let Header { kind, columns_first, shape } = Header::read(header)?;
    let mut axes: Vec<usize> = shape.clone();
    while axes.len() > 2 && axes.last() == Some(&1) {
        axes.pop();
    }
    while axes.len() > 2 && axes[0] == 1 {
        axes.remove(0);
    }
    let &[height, width] = axes.as_slice() else {
        let found = format!("shape {shape:?}");
        return Err(DepthError::Kind { format: ARRAY, found, wanted: "two axes, rows and columns," });
    };
    check_size(width, height)?;
    let n = width * height;
    let values = kind.values(data, n)?;
    let values = if columns_first { values.transposed(width, height) } else { values };
    RawDepth::new(width, height, values)
}

/// Reads the array named `depth` of an archive, or the only one.
pub(super) fn read_archive(bytes: &[u8]) -> Result<RawDepth, DepthError> {
    let damaged = |problem: String| DepthError::Damaged { format: ARCHIVE, problem };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(e.to_string()))?;
    let names: Result<Vec<String>, _> =
        archive.file_names().map(|name| name.map(|name| name.into_owned())).collect();
    let names = names.map_err(|e| damaged(e.to_string()))?;
    let chosen = match names.as_slice() {
        [only] => only,
        several => several.iter().find(|name| name.trim_end_matches(".npy") == "depth").ok_or_else(|| {
            let found = format!("the arrays {}", names.join(", "));
            DepthError::Kind { format: ARCHIVE, found, wanted: "one array, or one named depth," }
        })?,
    };
    let file = archive.by_name(chosen).map_err(|e| damaged(e.to_string()))?;
    let most = (MOST_PIXELS * size_of::<f64>() + LONGEST_HEADER) as u64;
    let mut array = Vec::new();
    // The stated size of a packed file can be wrong.
    file.take(most + 1).read_to_end(&mut array).map_err(|e| damaged(e.to_string()))?;
    if array.len() as u64 > most {
        return Err(damaged(format!("{chosen} has more than {most} bytes")));
    }
    read_array(&array)
}

/// Header and data of a file.
fn parted(bytes: &[u8]) -> Result<(&str, &[u8]), DepthError> {
    let cut = || damaged("it ends within its header");
    let version = *bytes.get(6).ok_or_else(cut)?;
    let (length, start) = match version {
        1 => (usize::from(u16::from_le_bytes(array(bytes, 8).ok_or_else(cut)?)), 10),
        _ => (u32::from_le_bytes(array(bytes, 8).ok_or_else(cut)?) as usize, 12),
    };
    if length > LONGEST_HEADER {
        return Err(damaged(&format!("its header has {length} bytes; at most {LONGEST_HEADER} are read")));
    }
    let header = bytes.get(start..start + length).ok_or_else(cut)?;
    let text = std::str::from_utf8(header).map_err(|_| damaged("its header is not text"))?;
    Ok((text, &bytes[start + length..]))
}

fn array<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at + N)?.try_into().ok()
}

fn damaged(problem: &str) -> DepthError {
    DepthError::Damaged { format: ARRAY, problem: problem.into() }
}

/// Content of a header.
struct Header {
    kind: Kind,
    /// True if the values go down the columns (`fortran_order`).
    columns_first: bool,
    shape: Vec<usize>,
}

impl Header {
    fn read(text: &str) -> Result<Self, DepthError> {
        let field = |name: &str| {
            let quoted = [format!("'{name}'"), format!("\"{name}\"")];
            let after = quoted.iter().find_map(|key| text.split_once(key.as_str()));
            let value = after.and_then(|(_, rest)| rest.trim_start().strip_prefix(':'));
            value.map(str::trim_start).ok_or_else(|| damaged(&format!("its header has no field {name}")))
        };
        let descr = field("descr")?;
        let quote = descr.chars().next().filter(|c| matches!(c, '\'' | '"'));
        let letters = quote.and_then(|quote| descr[1..].split_once(quote)).map(|(letters, _)| letters);
        let odd = || {
            let found = format!("descr {}", descr.chars().take(40).collect::<String>());
            DepthError::Kind { format: ARRAY, found, wanted: Kind::WANTED }
        };
        let kind = letters.and_then(Kind::of).ok_or_else(odd)?;
        let columns_first = field("fortran_order")?.starts_with("True");
        let shape = field("shape")?;
        let inside = shape.strip_prefix('(').and_then(|rest| rest.split_once(')')).map(|(inside, _)| inside);
        let lengths = inside.unwrap_or("?").split(',').map(str::trim).filter(|length| !length.is_empty());
        let shape: Result<Vec<usize>, _> = lengths.map(str::parse).collect();
        Ok(Self { kind, columns_first, shape: shape.map_err(|_| damaged("its shape cannot be read"))? })
    }
}

/// Kind of number.
struct Kind {
    big_endian: bool,
    letter: char,
    bytes: usize,
}

impl Kind {
    const WANTED: &str = "whole numbers of 8 to 64 bits or floating-point numbers of 32 or 64 bits";

    fn of(descr: &str) -> Option<Self> {
        let (order, rest) = descr.split_at_checked(1)?;
        let (letter, bytes) = rest.split_at_checked(1)?;
        let kind = Self {
            big_endian: match order {
                "<" | "|" | "=" => false,
                ">" => true,
                _ => return None,
            },
            letter: letter.chars().next()?,
            bytes: bytes.parse().ok()?,
        };
        matches!((kind.letter, kind.bytes), ('u' | 'i', 1 | 2 | 4 | 8) | ('f', 4 | 8)).then_some(kind)
    }

    fn values(&self, data: &[u8], n: usize) -> Result<Values, DepthError> {
        let cut = || damaged("it has fewer values than its shape states");
        let data = data.get(..n * self.bytes).ok_or_else(cut)?;
        Ok(match (self.letter, self.bytes) {
            ('u', 2) => Values::Short(self.numbers(data, u16::from_le_bytes)),
            ('f', 4) => Values::Single(self.numbers(data, f32::from_le_bytes)),
            ('f', _) => Values::Double(self.numbers(data, f64::from_le_bytes)),
            ('u', 1) => Values::Short(data.iter().map(|&value| u16::from(value)).collect()),
            ('u', 4) => Values::Whole(self.numbers(data, |b| f64::from(u32::from_le_bytes(b)))),
            ('u', _) => Values::Whole(self.numbers(data, |b| u64::from_le_bytes(b) as f64)),
            ('i', 1) => Values::Whole(self.numbers(data, |b| f64::from(i8::from_le_bytes(b)))),
            ('i', 2) => Values::Whole(self.numbers(data, |b| f64::from(i16::from_le_bytes(b)))),
            ('i', 4) => Values::Whole(self.numbers(data, |b| f64::from(i32::from_le_bytes(b)))),
            _ => Values::Whole(self.numbers(data, |b| i64::from_le_bytes(b) as f64)),
        })
    }

    fn numbers<const N: usize, T>(&self, data: &[u8], of: impl Fn([u8; N]) -> T) -> Vec<T> {
        let ordered = |bytes: &[u8; N]| {
            let mut bytes = *bytes;
            if self.big_endian {
                bytes.reverse();
            }
            of(bytes)
        };
        data.as_chunks::<N>().0.iter().map(ordered).collect()
    }
}

impl Values {
    /// Values that went down the columns, row by row.
    fn transposed(self, width: usize, height: usize) -> Self {
        fn rows<T: Copy>(values: &[T], width: usize, height: usize) -> Vec<T> {
            (0..width * height).map(|i| values[i % width * height + i / width]).collect()
        }
        match self {
            Values::Short(values) => Values::Short(rows(&values, width, height)),
            Values::Whole(values) => Values::Whole(rows(&values, width, height)),
            Values::Single(values) => Values::Single(rows(&values, width, height)),
            Values::Double(values) => Values::Double(rows(&values, width, height)),
        }
    }
}
