//! A part of a run, for splitting the work over machines.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Part i of n of a run's records: every n-th, beginning with the i-th.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Shard {
    /// Number of the part, from 1.
    index: u32,
    /// Number of parts.
    of: u32,
}

/// Most parts: a job array has no more.
const MOST: u32 = 1_000_000;

impl Shard {
    /// The whole run.
    pub const WHOLE: Self = Self { index: 1, of: 1 };

    /// True for the whole run.
    pub fn is_whole(self) -> bool {
        self.of == 1
    }

    /// True if the record with this index in the plan, from 0, belongs to the part.
    pub fn holds(self, place: usize) -> bool {
        place % self.of as usize == (self.index - 1) as usize
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse::<u32>().ok();
        match text.split_once('/').map(|(index, of)| (number(index), number(of))) {
            Some((Some(index), Some(of))) if (1..=MOST).contains(&of) && (1..=of).contains(&index) => {
                Ok(Self { index, of })
            }
            _ => Err(format!("'{text}' must be I/N with whole numbers 1 <= I <= N <= {MOST}")),
        }
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> Self {
        shard.to_string()
    }
}

impl TryFrom<String> for Shard {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_the_places() {
        let parts: Vec<Shard> = (1..=3).map(|i| format!("{i}/3").parse().unwrap()).collect();
        for place in 0..10 {
            assert_eq!(parts.iter().filter(|part| part.holds(place)).count(), 1, "{place}");
        }
        assert!((0..10).all(|place| Shard::WHOLE.holds(place)));
        assert_eq!((parts[1].holds(1), parts[1].holds(4), parts[1].holds(2)), (true, true, false));
    }

    #[test]
    fn what_is_no_part() {
        for text in ["", "3", "0/3", "4/3", "1/0", "-1/3", "1/3/5", "a/b", "1/9999999"] {
            let e = text.parse::<Shard>().unwrap_err();
            assert!(e.starts_with(&format!("'{text}' must be I/N")), "{e}");
        }
        assert_eq!(" 2 / 8".parse::<Shard>().unwrap().to_string(), "2/8");
    }
}
