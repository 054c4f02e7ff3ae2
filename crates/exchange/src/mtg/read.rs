//! Reads MTG text into internodes.

use std::collections::BTreeMap;

use orchard_geometry::Vec3;
use orchard_treegen::{segments, turtle::Internode};

use super::code::{Edge, entities};
use crate::{DigitisedTree, ImportError};

/// An entity of the finest scale: an internode.
struct Vertex {
    line: usize,
    parent: Option<usize>,
    index: Option<usize>,
    p_tip: Vec3,
    radius: f64,
    order: u8,
}

/// Reader state: the header, and the tree so far.
#[derive(Default)]
struct Reader {
    /// Scale of each class.
    classes: BTreeMap<String, u32>,
    features: Vec<String>,
    /// Names of the feature columns, and the index of the first.
    columns: Vec<String>,
    first_column: usize,
    /// The last vertex in each column of codes; `None` stands for a coarser entity without wood so far.
    last: Vec<Option<usize>>,
    /// Base of the trunk in the file's coordinates \[m\].
    p_base: Vec3,
    vertices: Vec<Vertex>,
}

/// Most classes and features of a file, our own choice: a file has 10, and each line is compared with all of them.
const MOST_NAMES: usize = 200;

fn few(names: &str, count: usize) -> Result<(), String> {
    if count <= MOST_NAMES { Ok(()) } else { Err(format!("a file has at most {MOST_NAMES} {names}")) }
}

/// Reads a tree. Entities of the finest scale are wood; `XX`, `YY`, `ZZ` are the tip \[m\], `TopDia` the diameter \[m\].
/// On a coarser entity `XX`, `YY`, `ZZ` are the base of the trunk, by default the origin.
///
/// # Errors
/// A line cannot be read, or the tree is not valid; the error names the line, the field and its value.
pub fn read(text: &str) -> Result<DigitisedTree, ImportError> {
    let mut reader = Reader::default();
    let mut section = "";
    for (number, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim_end();
        if line.is_empty() {
            continue;
        }
        let at = |problem: String| ImportError::Line { line: number + 1, problem };
        let words: Vec<&str> = line.split_whitespace().collect();
        match (section, words[0]) {
            (_, "CODE:") if words.get(1) != Some(&"FORM-A") => {
                return Err(at(format!(
                    "CODE is {:?}; only FORM-A can be read",
                    words.get(1).unwrap_or(&"")
                )));
            }
            (_, "CODE:") => section = "CODE",
            ("CODE", "CLASSES:") => section = "CLASSES",
            ("CLASSES", "DESCRIPTION:") => section = "DESCRIPTION",
            ("CLASSES" | "DESCRIPTION", "FEATURES:") => section = "FEATURES",
            ("FEATURES", "MTG:") => section = "MTG",
            ("CLASSES", "SYMBOL") | ("FEATURES", "NAME") | ("DESCRIPTION", _) => {}
            ("CLASSES", class) => {
                let scale = words.get(1).and_then(|scale| scale.parse().ok());
                let scale =
                    scale.ok_or_else(|| at(format!("class {class}: its scale is not a whole number")))?;
                reader.classes.insert(class.to_owned(), scale);
                few("classes", reader.classes.len()).map_err(at)?;
            }
            ("FEATURES", name) => {
                reader.features.push(name.to_owned());
                few("features", reader.features.len()).map_err(at)?;
            }
            ("MTG", "ENTITY-CODE") => {
                reader.header(line).map_err(at)?;
                section = "BODY";
            }
            ("BODY", _) => reader.entity(line, number + 1).map_err(at)?,
            (_, word) => {
                return Err(at(format!(
                    "{word:?} is not expected here; the order is CODE, CLASSES, FEATURES, MTG"
                )));
            }
        }
    }
    if section != "BODY" {
        let problem = "the file ends before the line ENTITY-CODE".to_owned();
        return Err(ImportError::Line { line: text.lines().count().max(1), problem });
    }
    reader.tree()
}

impl Reader {
    fn header(&mut self, line: &str) -> Result<(), String> {
        let cells: Vec<&str> = line.split('\t').collect();
        self.first_column = cells.iter().skip(1).position(|c| !c.is_empty()).map_or(cells.len(), |k| k + 1);
        self.columns = cells[self.first_column..].iter().map(|c| c.trim().to_owned()).collect();
        match self.columns.iter().find(|name| !self.features.contains(name)) {
            Some(name) => Err(format!("column {name:?} is not among the FEATURES")),
            None => Ok(()),
        }
    }

    fn entity(&mut self, line: &str, number: usize) -> Result<(), String> {
        let cells: Vec<&str> = line.split('\t').collect();
        let column = cells.iter().position(|c| !c.trim().is_empty()).unwrap_or(0);
        if column >= self.first_column {
            return Err(format!("there is no entity code in the first {} columns", self.first_column));
        }
        let code = cells[column].trim();
        let same_column = code.starts_with('^');
        let before = if same_column { Some(column) } else { column.checked_sub(1) };
        let mut at = match before {
            None => None,
            Some(k) => {
                *self.last.get(k).ok_or_else(|| format!("code {code:?}: there is no entity before it"))?
            }
        };
        if before.is_none() && !self.last.is_empty() {
            return Err(format!("code {code:?} begins a second plant; a file holds one tree"));
        }
        let finest = self.classes.values().copied().max().unwrap_or(0);
        let order = at.map_or(0, |v: usize| self.vertices[v].order);
        let (mut branched, mut vertex) = (false, None);
        for entity in entities(code.trim_start_matches('^'))? {
            let scale = self
                .classes
                .get(entity.class)
                .ok_or_else(|| format!("class {:?} is unknown", entity.class))?;
            branched |= entity.edge == Edge::Branch;
            if *scale == finest && vertex.replace(entity.index).is_some() {
                return Err(format!("code {code:?}: a line may hold only one entity of the finest scale"));
            }
        }
        if let Some(index) = vertex {
            if at.is_none() && !self.vertices.is_empty() {
                return Err(format!("code {code:?}: it has no parent"));
            }
            let p_tip =
                self.point(&cells)?.ok_or_else(|| format!("code {code:?}: XX, YY and ZZ are missing"))?;
            let diameter =
                self.value(&cells, "TopDia")?.ok_or_else(|| format!("code {code:?}: TopDia is missing"))?;
            let order = match self.value(&cells, "Order")? {
                None => order.saturating_add(u8::from(branched)),
                Some(value) if (0.0..=255.0).contains(&value) && value.fract() == 0.0 => value as u8,
                Some(value) => {
                    return Err(format!("Order is {value}; it must be a whole number from 0 to 255"));
                }
            };
            self.vertices.push(Vertex {
                line: number,
                parent: at,
                index,
                p_tip,
                radius: 0.5 * diameter,
                order,
            });
            at = Some(self.vertices.len() - 1);
        } else if let Some(p_base) = self.point(&cells)? {
            if !self.vertices.is_empty() {
                return Err(
                    "XX, YY and ZZ of a coarse entity are the trunk's base and must come before all wood"
                        .into(),
                );
            }
            self.p_base = p_base;
        }
        self.last.truncate(column);
        self.last.push(at);
        Ok(())
    }

    /// Position from XX, YY and ZZ; all or none of them must be given.
    fn point(&self, cells: &[&str]) -> Result<Option<Vec3>, String> {
        let [x, y, z] = ["XX", "YY", "ZZ"].map(|name| self.value(cells, name));
        match (x?, y?, z?) {
            (Some(x), Some(y), Some(z)) => Ok(Some(Vec3::new(x, y, z))),
            (None, None, None) => Ok(None),
            _ => Err("some of XX, YY and ZZ are missing".into()),
        }
    }

    fn value(&self, cells: &[&str], name: &str) -> Result<Option<f64>, String> {
        let Some(column) = self.columns.iter().position(|c| c == name) else { return Ok(None) };
        match cells.get(self.first_column + column).map_or("", |cell| cell.trim()) {
            "" => Ok(None),
            cell => match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(Some(value)),
                _ => Err(format!("{name} is {cell:?}, not a finite number")),
            },
        }
    }

    fn tree(mut self) -> Result<DigitisedTree, ImportError> {
        self.restore_numbering();
        let mut internodes: Vec<Internode> = Vec::with_capacity(self.vertices.len());
        let mut radii = Vec::with_capacity(self.vertices.len());
        for v in &self.vertices {
            let along = v.p_tip - v.parent.map_or(self.p_base, |p| self.vertices[p].p_tip);
            let length = along.norm();
            let heading = along.try_normalize(0.0).ok_or_else(|| ImportError::Line {
                line: v.line,
                problem: "XX, YY and ZZ are at its base, so that its length is zero".into(),
            })?;
            internodes.push(Internode {
                parent: v.parent,
                heading,
                length,
                width: 1.0,
                order: v.order,
                unit: None,
            });
            radii.push(v.radius);
        }
        let tree = DigitisedTree::new(segments(&internodes, &radii), None, None);
        tree.map_err(|fault| match self.vertices.get(fault.index) {
            Some(v) => ImportError::Line { line: v.line, problem: fault.to_string() },
            None => fault.into(),
        })
    }

    /// Sorts the internodes by number if they are numbered 1 to n with parents first; else keeps the file's order.
    fn restore_numbering(&mut self) {
        let n = self.vertices.len();
        let mut at = vec![None; n];
        for (i, v) in self.vertices.iter().enumerate() {
            match v.index.and_then(|index| at.get_mut(index.wrapping_sub(1))) {
                Some(place @ None) => *place = Some(i),
                _ => return,
            }
        }
        let number = |i: usize| self.vertices[i].index.unwrap_or_default();
        if self.vertices.iter().any(|v| v.parent.is_some_and(|p| v.index <= Some(number(p)))) {
            return;
        }
        let numbers: Vec<usize> = (0..n).map(|i| number(i) - 1).collect();
        self.vertices.sort_by_key(|v| v.index);
        for v in &mut self.vertices {
            v.parent = v.parent.map(|p| numbers[p]);
        }
    }
}
