//! Reads the codes of an MTG file into its entities and the relations between them.

use std::collections::BTreeMap;

use orchard_geometry::Vec3;

use super::code::{Edge, Series, Step, steps};
use super::head::{Head, Role};
use crate::ImportError;

/// Most entities of a file, our own choice: ten times those of the largest digitised apple trees.
const MOST_ENTITIES: usize = 500_000;

/// Values of an entity, in the units of the file; zero diameters and lengths count as missing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Values {
    pub point: Option<Vec3>,
    pub length: Option<f64>,
    pub top: Option<f64>,
    pub bottom: Option<f64>,
    pub order: Option<u8>,
}

/// An entity of any scale.
#[derive(Debug, Clone)]
pub struct Entity<'a> {
    pub line: usize,
    pub class: &'a str,
    pub index: Option<usize>,
    pub scale: usize,
    /// Entity that it is a part of.
    pub whole: Option<usize>,
    /// Entity of its own scale that it continues or branches off, by `edge`.
    pub parent: Option<usize>,
    pub edge: Edge,
    /// Finest entity of the place from which the code reached it.
    pub from: Option<usize>,
    /// Root entity of its plant.
    pub plant: usize,
    pub values: Values,
}

impl Entity<'_> {
    /// Class and index.
    pub fn name(&self) -> String {
        label(self.class, self.index)
    }
}

fn label(class: &str, index: Option<usize>) -> String {
    index.map_or(class.to_owned(), |index| format!("{class}{index}"))
}

/// Place in the plant from which a code goes on: the entity of each scale, and the relation to it that finer entities inherit.
#[derive(Debug, Clone)]
struct Place {
    at: Vec<Option<usize>>,
    pending: Vec<Option<Edge>>,
    scale: usize,
}

impl Place {
    fn start(finest: usize) -> Self {
        Self { at: vec![None; finest + 1], pending: vec![None; finest + 1], scale: 0 }
    }

    fn entity(&self) -> Option<usize> {
        self.at[self.scale]
    }
}

/// Key of an entity in absolute names: what it hangs on, how, and its label.
type Key<'a> = (Option<usize>, Edge, &'a str, Option<usize>);

struct Reader<'a> {
    head: &'a Head,
    entities: Vec<Entity<'a>>,
    known: BTreeMap<Key<'a>, usize>,
    aliases: BTreeMap<&'a str, Place>,
    /// The place after the last code of each column.
    last: Vec<Option<Place>>,
}

/// Reads the entities of a file.
///
/// # Errors
/// A line that cannot be read, with its field and value.
pub fn read<'a>(text: &'a str, head: &'a Head) -> Result<Vec<Entity<'a>>, ImportError> {
    let mut reader = Reader {
        head,
        entities: Vec::new(),
        known: BTreeMap::new(),
        aliases: BTreeMap::new(),
        last: Vec::new(),
    };
    for (number, line) in text.lines().enumerate().skip(head.body) {
        let at = |problem: String| ImportError::Line { line: number + 1, problem };
        if !line.trim_start().starts_with('#') {
            reader.line(line, number + 1).map_err(at)?;
        }
    }
    Ok(reader.entities)
}

impl<'a> Reader<'a> {
    fn line(&mut self, line: &'a str, number: usize) -> Result<(), String> {
        // A comment ends at the next tab.
        let cells: Vec<&str> =
            line.split('\t').map(|cell| cell.split('#').next().unwrap_or_default().trim()).collect();
        let codes = &cells[..cells.len().min(self.head.first_cell)];
        let mut filled = codes.iter().enumerate().filter(|(_, code)| !code.is_empty());
        let Some((column, &code)) = filled.next() else {
            return match cells.iter().find(|cell| !cell.is_empty()) {
                None => Ok(()),
                Some(value) => Err(format!("{value:?} stands in a line without an entity code")),
            };
        };
        let values = self.values(&cells)?;
        if code == "*" {
            return self.observe(column, &values);
        }
        let (mut place, rest, absolute) = self.base(column, code)?;
        let mut made = self.code(&mut place, rest, absolute, number)?;
        self.last.truncate(column);
        self.last.resize(column, None);
        self.last.push(Some(place.clone()));
        // A code may go on in further columns.
        for (column, &code) in filled {
            made = self.code(&mut place, code.trim_start_matches('^'), false, number)?;
            self.last.resize(column, None);
            self.last.push(Some(place.clone()));
        }
        for entity in made {
            self.entities[entity].values = values;
        }
        if let Some(column) = self.head.column(Role::Alias)
            && let Some(&name) = cells.get(column.cell).filter(|name| !name.is_empty())
        {
            self.aliases.insert(name, place);
        }
        Ok(())
    }

    /// The place where a code begins, the code from there, and true if it is an absolute name or one that begins at an alias.
    fn base(&self, column: usize, code: &'a str) -> Result<(Place, &'a str, bool), String> {
        if let Some(code) = code.strip_prefix('(') {
            let (name, rest) = code.split_once(')').ok_or(format!("code {code:?}: the alias has no ')'"))?;
            let place = self.aliases.get(name).ok_or(format!("alias {name:?} is not given before"))?;
            return Ok((place.clone(), rest, true));
        }
        let same = code.starts_with('^');
        let rest = code.strip_prefix('^').unwrap_or(code);
        if !same && column == 0 && code.starts_with('/') {
            return Ok((Place::start(self.head.finest()), rest, true));
        }
        let before = match same {
            true => self.last.get(column).and_then(Option::as_ref),
            false => self.last.iter().take(column).rev().find_map(Option::as_ref),
        };
        let where_to = if same { "in this column" } else { "in the columns to the left" };
        let place =
            before.ok_or(format!("code {code:?}: there is no entity {where_to} that it goes on from"))?;
        Ok((place.clone(), rest, false))
    }

    /// A further observation of the last entity of a column: its values replace those before.
    fn observe(&mut self, column: usize, values: &Values) -> Result<(), String> {
        let last = self.last.get(column).and_then(Option::as_ref).and_then(Place::entity);
        let entity = last.ok_or("\"*\": there is no entity above in this column")?;
        let old = self.entities[entity].values;
        self.entities[entity].values = Values {
            point: values.point.or(old.point),
            length: values.length.or(old.length),
            top: values.top.or(old.top),
            bottom: values.bottom.or(old.bottom),
            order: values.order.or(old.order),
        };
        self.last.truncate(column + 1);
        Ok(())
    }

    /// Follows a code; returns the entities that the values of its line belong to.
    fn code(
        &mut self,
        place: &mut Place,
        code: &'a str,
        absolute: bool,
        line: usize,
    ) -> Result<Vec<usize>, String> {
        let steps = steps(code)?;
        let count = steps.len();
        let mut made = Vec::new();
        for (k, step) in steps.into_iter().enumerate() {
            let scale = *self
                .head
                .classes
                .get(step.class)
                .ok_or_else(|| format!("class {:?} is not declared in CLASSES", step.class))?;
            let wrong = |problem: String| format!("code {code:?}: {problem}");
            made.clear();
            for index in self.indices(place, scale, &step).map_err(wrong)? {
                let find = absolute && k + 1 < count && step.series == Series::One;
                made.push(self.step(place, scale, &step, index, find, line).map_err(wrong)?);
            }
            if step.series != Series::AllHaveValues {
                made.drain(..made.len() - 1);
            }
        }
        Ok(made)
    }

    /// Indices of the entities that a step stands for.
    fn indices(&self, place: &Place, scale: usize, step: &Step) -> Result<Vec<Option<usize>>, String> {
        if step.series == Series::One {
            return Ok(vec![step.index]);
        }
        let first = place.at[scale].map(|entity| &self.entities[entity]);
        let first = first.ok_or(format!("there is no entity before the series to {}", step.class))?;
        match (first.index, step.index) {
            (Some(from), Some(to)) if first.class == step.class && from < to => {
                if to - from > MOST_ENTITIES {
                    return Err(format!("a file has at most {MOST_ENTITIES} entities"));
                }
                Ok((from + 1..=to).map(Some).collect())
            }
            _ => {
                let to = label(step.class, step.index);
                Err(format!("a series needs one class and growing indices, not {} to {to}", first.name()))
            }
        }
    }

    fn step(
        &mut self,
        place: &mut Place,
        scale: usize,
        step: &Step<'a>,
        index: Option<usize>,
        find: bool,
        line: usize,
    ) -> Result<usize, String> {
        // `/` from the same or a finer scale: another part of the same whole.
        let beside = step.edge == Edge::Part && scale <= place.scale;
        let coarser = &place.at[..scale.min(place.scale + 1)];
        let whole = coarser.iter().rev().find_map(|entity| *entity);
        let (parent, edge) = match step.edge {
            Edge::Part if beside => (None, Edge::Part),
            Edge::Part => match place.pending[scale] {
                Some(edge) => (place.at[scale], edge),
                None => (None, Edge::Part),
            },
            edge => {
                let sign = if edge == Edge::Branch { '+' } else { '<' };
                let none = format!(
                    "there is no entity of scale {scale} before '{sign}{}'",
                    label(step.class, index)
                );
                (Some(place.at[scale].ok_or(none)?), edge)
            }
        };
        // An entity that goes on from one of its own scale is in the same whole.
        let whole = if step.edge == Edge::Part { whole } else { parent.and_then(|p| self.entities[p].whole) };
        let key = (if step.edge == Edge::Part { whole } else { parent }, step.edge, step.class, index);
        if let Some(&entity) = self.known.get(&key).filter(|_| find) {
            self.go(place, entity, step.edge, beside);
            return Ok(entity);
        }
        let entity = self.entities.len();
        if entity >= MOST_ENTITIES {
            return Err(format!("a file has at most {MOST_ENTITIES} entities"));
        }
        let plant = whole.or(parent).map_or(entity, |other| self.entities[other].plant);
        let from = place.at.iter().rev().find_map(|entity| *entity);
        let values = Values::default();
        let class = step.class;
        self.entities.push(Entity { line, class, index, scale, whole, parent, edge, from, plant, values });
        self.known.entry(key).or_insert(entity);
        self.go(place, entity, step.edge, beside);
        Ok(entity)
    }

    /// Moves a place to an entity. Entities of finer scales stay as those that its parts continue, unless it stands beside them.
    fn go(&self, place: &mut Place, entity: usize, edge: Edge, beside: bool) {
        let scale = self.entities[entity].scale;
        place.scale = scale;
        let mut outer = Some(entity);
        while let Some(entity) = outer {
            place.at[self.entities[entity].scale] = Some(entity);
            outer = self.entities[entity].whole;
        }
        place.pending[scale] = None;
        for finer in scale + 1..place.at.len() {
            if beside {
                (place.at[finer], place.pending[finer]) = (None, None);
            } else if edge != Edge::Part && place.pending[finer] != Some(Edge::Branch) {
                place.pending[finer] = Some(edge);
            }
        }
    }

    fn values(&self, cells: &[&str]) -> Result<Values, String> {
        let [x, y, z] = [Role::X, Role::Y, Role::Z].map(|role| self.value(cells, role));
        let point = match (x?, y?, z?) {
            (Some((_, x)), Some((_, y)), Some((_, z))) => Some(Vec3::new(x, y, z)),
            (None, None, None) => None,
            _ => return Err("some of XX, YY and ZZ are missing".into()),
        };
        let size = |role| match self.value(cells, role)? {
            Some((name, value)) if value < 0.0 => Err(format!("{name} is {value}: it must not be negative")),
            value => Ok(value.map(|(_, value)| value).filter(|value| *value != 0.0)),
        };
        let order = match self.value(cells, Role::Order)? {
            None => None,
            Some((_, value)) if (0.0..=255.0).contains(&value) && value.fract() == 0.0 => Some(value as u8),
            Some((name, value)) => {
                return Err(format!("{name} is {value}; it must be a whole number from 0 to 255"));
            }
        };
        Ok(Values {
            point,
            length: size(Role::Length)?,
            top: size(Role::Top)?,
            bottom: size(Role::Bottom)?,
            order,
        })
    }

    /// Name of a column and its value in a line.
    fn value(&self, cells: &[&str], role: Role) -> Result<Option<(&'a str, f64)>, String> {
        let head: &'a Head = self.head;
        let Some(column) = head.column(role) else { return Ok(None) };
        match cells.get(column.cell).copied().unwrap_or_default() {
            "" => Ok(None),
            cell => match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(Some((&column.name, value))),
                _ => Err(format!("{} is {cell:?}, not a finite number", column.name)),
            },
        }
    }
}
