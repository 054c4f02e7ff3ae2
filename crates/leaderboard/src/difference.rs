//! First difference between two JSON values.

use serde_json::Value;

/// The first place where two values differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Field, as `conditions.nominal.episodes[3].fruit`; empty for the whole.
    pub field: String,
    /// Content found.
    pub found: String,
    /// Expected content.
    pub expected: String,
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let field = if self.field.is_empty() { "the document" } else { &self.field };
        write!(f, "{field} is {}, not {}", self.found, self.expected)
    }
}

/// Returns the first difference of two values, fields in the order of their names; `None` if they are equal.
pub fn first_difference(found: &Value, expected: &Value) -> Option<Difference> {
    let mut field = String::new();
    search(found, expected, &mut field)
}

fn search(found: &Value, expected: &Value, field: &mut String) -> Option<Difference> {
    let length = field.len();
    match (found, expected) {
        (Value::Object(a), Value::Object(b)) => {
            let names: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            for name in names {
                if length > 0 {
                    field.push('.');
                }
                field.push_str(name);
                let difference = match (a.get(name), b.get(name)) {
                    (Some(a), Some(b)) => search(a, b, field),
                    (a, b) => Some(difference_at(field, a, b)),
                };
                if difference.is_some() {
                    return difference;
                }
                field.truncate(length);
            }
            None
        }
        (Value::Array(a), Value::Array(b)) => {
            for index in 0..a.len().max(b.len()) {
                field.push_str(&format!("[{index}]"));
                let difference = match (a.get(index), b.get(index)) {
                    (Some(a), Some(b)) => search(a, b, field),
                    (a, b) => Some(difference_at(field, a, b)),
                };
                if difference.is_some() {
                    return difference;
                }
                field.truncate(length);
            }
            None
        }
        (a, b) => (a != b).then(|| difference_at(field, Some(a), Some(b))),
    }
}

fn difference_at(field: &str, found: Option<&Value>, expected: Option<&Value>) -> Difference {
    Difference { field: field.to_owned(), found: describe(found), expected: describe(expected) }
}

/// A value in a few words.
fn describe(value: Option<&Value>) -> String {
    match value {
        None => "absent".to_owned(),
        Some(Value::Object(fields)) => format!("an object of {} fields", fields.len()),
        Some(Value::Array(values)) => format!("a list of {}", values.len()),
        Some(value) => value.to_string(),
    }
}
