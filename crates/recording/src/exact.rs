//! Numbers in JSON that are read back with all their bits.
//!
//! The shortest digits that give a number back do so for finite ones. Others are the words that protobuf's JSON mapping
//! has for them; a NaN is one NaN.

use serde::de::{Deserializer, Error, Visitor};
use serde::{Deserialize, Serialize, Serializer};

/// A number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exact(pub f64);

const NAN: &str = "NaN";
const INFINITY: &str = "Infinity";
const MINUS_INFINITY: &str = "-Infinity";

impl Serialize for Exact {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            x if x.is_finite() => serializer.serialize_f64(x),
            x if x.is_nan() => serializer.serialize_str(NAN),
            x if x > 0.0 => serializer.serialize_str(INFINITY),
            _ => serializer.serialize_str(MINUS_INFINITY),
        }
    }
}

impl<'de> Deserialize<'de> for Exact {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Reads;
        impl Visitor<'_> for Reads {
            type Value = Exact;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "a number, {NAN}, {INFINITY} or {MINUS_INFINITY}")
            }

            fn visit_f64<E: Error>(self, x: f64) -> Result<Exact, E> {
                Ok(Exact(x))
            }

            fn visit_u64<E: Error>(self, x: u64) -> Result<Exact, E> {
                Ok(Exact(x as f64))
            }

            fn visit_i64<E: Error>(self, x: i64) -> Result<Exact, E> {
                Ok(Exact(x as f64))
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<Exact, E> {
                match word {
                    NAN => Ok(Exact(f64::NAN)),
                    INFINITY => Ok(Exact(f64::INFINITY)),
                    MINUS_INFINITY => Ok(Exact(f64::NEG_INFINITY)),
                    other => Err(E::invalid_value(serde::de::Unexpected::Str(other), &self)),
                }
            }
        }
        deserializer.deserialize_any(Reads)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_comes_back_with_its_bits() {
        let numbers =
            [0.0, -0.0, 1.0, 0.1, -1e-310, f64::MAX, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 1.0 / 3.0];
        for x in numbers {
            let text = serde_json::to_string(&Exact(x)).unwrap();
            let Exact(y) = serde_json::from_str(&text).unwrap();
            assert_eq!(x.to_bits(), y.to_bits(), "{text}");
        }
        assert_eq!(serde_json::from_str::<Exact>("3").unwrap().0, 3.0);
        assert_eq!(serde_json::from_str::<Exact>("-3").unwrap().0, -3.0);
        assert!(serde_json::from_str::<Exact>("\"nan\"").is_err());
    }
}
