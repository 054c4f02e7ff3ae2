//! YAML as values of JSON: mappings, lists, numbers, text. Aliases are refused, since a short text of them stands for an endless one.

use serde_json::{Map, Number, Value};
use yaml_rust2::parser::{Event, Parser};
use yaml_rust2::scanner::TScalarStyle;

/// Most levels of nesting.
const DEEPEST: usize = 32;

/// An open mapping, with the key whose value comes next, or an open list.
enum Open {
    Map(Map<String, Value>, Option<String>),
    List(Vec<Value>),
}

/// Reads the first document of a text.
///
/// # Errors
/// The text is no YAML, has an alias, a key that is no text or number, or too many levels; the message names the line.
pub fn first_document(text: &str) -> Result<Value, String> {
    let mut parser = Parser::new_from_str(text);
    let mut open: Vec<Open> = Vec::new();
    loop {
        let (event, mark) = parser.next_token().map_err(|e| e.to_string())?;
        let refuse = |problem: &str| Err(format!("line {}: {problem}", mark.line()));
        let value = match event {
            Event::Scalar(text, style, ..) => scalar(text, style),
            Event::SequenceStart(..) | Event::MappingStart(..) if open.len() == DEEPEST => {
                return refuse(&format!("more than {DEEPEST} levels of nesting"));
            }
            Event::SequenceStart(..) => {
                open.push(Open::List(Vec::new()));
                continue;
            }
            Event::MappingStart(..) => {
                open.push(Open::Map(Map::new(), None));
                continue;
            }
            Event::SequenceEnd | Event::MappingEnd => match open.pop() {
                Some(Open::List(list)) => Value::Array(list),
                Some(Open::Map(map, _)) => Value::Object(map),
                None => return refuse("nothing is open here"),
            },
            Event::Alias(_) => return refuse("aliases are not read"),
            Event::DocumentEnd | Event::StreamEnd => return Err("there is no content".into()),
            Event::Nothing | Event::StreamStart | Event::DocumentStart => continue,
        };
        match open.last_mut() {
            None => return Ok(value),
            Some(Open::List(list)) => list.push(value),
            Some(Open::Map(_, key @ None)) => match value {
                Value::String(text) => *key = Some(text),
                Value::Number(number) => *key = Some(number.to_string()),
                _ => return refuse("a key must be text"),
            },
            Some(Open::Map(map, key)) => {
                let name = key.take().unwrap_or_default();
                if map.contains_key(&name) {
                    return refuse(&format!("field {name} comes twice"));
                }
                map.insert(name, value);
            }
        }
    }
}

fn scalar(text: String, style: TScalarStyle) -> Value {
    if style != TScalarStyle::Plain {
        return Value::String(text);
    }
    let whole = text.parse::<i64>().ok().map(Number::from);
    let number = whole.or_else(|| text.parse::<f64>().ok().and_then(Number::from_f64));
    match text.as_str() {
        "" | "~" | "null" => Value::Null,
        "true" => Value::Bool(true),
        "false" => Value::Bool(false),
        _ => number.map_or(Value::String(text), Value::Number),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn values_are_those_of_json() {
        let text = "a: 1\nb: [1.5, -2, x, 'y', ~]\nc:\n  - d: true\n  - {}\n---\nsecond: 2\n";
        let expected = json!({"a": 1, "b": [1.5, -2, "x", "y", null], "c": [{"d": true}, {}]});
        assert_eq!(first_document(text), Ok(expected));
        assert_eq!(first_document("0: x\n1: y"), Ok(json!({"0": "x", "1": "y"})));
    }

    #[test]
    fn what_cannot_be_read_is_told() {
        let told = |text: &str| first_document(text).unwrap_err();
        assert!(told("a: &x [1]\nb: *x\n").contains("line 2: aliases are not read"));
        assert!(told("a: 1\na: 2\n").contains("field a comes twice"));
        assert!(told(&"- ".repeat(100_000)).contains("levels of nesting"));
        assert!(told("? [1]\n: 2").contains("a key must be text"));
        assert!(told("a: [1").contains("line"), "{}", told("a: [1"));
        assert!(told("").contains("no content"));
    }
}
