//! The reference of a robot's mapping in the documentation is that of the config's types: their fields with their documentation, and units as the
//! shipped robots give them.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Context;
use syn::{Attribute, Expr, Fields, Item, Lit, Meta, Type};

use super::marked;
use crate::workspace::{files, relative};

/// Page with the reference, and its name there.
const PAGE: &str = "docs/robots.md";
const PART: &str = "mapping";

/// The crate with the config, the file in which it begins, and its type.
const SOURCE: &str = "crates/robot/src";
const ROOT: &str = "RobotConfig";

/// Compares the reference with the code; with `write`, brings it up to date instead.
pub fn check(root: &Path, write: bool) -> anyhow::Result<Vec<String>> {
    marked::keep(root, PAGE, PART, &types(root)?.reference(&units(root)?)?, write)
}

/// A field of a config's type, or a variant of a choice.
#[derive(Debug, Clone, PartialEq)]
struct Field {
    name: String,
    doc: String,
    /// Type without `Option` and `Vec`, if it is a plain name.
    kind: String,
    is_list: bool,
    is_optional: bool,
}

/// The types of a config, by name.
#[derive(Debug, Default)]
struct Types {
    structs: BTreeMap<String, Vec<Field>>,
    /// Variants of choices that are written as `{ kind = "NAME", .. }`: name and documentation, and their fields.
    choices: BTreeMap<String, Vec<(Field, Vec<Field>)>>,
}

/// Reads all types of the files `config.rs` and `config/*.rs`, and the limits.
fn types(root: &Path) -> anyhow::Result<Types> {
    let mut types = Types::default();
    let folder = root.join(SOURCE);
    let sources = files(&folder, &["rs"])?.into_iter().filter(|path| {
        let name = relative(&folder, path);
        name == "config.rs" || name.starts_with("config/")
    });
    for path in sources {
        let text = std::fs::read_to_string(&path)?;
        types.add(&syn::parse_file(&text).with_context(|| relative(root, &path))?);
    }
    Ok(types)
}

impl Types {
    fn add(&mut self, file: &syn::File) {
        for item in &file.items {
            match item {
                Item::Struct(item) => {
                    self.structs.insert(item.ident.to_string(), fields(&item.fields));
                }
                Item::Enum(item) => {
                    let variant = |variant: &syn::Variant| {
                        let name = snake(&variant.ident.to_string());
                        let doc = documentation(&variant.attrs);
                        let own =
                            Field { name, doc, kind: String::new(), is_list: false, is_optional: false };
                        (own, fields(&variant.fields))
                    };
                    self.choices.insert(item.ident.to_string(), item.variants.iter().map(variant).collect());
                }
                _ => {}
            }
        }
    }

    /// The reference as a table: a row for each entry, tables first named and then their fields.
    fn reference(&self, units: &BTreeMap<String, String>) -> anyhow::Result<String> {
        let root = self.structs.get(ROOT).with_context(|| format!("no type {ROOT} in {SOURCE}"))?;
        let mut text = "| entry | value | content |\n|---|---|---|\n".to_owned();
        self.rows("", root, units, &mut text);
        Ok(text)
    }

    fn rows(&self, path: &str, fields: &[Field], units: &BTreeMap<String, String>, text: &mut String) {
        for field in fields {
            let path = if path.is_empty() { field.name.clone() } else { format!("{path}.{}", field.name) };
            let optional = if field.is_optional { ", optional" } else { "" };
            let row = |entry: String, value: String, doc: &str| {
                format!("| {entry} | {value}{optional} | {} |\n", doc.replace('|', "\\|"))
            };
            if let Some(inner) = self.structs.get(&field.kind) {
                *text += &row(format!("**`[{path}]`**"), "table".to_owned(), &field.doc);
                self.rows(&path, inner, units, text);
            } else if let Some(variants) = self.choices.get(&field.kind) {
                *text += &row(format!("`{path}`"), "choice".to_owned(), &field.doc);
                for (variant, inner) in variants {
                    let entry = format!("`{path} = {{ kind = \"{}\" }}`", variant.name);
                    *text += &format!("| {entry} | | {} |\n", variant.doc);
                    self.rows(&path, inner, units, text);
                }
            } else {
                *text += &row(format!("`{path}`"), value(field, units.get(&path)), &field.doc);
            }
        }
    }
}

/// The kind of value in words.
fn value(field: &Field, unit: Option<&String>) -> String {
    let in_unit = |what: &str| unit.map_or(what.to_owned(), |unit| format!("{what} in {unit}"));
    let one = match field.kind.as_str() {
        "String" => "name".to_owned(),
        "Quantity" => in_unit("constant"),
        "Span" => in_unit("interval"),
        "Count" => "number".to_owned(),
        _ => "table".to_owned(),
    };
    if field.is_list { format!("list: {one}") } else { one }
}

fn fields(fields: &Fields) -> Vec<Field> {
    let Fields::Named(named) = fields else { return Vec::new() };
    let field = |field: &syn::Field| {
        let (kind, is_list, is_option) = plain(&field.ty);
        let has_default = serde_words(&field.attrs).iter().any(|word| word == "default");
        Field {
            name: field.ident.as_ref().map(ToString::to_string).unwrap_or_default(),
            doc: documentation(&field.attrs),
            kind,
            is_list,
            is_optional: is_option || has_default,
        }
    };
    named.named.iter().map(field).collect()
}

/// Name of a type without `Option` and `Vec`, and whether it had them. Arrays are lists.
fn plain(ty: &Type) -> (String, bool, bool) {
    match ty {
        Type::Array(array) => {
            let (kind, _, is_option) = plain(&array.elem);
            (kind, true, is_option)
        }
        Type::Path(path) => {
            let Some(last) = path.path.segments.last() else { return Default::default() };
            let name = last.ident.to_string();
            let inner = match &last.arguments {
                syn::PathArguments::AngleBracketed(arguments) => {
                    arguments.args.iter().find_map(|argument| match argument {
                        syn::GenericArgument::Type(inner) => Some(plain(inner)),
                        _ => None,
                    })
                }
                _ => None,
            };
            match (name.as_str(), inner) {
                ("Option", Some((kind, is_list, _))) => (kind, is_list, true),
                ("Vec", Some((kind, _, is_option))) => (kind, true, is_option),
                _ => (name, false, false),
            }
        }
        _ => Default::default(),
    }
}

/// The text of documentation comments as one line of Markdown.
fn documentation(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
            Expr::Lit(literal) => match &literal.lit {
                Lit::Str(text) => Some(text.value().trim().to_owned()),
                _ => None,
            },
            _ => None,
        },
        _ => None,
    });
    lines.collect::<Vec<_>>().join(" ").replace("\\[", "[").replace("\\]", "]")
}

/// The words of `#[serde(..)]` attributes.
fn serde_words(attributes: &[Attribute]) -> Vec<String> {
    let lists = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::List(list) if list.path.is_ident("serde") => Some(list.tokens.to_string()),
        _ => None,
    });
    let words = lists.flat_map(|list| list.split(',').map(|word| word.trim().to_owned()).collect::<Vec<_>>());
    words.collect()
}

/// A variant's name as serde writes it.
fn snake(name: &str) -> String {
    let mut snake = String::new();
    for (i, letter) in name.chars().enumerate() {
        if letter.is_uppercase() && i > 0 {
            snake.push('_');
        }
        snake.extend(letter.to_lowercase());
    }
    snake
}

/// Unit of each entry, by its path, as the shipped robots give it.
fn units(root: &Path) -> anyhow::Result<BTreeMap<String, String>> {
    let mut units = BTreeMap::new();
    for path in files(&root.join("assets/robots"), &["toml"])? {
        let table: toml::Table =
            std::fs::read_to_string(&path)?.parse().with_context(|| relative(root, &path))?;
        collect("", &toml::Value::Table(table), &mut units);
    }
    Ok(units)
}

fn collect(path: &str, value: &toml::Value, units: &mut BTreeMap<String, String>) {
    match value {
        toml::Value::Table(table) => match (table.get("unit"), table.get("source")) {
            (Some(toml::Value::String(unit)), Some(_)) => {
                units.entry(path.to_owned()).or_insert_with(|| unit.clone());
            }
            _ => {
                for (name, value) in table {
                    let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                    collect(&path, value, units);
                }
            }
        },
        toml::Value::Array(values) => values.iter().for_each(|value| collect(path, value, units)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CODE: &str = "
        /// The whole.
        struct RobotConfig {
            /// Names.
            parts: Parts,
            /// Drive; none for a base that
            /// stands \\[m\\].
            #[serde(default, skip_serializing_if = \"Option::is_none\")]
            drive: Option<Drive>,
        }
        struct Parts {
            /// Joints.
            joints: Vec<String>,
            /// Friction.
            #[serde(default)]
            friction: Vec<Quantity>,
        }
        struct Drive {
            /// Ways.
            steering: Steering,
        }
        enum Steering {
            /// In any direction.
            Holonomic,
            /// As a car.
            CarLike {
                /// Tightest turn.
                radius: Quantity,
            },
        }";

    #[test]
    fn the_reference_follows_types_documentation_and_units() {
        let mut types = Types::default();
        types.add(&syn::parse_str(CODE).unwrap());
        let units = BTreeMap::from([
            ("drive.steering.radius".to_owned(), "m".to_owned()),
            ("parts.friction".to_owned(), "N m".to_owned()),
        ]);
        let expected = "| entry | value | content |\n|---|---|---|\n\
            | **`[parts]`** | table | Names. |\n\
            | `parts.joints` | list: name | Joints. |\n\
            | `parts.friction` | list: constant in N m, optional | Friction. |\n\
            | **`[drive]`** | table, optional | Drive; none for a base that stands [m]. |\n\
            | `drive.steering` | choice | Ways. |\n\
            | `drive.steering = { kind = \"holonomic\" }` | | In any direction. |\n\
            | `drive.steering = { kind = \"car_like\" }` | | As a car. |\n\
            | `drive.steering.radius` | constant in m | Tightest turn. |\n";
        assert_eq!(types.reference(&units).unwrap(), expected);
    }

    #[test]
    fn units_are_those_of_the_robots_files() {
        let folder = super::super::fixture::folder(&[(
            "assets/robots/a/robot.toml",
            "[arm]\nk = { value = 1, unit = 'N m/rad', source = 'x' }\nlist = [{ value = 1, unit = 'm', source = 'x' }]",
        )]);
        let units = units(folder.path()).unwrap();
        assert_eq!(units["arm.k"], "N m/rad");
        assert_eq!(units["arm.list"], "m");
    }

    #[test]
    fn the_page_of_this_workspace_is_up_to_date() {
        assert_eq!(check(&crate::workspace::root(), false).unwrap(), Vec::<String>::new());
    }
}
