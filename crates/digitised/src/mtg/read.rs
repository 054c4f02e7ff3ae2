//! Reads MTG text into a tree.

use orchard_geometry::Vec3;
use orchard_treegen::{segments, turtle::Internode};

use super::graph::Entity;
use super::head::{Head, Role};
use super::parts::Part;
use super::shape::{Piece, Rules, Shape};
use super::unit::{Measure, Units};
use super::{Figures, graph, head, parts, thickness};
use crate::tree::{GAP, LENGTH, RADIUS};
use crate::{DigitisedTree, ImportError};

/// Facts that a reader has beyond the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Choice {
    /// Units of the file. If the file states its own, they must be the same.
    pub units: Option<Units>,
    /// Plant of a file with several, such as `P3`; the first by default.
    pub plant: Option<String>,
}

/// A tree that was read, and what the reader had to assume.
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    /// The tree.
    pub tree: DigitisedTree,
    /// Assumptions and omissions, one sentence each; none for a file that states all.
    pub notes: Vec<String>,
}

/// Reads a tree with nothing known beyond the file; [`read_with`] also returns what was assumed.
///
/// # Errors
/// As [`read_with`].
pub fn read(text: &str) -> Result<DigitisedTree, ImportError> {
    read_with(text, &Choice::default()).map(|import| import.tree)
}

/// Reads a tree. Entities without parts are wood; `XX`, `YY`, `ZZ` are the tip, `TopDia` the diameter there. On a coarser entity
/// they are the base. Without positions the tree is shaped from lengths. `docs/exchange.md` has all rules.
///
/// # Errors
/// A line cannot be read, the unit is missing and cannot be metres, or the tree is not valid. The error names line, field and value.
pub fn read_with(text: &str, choice: &Choice) -> Result<Import, ImportError> {
    let text = text.trim_start_matches('\u{feff}');
    let head = head::read(text)?;
    let entities = graph::read(text, &head)?;
    let mut notes = Vec::new();
    let plant = plant(&entities, choice.plant.as_deref(), &mut notes)?;
    let parts = parts::parts(&entities, plant);
    let positions = parts.iter().any(|part| part.values.point.is_some());
    if !positions && parts.iter().all(|part| part.values.length.is_none()) {
        return Err(ImportError::Whole(format!(
            "{} has neither positions (XX, YY, ZZ) nor lengths (Length) that give it a shape; the columns are: {}",
            entities[plant].name(),
            if head.names.is_empty() { "none".to_owned() } else { head.names.join(", ") }
        )));
    }
    let p_base = if positions { base(&parts, &mut notes) } else { Vec3::zeros() };
    let height = if positions { height(&parts, &p_base) } else { longest(&parts) };
    let figures = Figures::embedded();
    let units = units(&head, choice.units, height, &figures, &mut notes)?;
    check(&parts, &head, &units, &p_base)?;
    let rules = Rules {
        figures: &figures,
        unit: units.length.si(),
        diameter_unit: units.diameter.si(),
        shortest: *LENGTH.start(),
    };
    let shape = if positions { rules.by_positions(&parts, p_base) } else { rules.by_lengths(&parts) };
    let (tree, radii, derived) = tree(&shape, &figures)?;
    if !positions {
        let angle = |quantity: &orchard_quantity::Quantity| quantity.si().to_degrees();
        notes.push(format!(
            "the file has no positions: the tree is shaped from its lengths, with branches at {:.1} degrees, each turned by {:.1} \
             degrees against the one before",
            angle(&figures.insertion_angle),
            angle(&figures.divergence)
        ));
    }
    if shape.left_out > 0 {
        let what = if positions { "a position" } else { "a length" };
        notes.push(format!(
            "{} of {} entities without {what} at or beyond them are left out",
            shape.left_out,
            parts.len()
        ));
    }
    if shape.empty > 0 {
        notes.push(format!("{} entities without any extent are left out", shape.empty));
    }
    if derived > 0 {
        notes.push(format!(
            "{derived} of {} diameters are not in the file and follow from the others",
            radii.len()
        ));
    }
    if !notes.is_empty() {
        let top = tree.segments().iter().map(|s| s.p_tip_world().z).fold(0.0, f64::max);
        let trunk = 2.0 * radii[0];
        let thick = trunk > figures.thickest.si() * top;
        notes.push(format!(
            "the tree is {top:.2} m tall, its trunk {:.1} mm thick, in {} segments{}",
            1e3 * trunk,
            radii.len(),
            if thick { "; is the diameters' unit another one, as in mm,0.1mm?" } else { "" }
        ));
    }
    Ok(Import { tree, notes })
}

/// The chosen plant.
fn plant(entities: &[Entity], name: Option<&str>, notes: &mut Vec<String>) -> Result<usize, ImportError> {
    let plants: Vec<usize> = (0..entities.len()).filter(|&i| entities[i].plant == i).collect();
    let Some(&first) = plants.first() else {
        return Err(ImportError::Whole("the file has no entity after the line of its columns".into()));
    };
    let range = || format!("{} to {}", entities[first].name(), entities[plants[plants.len() - 1]].name());
    match name {
        None if plants.len() == 1 => Ok(first),
        None => {
            let read = entities[first].name();
            notes.push(format!("the file has {} plants, {}: {read} is read", plants.len(), range()));
            Ok(first)
        }
        Some(name) => {
            let found = plants.iter().copied().find(|&plant| entities[plant].name() == name);
            let problem =
                || format!("there is no plant {name:?}; the file has {} plants, {}", plants.len(), range());
            found.ok_or_else(|| ImportError::Whole(problem()))
        }
    }
}

/// Base of the trunk in the file's unit.
fn base(parts: &[Part], notes: &mut Vec<String>) -> Vec3 {
    if let Some(base) = parts[0].base {
        return base;
    }
    let first = parts.iter().find_map(|part| part.values.point).unwrap_or_default();
    if first.z > 0.0 {
        return Vec3::zeros();
    }
    notes.push(
        "the first point of the trunk is its base: the file gives no other, and it is not above the origin"
            .into(),
    );
    first
}

/// Height above the base in the file's unit.
fn height(parts: &[Part], p_base: &Vec3) -> f64 {
    parts.iter().filter_map(|part| part.values.point).map(|p| p.z - p_base.z).fold(0.0, f64::max)
}

/// Length of the longest way up in the file's unit.
fn longest(parts: &[Part]) -> f64 {
    let mut ways: Vec<f64> = Vec::with_capacity(parts.len());
    for part in parts {
        ways.push(part.values.length.unwrap_or(0.0) + part.parent.map_or(0.0, |parent| ways[parent]));
    }
    ways.into_iter().fold(0.0, f64::max)
}

/// Units of the file: those that it states, else the given ones, else metres if the tree then has the height of a tree.
fn units(
    head: &Head,
    given: Option<Units>,
    height: f64,
    figures: &Figures,
    notes: &mut Vec<String>,
) -> Result<Units, ImportError> {
    match (head.units, given) {
        (Some(stated), Some(given)) if stated != given => {
            Err(ImportError::Whole(format!("the file states the unit {stated}, but {given} is given")))
        }
        (Some(units), _) | (None, Some(units)) => Ok(units),
        (None, None) => {
            let range = figures.shortest.si()..=figures.tallest.si();
            if range.contains(&height) {
                notes.push("the file states no unit: metres are taken (--tree-unit gives another)".into());
                return Ok(Units::METRES);
            }
            let others = ["cm", "mm", "0.1mm"].into_iter().filter_map(|name| {
                let height = height * name.parse::<Measure>().map_or(0.0, Measure::si);
                range.contains(&height).then(|| format!("{height:.2} m with --tree-unit {name}"))
            });
            let others: Vec<String> = others.collect();
            Err(ImportError::Whole(format!(
                "the file states no unit, and in metres the tree would be {height:.2} m tall, outside {} to {} m: give the unit of \
                 lengths and of diameters by --tree-unit LENGTH,DIAMETER{}{}",
                range.start(),
                range.end(),
                if others.is_empty() { "" } else { "; the tree is " },
                others.join(", ")
            )))
        }
    }
}

/// Checks the values of the wood in the file's units.
fn check(parts: &[Part], head: &Head, units: &Units, p_base: &Vec3) -> Result<(), ImportError> {
    let name = |role| head.column(role).map_or("", |column| column.name.as_str());
    for part in parts {
        let at = |problem: String| ImportError::Line { line: part.line, problem };
        let values = &part.values;
        for (role, value) in [(Role::Top, values.top), (Role::Bottom, values.bottom)] {
            let range = 2.0 * RADIUS.start()..=2.0 * RADIUS.end();
            within(name(role), value, units.diameter, range).map_err(at)?;
        }
        within(name(Role::Length), values.length, units.length, 0.0..=*LENGTH.end()).map_err(at)?;
        if let Some(point) = values.point {
            for (role, value) in [(Role::X, point.x), (Role::Y, point.y), (Role::Z, point.z)] {
                let range = -LENGTH.end()..=*LENGTH.end();
                within(name(role), Some(value), units.length, range).map_err(at)?;
            }
            let above = (point.z - p_base.z) * units.length.si();
            if above < -GAP {
                let by = units.length.text(-above);
                return Err(at(format!(
                    "{} is {}, {by} below the base of the trunk: wood stands above the ground",
                    name(Role::Z),
                    point.z
                )));
            }
        }
    }
    Ok(())
}

fn within(
    name: &str,
    value: Option<f64>,
    unit: Measure,
    range: std::ops::RangeInclusive<f64>,
) -> Result<(), String> {
    match value {
        Some(value) if !range.contains(&(value * unit.si())) => {
            let [low, high] = [*range.start(), *range.end()].map(|end| end / unit.si());
            Err(format!("{name} is {value} {unit}: the allowed range is [{low}, {high}] {unit}"))
        }
        _ => Ok(()),
    }
}

/// The tree, its radii \[m\], and the number of derived diameters.
fn tree(shape: &Shape, figures: &Figures) -> Result<(DigitisedTree, Vec<f64>, usize), ImportError> {
    let pieces = in_order(shape.pieces.clone());
    let (radii, derived) = thickness::radii(&pieces, figures);
    let internode = |piece: &Piece| {
        let along = piece.p_tip - piece.p_base;
        let length = along.norm();
        Internode {
            parent: piece.parent,
            heading: along / length,
            length,
            width: 1.0,
            order: piece.order,
            unit: None,
        }
    };
    let internodes: Vec<Internode> = pieces.iter().map(internode).collect();
    let tree = DigitisedTree::new(segments(&internodes, &radii), None, None);
    match tree {
        Ok(tree) => Ok((tree, radii, derived)),
        Err(fault) => Err(match pieces.get(fault.index) {
            Some(piece) => ImportError::Line { line: piece.line, problem: fault.to_string() },
            None => fault.into(),
        }),
    }
}

/// Sorts the pieces by number if they are numbered 1 to n with parents first; else keeps the file's order.
fn in_order(mut pieces: Vec<Piece>) -> Vec<Piece> {
    let n = pieces.len();
    let mut found = vec![false; n];
    for piece in &pieces {
        match piece.index.and_then(|index| found.get_mut(index.wrapping_sub(1))) {
            Some(place @ false) => *place = true,
            _ => return pieces,
        }
    }
    let numbers: Vec<usize> = pieces.iter().map(|piece| piece.index.unwrap_or_default() - 1).collect();
    if pieces.iter().zip(&numbers).any(|(piece, number)| piece.parent.is_some_and(|p| numbers[p] >= *number))
    {
        return pieces;
    }
    for piece in &mut pieces {
        piece.parent = piece.parent.map(|parent| numbers[parent]);
    }
    pieces.sort_by_key(|piece| piece.index);
    pieces
}
