//! Checksum of a JSON result file: its second line, SHA-256 over all other bytes.
//!
//! `sed 2d FILE | sha256sum` gives the same digits. A checksum finds damage and careless edits. It is no signature: whoever
//! changes a file on purpose can also write a new checksum.

use std::io;

use serde::Serialize;

use crate::digest::sha256;

/// Name of the checksum's field.
pub const FIELD: &str = "checksum";

/// Beginning of every JSON object that is written with indentation.
const OPEN: &[u8] = b"{\n";
/// The checksum's line is `BEFORE`, 64 hexadecimal digits, `AFTER`.
const BEFORE: &[u8] = b"  \"checksum\": \"";
const AFTER: &[u8] = b"\",\n";
const DIGITS: usize = 64;

/// A result file that cannot be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Damage {
    /// The second line is no checksum.
    #[error("has no checksum")]
    NoChecksum,
    /// The checksum is not that of the other bytes.
    #[error("does not match its checksum: it is damaged or was edited")]
    WrongChecksum,
}

/// Returns the bytes of a JSON result file: indented, its checksum on the second line, with a final newline.
///
/// # Errors
/// The value has no form as a JSON object with fields.
pub fn encode(value: &impl Serialize) -> io::Result<Vec<u8>> {
    with_checksum(&encode_plain(value)?)
}

/// Adds the checksum to the content of a result file.
///
/// # Errors
/// The content is no indented JSON object with fields.
pub fn with_checksum(content: &[u8]) -> io::Result<Vec<u8>> {
    let Some(fields) = content.strip_prefix(OPEN) else {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "a result file is an object with fields"));
    };
    Ok([OPEN, BEFORE, sha256(content).as_bytes(), AFTER, fields].concat())
}

/// Returns the bytes of a JSON file without a checksum: indented, with a final newline.
///
/// # Errors
/// The value has no form as JSON.
pub fn encode_plain(value: &impl Serialize) -> io::Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// Returns the content of a result file, without its checksum.
///
/// # Errors
/// The file has no checksum, or a wrong one.
pub fn checked(bytes: &[u8]) -> Result<Vec<u8>, Damage> {
    let rest = bytes.strip_prefix(OPEN).and_then(|rest| rest.strip_prefix(BEFORE));
    let (found, rest) = rest.and_then(|rest| rest.split_at_checked(DIGITS)).ok_or(Damage::NoChecksum)?;
    let fields = rest.strip_prefix(AFTER).ok_or(Damage::NoChecksum)?;
    let content = [OPEN, fields].concat();
    if sha256(&content).as_bytes() == found { Ok(content) } else { Err(Damage::WrongChecksum) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::record;

    #[test]
    fn the_checksum_covers_every_other_byte() {
        let bytes = encode(&record(0)).unwrap();
        let content = encode_plain(&record(0)).unwrap();
        assert_eq!(checked(&bytes).unwrap(), content);
        for place in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[place] ^= 1;
            assert!(checked(&changed).is_err(), "byte {place}");
            assert!(checked(&bytes[..place]).is_err(), "cut at {place}");
        }
        assert_eq!(checked(&content), Err(Damage::NoChecksum));
        assert_eq!(checked(b""), Err(Damage::NoChecksum));
        assert!(encode(&[1, 2]).is_err());
    }

    #[test]
    fn the_second_line_is_the_hash_of_the_others() {
        #[derive(Serialize)]
        struct One {
            a: u32,
        }
        // printf '{\n  "a": 1\n}\n' | sha256sum
        let hash = "5e36b6560513586ced65eca0e8b025fe88edbcab82ba2cb67a5fcb2d7b202383";
        let text = String::from_utf8(encode(&One { a: 1 }).unwrap()).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 4);
        assert_eq!(lines[1], format!("  \"checksum\": \"{hash}\","));
    }
}
