//! The envelope of a save file: magic, format version, length, checksum. All numbers are little-endian.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | [`MAGIC`] |
//! | 4 | format version |
//! | 8 | length n of the body |
//! | n | body |
//! | 32 | SHA-256 of everything before |

use crate::snapshot_error::SnapshotError;
use sha2::{Digest, Sha256};

/// First bytes of a file. The odd first one and the line ending show a file that went through a text filter.
const MAGIC: [u8; 8] = *b"\x8ftree\r\n\0";

/// Version of the format that this code writes, and the only one that it reads: a change of a snapshot's
/// fields, or of their meaning, raises it.
pub const FORMAT_VERSION: u32 = 8;

const HEADER: usize = MAGIC.len() + size_of::<u32>() + size_of::<u64>();
const CHECKSUM: usize = 32;

/// Wraps a body.
pub(crate) fn seal(body: &[u8]) -> Vec<u8> {
    let mut file = Vec::with_capacity(HEADER + body.len() + CHECKSUM);
    file.extend_from_slice(&MAGIC);
    file.extend_from_slice(&FORMAT_VERSION.to_le_bytes());
    file.extend_from_slice(&(body.len() as u64).to_le_bytes());
    file.extend_from_slice(body);
    let checksum = Sha256::digest(&file);
    file.extend_from_slice(&checksum);
    file
}

/// Checks a file and returns its body.
pub(crate) fn open(file: &[u8]) -> Result<&[u8], SnapshotError> {
    let magic_there = file.len().min(MAGIC.len());
    if file.is_empty() || file[..magic_there] != MAGIC[..magic_there] {
        return Err(SnapshotError::NotASnapshot);
    }
    let found = file.len() as u64;
    let cut_off = |expected| Err(SnapshotError::CutOff { expected, found });
    let Some((header, rest)) = file.split_first_chunk::<HEADER>() else { return cut_off(HEADER as u64) };
    let (_, version, length) = split(header);
    if version != FORMAT_VERSION {
        return Err(SnapshotError::Version { found: version, known: FORMAT_VERSION });
    }
    let expected = length.saturating_add((HEADER + CHECKSUM) as u64);
    match found.cmp(&expected) {
        std::cmp::Ordering::Less => return cut_off(expected),
        std::cmp::Ordering::Greater => return Err(SnapshotError::Surplus { expected, found }),
        std::cmp::Ordering::Equal => {}
    }
    let (body, checksum) = rest.split_at(rest.len() - CHECKSUM);
    if Sha256::digest(&file[..file.len() - CHECKSUM]).as_slice() != checksum {
        return Err(SnapshotError::Damaged);
    }
    Ok(body)
}

/// Magic, version and length.
fn split(header: &[u8; HEADER]) -> ([u8; 8], u32, u64) {
    let (mut magic, mut version, mut length) = ([0; 8], [0; 4], [0; 8]);
    magic.copy_from_slice(&header[..8]);
    version.copy_from_slice(&header[8..12]);
    length.copy_from_slice(&header[12..]);
    (magic, u32::from_le_bytes(version), u64::from_le_bytes(length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_comes_back() {
        for body in [&b""[..], b"x", &[7; 1000]] {
            assert_eq!(open(&seal(body)), Ok(body));
        }
    }

    #[test]
    fn each_fault_has_its_name() {
        let file = seal(b"body");
        let whole = file.len() as u64;
        assert_eq!(open(b""), Err(SnapshotError::NotASnapshot));
        assert_eq!(open(b"PK"), Err(SnapshotError::NotASnapshot));
        assert_eq!(open(&[b"PK", &file[..]].concat()), Err(SnapshotError::NotASnapshot));
        assert_eq!(open(&file[..5]), Err(SnapshotError::CutOff { expected: HEADER as u64, found: 5 }));
        assert_eq!(
            open(&file[..file.len() - 1]),
            Err(SnapshotError::CutOff { expected: whole, found: whole - 1 })
        );
        assert_eq!(
            open(&[&file[..], b"\n"].concat()),
            Err(SnapshotError::Surplus { expected: whole, found: whole + 1 })
        );
        let with = |at: usize, byte: u8| {
            let mut file = file.clone();
            file[at] = byte;
            open(&file).map(<[u8]>::to_vec)
        };
        for found in [FORMAT_VERSION - 1, FORMAT_VERSION + 1] {
            assert_eq!(with(8, found as u8), Err(SnapshotError::Version { found, known: FORMAT_VERSION }));
        }
        assert_eq!(with(19, 0xff).map_err(|e| matches!(e, SnapshotError::CutOff { .. })), Err(true));
        assert_eq!(with(21, b'B'), Err(SnapshotError::Damaged));
        assert_eq!(with(file.len() - 1, file[file.len() - 1] ^ 1), Err(SnapshotError::Damaged));
    }
}
