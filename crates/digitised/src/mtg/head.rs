//! Reads the header of an MTG file: classes, features, and the columns of values.

use std::collections::BTreeMap;

use super::unit::Units;
use crate::ImportError;

/// Most classes, features and scales of a file, our own choice: a file has 10, and each line is compared with all of them.
const MOST_NAMES: usize = 200;
const MOST_SCALES: usize = 20;

/// Meaning of a column of values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    X,
    Y,
    Z,
    Length,
    Top,
    Bottom,
    Order,
    Alias,
}

/// Names of columns, in lower case: those of the format, and those of published files.
pub const ROLES: [(&str, Role); 17] = [
    ("xx", Role::X),
    ("yy", Role::Y),
    ("zz", Role::Z),
    ("alias", Role::Alias),
    ("order", Role::Order),
    ("topdia", Role::Top),
    ("topdiameter", Role::Top),
    ("diam", Role::Top),
    ("diameter", Role::Top),
    ("diasom", Role::Top),
    ("bottomdia", Role::Bottom),
    ("bottomdiameter", Role::Bottom),
    ("diabase", Role::Bottom),
    ("length", Role::Length),
    ("long", Role::Length),
    ("longueur", Role::Length),
    ("longuc", Role::Length),
];

/// A column of values that is read.
#[derive(Debug, Clone)]
pub struct Column {
    pub role: Role,
    pub name: String,
    /// Index among all cells of a line.
    pub cell: usize,
}

/// The header.
#[derive(Debug, Clone, Default)]
pub struct Head {
    /// Scale of each class.
    pub classes: BTreeMap<String, usize>,
    /// Units, from the comment `# unit: LENGTH[,DIAMETER]`.
    pub units: Option<Units>,
    pub columns: Vec<Column>,
    /// Names of all columns of values.
    pub names: Vec<String>,
    /// Index of the first cell that holds a value; codes stand before it.
    pub first_cell: usize,
    /// Index of the first line of codes.
    pub body: usize,
    features: Vec<String>,
}

/// The text of a line without its comment.
fn bare(line: &str) -> &str {
    line.split('#').next().unwrap_or_default().trim_end()
}

fn few(names: &str, count: usize) -> Result<(), String> {
    if count <= MOST_NAMES { Ok(()) } else { Err(format!("a file has at most {MOST_NAMES} {names}")) }
}

/// Reads the header up to the line of the columns.
pub fn read(text: &str) -> Result<Head, ImportError> {
    let mut head = Head::default();
    let mut section = "";
    for (number, line) in text.lines().enumerate() {
        let at = |problem: String| ImportError::Line { line: number + 1, problem };
        if let Some(units) = line.strip_prefix('#').and_then(|c| c.trim().strip_prefix("unit:")) {
            head.units = Some(units.parse().map_err(|e| at(format!("unit: {e}")))?);
        }
        let line = bare(line);
        let Some(word) = line.split([':', '\t', ' ']).find(|word| !word.is_empty()) else { continue };
        match (section, word) {
            (_, "CODE") => {
                let form = line.split([':', '\t', ' ']).rfind(|w| !w.is_empty()).unwrap_or_default();
                if form != "FORM-A" {
                    let why = "only FORM-A can be read; FORM-B lists a stem from its tip";
                    return Err(at(format!("CODE is {form:?}; {why}")));
                }
                section = "CODE";
            }
            ("CODE", "CLASSES") => section = "CLASSES",
            ("CLASSES", "DESCRIPTION") => section = "DESCRIPTION",
            ("CLASSES" | "DESCRIPTION", "FEATURES") => section = "FEATURES",
            ("FEATURES", "MTG") => section = "MTG",
            ("CLASSES", "SYMBOL") | ("FEATURES", "NAME") | ("DESCRIPTION", _) => {}
            ("CLASSES", _) => head.class(line).map_err(at)?,
            ("FEATURES", name) => {
                head.features.push(name.to_owned());
                few("features", head.features.len()).map_err(at)?;
            }
            ("MTG", "ENTITY-CODE" | "TOPO") => {
                head.columns(line).map_err(at)?;
                head.body = number + 1;
                return Ok(head);
            }
            (_, word) => {
                let order = "CODE, CLASSES, DESCRIPTION, FEATURES, MTG, ENTITY-CODE or TOPO";
                return Err(at(format!("{word:?} is not expected here; the order is {order}")));
            }
        }
    }
    let problem = "the file ends before the line ENTITY-CODE or TOPO".to_owned();
    Err(ImportError::Line { line: text.lines().count().max(1), problem })
}

impl Head {
    fn class(&mut self, line: &str) -> Result<(), String> {
        let mut words = line.split_whitespace();
        let class = words.next().unwrap_or_default();
        let scale = words.next().and_then(|scale| scale.parse().ok()).filter(|scale| *scale <= MOST_SCALES);
        let scale =
            scale.ok_or(format!("class {class}: its scale is not a whole number up to {MOST_SCALES}"))?;
        match self.classes.insert(class.to_owned(), scale) {
            Some(other) if other != scale => {
                Err(format!("class {class} has two scales, {other} and {scale}"))
            }
            _ => few("classes", self.classes.len()),
        }
    }

    fn columns(&mut self, line: &str) -> Result<(), String> {
        let cells: Vec<&str> = line.split('\t').map(str::trim).collect();
        let values = || cells.iter().enumerate().skip(1).filter(|(_, name)| !name.is_empty());
        self.first_cell = values().next().map_or(usize::MAX, |(cell, _)| cell);
        for (cell, &name) in values() {
            if !self.features.iter().any(|feature| feature == name) {
                return Err(format!(
                    "column {name:?} is not among the FEATURES: {}",
                    self.features.join(", ")
                ));
            }
            self.names.push(name.to_owned());
            let lower = name.to_ascii_lowercase();
            let role = ROLES.iter().find(|(known, _)| *known == lower).map(|(_, role)| *role);
            if let Some(role) = role.filter(|role| self.column(*role).is_none()) {
                self.columns.push(Column { role, name: name.to_owned(), cell });
            }
        }
        Ok(())
    }

    /// The column with a meaning.
    pub fn column(&self, role: Role) -> Option<&Column> {
        self.columns.iter().find(|column| column.role == role)
    }

    /// The finest scale.
    pub fn finest(&self) -> usize {
        self.classes.values().copied().max().unwrap_or(0)
    }
}
