//! TOML values that remember where reading stopped, for errors that name the field.
//!
//! `serde_path_to_error` does the same for every format, as a layer around each visitor. It is not used here because that layer is compiled anew for
//! every config struct: it was a fifth of the whole program.

use std::cell::RefCell;
use std::fmt;

use serde::de::value::StringDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error as _, IntoDeserializer, MapAccess, SeqAccess,
    Unexpected, VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;
use toml::{Table, Value};

type Error = toml::de::Error;

/// A step from a value to one in it.
#[derive(Debug, Clone)]
enum Step {
    Key(String),
    Index(usize),
}

/// Place of the value that is read; after an error, of the value that caused it. Displayed as `tree.limbs[2].length`, `.` at the top.
#[derive(Debug, Default)]
pub struct Path(RefCell<Vec<Step>>);

impl Path {
    /// Reads a value one step further in. After an error the path stays there.
    fn within<T>(&self, step: Step, read: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        self.0.borrow_mut().push(step);
        let value = read()?;
        self.0.borrow_mut().pop();
        Ok(value)
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let steps = self.0.borrow();
        if steps.is_empty() {
            return write!(f, ".");
        }
        for (i, step) in steps.iter().enumerate() {
            match step {
                Step::Index(index) => write!(f, "[{index}]")?,
                Step::Key(key) if i == 0 => write!(f, "{key}")?,
                Step::Key(key) => write!(f, ".{key}")?,
            }
        }
        Ok(())
    }
}

/// A value that is read along a path.
pub struct Tracked<'a> {
    value: Value,
    path: &'a Path,
}

impl<'a> Tracked<'a> {
    /// A whole document.
    pub fn new(table: Table, path: &'a Path) -> Self {
        Self { value: Value::Table(table), path }
    }
}

impl<'de> Deserializer<'de> for Tracked<'_> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        let path = self.path;
        match self.value {
            Value::Table(table) => {
                visitor.visit_map(Entries { left: table.into_iter(), current: None, path })
            }
            Value::Array(array) => visitor.visit_seq(Elements { left: array.into_iter().enumerate(), path }),
            Value::Boolean(value) => visitor.visit_bool(value),
            Value::Integer(value) => visitor.visit_i64(value),
            Value::Float(value) => visitor.visit_f64(value),
            Value::String(value) => visitor.visit_string(value),
            Value::Datetime(value) => visitor.visit_string(value.to_string()),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        let path = self.path;
        match self.value {
            Value::String(name) => visitor.visit_enum(Variant { name, content: None, path }),
            Value::Table(table) if table.len() == 1 => {
                let (name, content) = table.into_iter().next().unwrap_or_else(|| unreachable!("one entry"));
                visitor.visit_enum(Variant { name, content: Some(content), path })
            }
            Value::Table(_) => Err(Error::custom("expected a table with one entry, named as the variant")),
            other => {
                Err(Error::custom(format_args!("expected the name of a variant, found {}", other.type_str())))
            }
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple tuple_struct map
        struct identifier ignored_any
    }
}

struct Entries<'a> {
    left: toml::map::IntoIter<String, Value>,
    /// The entry whose key was read last.
    current: Option<(String, Value)>,
    path: &'a Path,
}

impl<'de> MapAccess<'de> for Entries<'_> {
    type Error = Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Error> {
        let Some((key, value)) = self.left.next() else { return Ok(None) };
        self.current = Some((key.clone(), value));
        let name: StringDeserializer<Error> = key.clone().into_deserializer();
        self.path.within(Step::Key(key), || seed.deserialize(name)).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Error> {
        let (key, value) =
            self.current.take().ok_or_else(|| Error::custom("a value was read before its key"))?;
        let path = self.path;
        path.within(Step::Key(key), || seed.deserialize(Tracked { value, path }))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.left.len())
    }
}

struct Elements<'a> {
    left: std::iter::Enumerate<std::vec::IntoIter<Value>>,
    path: &'a Path,
}

impl<'de> SeqAccess<'de> for Elements<'_> {
    type Error = Error;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Error> {
        let Some((index, value)) = self.left.next() else { return Ok(None) };
        let path = self.path;
        path.within(Step::Index(index), || seed.deserialize(Tracked { value, path })).map(Some)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.left.len())
    }
}

/// A variant of an enum: its name, or a table with its name and content.
struct Variant<'a> {
    name: String,
    content: Option<Value>,
    path: &'a Path,
}

impl<'a, 'de> EnumAccess<'de> for Variant<'a> {
    type Error = Error;
    type Variant = Content<'a>;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Content<'a>), Error> {
        let name: StringDeserializer<Error> = self.name.clone().into_deserializer();
        Ok((seed.deserialize(name)?, Content { name: self.name, value: self.content, path: self.path }))
    }
}

/// Content of an enum's variant.
struct Content<'a> {
    name: String,
    value: Option<Value>,
    path: &'a Path,
}

impl<'de> Content<'_> {
    fn read<T>(self, read: impl FnOnce(Self) -> Result<T, Error>) -> Result<T, Error> {
        let (path, name) = (self.path, self.name.clone());
        path.within(Step::Key(name), || read(self))
    }

    fn tracked(self, expected: &'static str) -> Result<impl Deserializer<'de, Error = Error>, Error> {
        let path = self.path;
        let value = self.value.ok_or_else(|| Error::invalid_type(Unexpected::UnitVariant, &expected))?;
        Ok(Tracked { value, path })
    }
}

impl<'de> VariantAccess<'de> for Content<'_> {
    type Error = Error;

    fn unit_variant(self) -> Result<(), Error> {
        match self.value {
            None => Ok(()),
            Some(_) => Err(Error::invalid_type(Unexpected::NewtypeVariant, &"unit variant")),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Error> {
        self.read(|content| seed.deserialize(content.tracked("newtype variant")?))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Error> {
        self.read(|content| content.tracked("tuple variant")?.deserialize_any(visitor))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        self.read(|content| content.tracked("struct variant")?.deserialize_any(visitor))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use serde::Deserialize;

    use super::*;

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Limb {
        length: f64,
        #[serde(default)]
        kind: Kind,
    }

    #[derive(Debug, PartialEq, Default, Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Kind {
        #[default]
        Spur,
        Bent(f64),
        Pair(u8, u8),
        Cut {
            at: f64,
        },
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(tag = "kind", rename_all = "snake_case")]
    enum Place {
        Stands,
        Slides { range: [f64; 2] },
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(untagged)]
    enum Either {
        Name(String),
        Count(u32),
    }

    #[derive(Debug, PartialEq, Deserialize)]
    struct Metres(f64);

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Doc {
        #[serde(default)]
        limbs: Vec<Limb>,
        height: Option<Metres>,
        place: Option<Place>,
        #[serde(default)]
        named: BTreeMap<String, Either>,
        planted: Option<String>,
    }

    /// Reads a text with our reader and with `serde_path_to_error`; an error is its place and its problem.
    fn both(text: &str) -> [Result<Doc, (String, String)>; 2] {
        let table: Table = text.parse().unwrap();
        let path = Path::default();
        let ours = Doc::deserialize(Tracked::new(table.clone(), &path))
            .map_err(|e| (path.to_string(), e.message().to_owned()));
        let theirs = serde_path_to_error::deserialize(table)
            .map_err(|e| (e.path().to_string(), e.inner().message().to_owned()));
        [ours, theirs]
    }

    #[test]
    fn documents_read_as_by_toml_itself() {
        for text in [
            "",
            "height = 2.5",
            "limbs = [{ length = 1.0 }, { length = 2, kind = 'spur' }]",
            "limbs = [{ length = 1.0, kind = { bent = 0.5 } }, { length = 1.0, kind = { pair = [1, 2] } }]",
            "limbs = [{ length = 1.0, kind = { cut = { at = 0.5 } } }]",
            "place = { kind = 'stands' }\n[named]\na = 'b'\nc = 3",
            "place = { kind = 'slides', range = [0, 1.5] }",
        ] {
            let [ours, theirs] = both(text);
            assert!(ours.is_ok(), "{text}: {ours:?}");
            assert_eq!(ours, theirs, "{text}");
        }
    }

    #[test]
    fn errors_have_the_place_and_words_of_serde_path_to_error() {
        for text in [
            "height = 'x'",
            "heigth = 1.0",
            "limbs = 3",
            "limbs = [{ length = 1.0 }, { length = true }]",
            "limbs = [{}]",
            "limbs = [{ length = 1.0, kind = 'long' }]",
            "limbs = [{ length = 1.0, kind = { bent = 'x' } }]",
            "limbs = [{ length = 1.0, kind = { cut = { at = 'x' } } }]",
            "place = { kind = 'slides' }",
            "place = { kind = 'slides', range = [0] }",
            "place = { kind = 'flies' }",
            "[named]\na = 1.5",
            "planted = [1]",
        ] {
            let [ours, theirs] = both(text);
            assert!(ours.is_err(), "{text}");
            assert_eq!(ours, theirs, "{text}");
        }
        // Where TOML's own reader speaks of its internals, ours has plainer words.
        for text in [
            "limbs = [{ length = 1.0, kind = 'bent' }]",
            "limbs = [{ length = 1.0, kind = { spur = 1 } }]",
            "limbs = [{ length = 1.0, kind = {} }]",
            "limbs = [{ length = 1.0, kind = 7 }]",
            "limbs = [{ length = 1.0, kind = { pair = [1] } }]",
        ] {
            let [ours, theirs] = both(text);
            assert!(ours.unwrap_err().0.starts_with("limbs[0].kind"), "{text}");
            assert!(theirs.is_err(), "{text}");
        }
    }
}
