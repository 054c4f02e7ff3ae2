//! Finds the wood of a plant: the entities without parts, what each grows from, and the values that coarser entities give them.

use std::collections::BTreeMap;

use orchard_geometry::Vec3;

use super::code::Edge;
use super::graph::{Entity, Values};

/// An entity without parts. Its parent stands before it; only the first has none.
#[derive(Debug, Clone)]
pub struct Part {
    pub line: usize,
    pub index: Option<usize>,
    pub parent: Option<usize>,
    /// True if it branches off its parent, false if it continues it.
    pub branches: bool,
    pub values: Values,
    /// Position of the base, if a coarser entity that begins with this one has one.
    pub base: Option<Vec3>,
    /// True if its length is a share of a coarser entity's.
    pub shared: bool,
}

/// Entities with the relations between them, by index.
struct Graph<'a> {
    entities: &'a [Entity<'a>],
    first_part: Vec<Option<usize>>,
    /// The entity that continues it in the same whole.
    successor: Vec<Option<usize>>,
    /// Last part of an entity's axis that was found so far.
    ends: BTreeMap<usize, usize>,
}

/// The wood of a plant.
pub fn parts(entities: &[Entity], plant: usize) -> Vec<Part> {
    let mut graph = Graph {
        entities,
        first_part: vec![None; entities.len()],
        successor: vec![None; entities.len()],
        ends: BTreeMap::new(),
    };
    for (i, entity) in entities.iter().enumerate() {
        if let Some(whole) = entity.whole {
            graph.first_part[whole].get_or_insert(i);
        }
        if let Some(parent) =
            entity.parent.filter(|p| entity.edge == Edge::Successor && entities[*p].whole == entity.whole)
        {
            graph.successor[parent].get_or_insert(i);
        }
    }
    let mut place = vec![None; entities.len()];
    let mut ids = Vec::new();
    let mut parts: Vec<Part> = Vec::new();
    for (i, entity) in entities.iter().enumerate().filter(|(_, entity)| entity.plant == plant) {
        if graph.first_part[i].is_some() {
            continue;
        }
        let link = graph.link(i);
        let parent = link.and_then(|(parent, _)| place[parent]);
        place[i] = Some(parts.len());
        ids.push(i);
        let branches = link.is_some_and(|(_, edge)| edge == Edge::Branch);
        let values = entity.values;
        let (line, index) = (entity.line, entity.index);
        parts.push(Part { line, index, parent, branches, values, base: None, shared: false });
    }
    graph.relays(&mut parts, &ids);
    graph.spread(&mut parts, &place, plant);
    parts
}

impl Graph<'_> {
    fn is_wood(&self, entity: usize) -> bool {
        self.first_part[entity].is_none()
    }

    /// The wood that an entity grows from, and how.
    fn link(&mut self, i: usize) -> Option<(usize, Edge)> {
        let Entity { parent, edge, whole, from, .. } = self.entities[i];
        match (parent, whole) {
            (Some(parent), _) if self.is_wood(parent) => Some((parent, edge)),
            (Some(parent), _) => {
                let from = from.filter(|&from| self.is_wood(from));
                Some((from.unwrap_or_else(|| self.end(parent, i)), edge))
            }
            (None, Some(whole)) if self.first_part[whole] == Some(i) => self.link(whole),
            // Parts that no relation links follow one another.
            (None, Some(whole)) => Some((self.end(from.unwrap_or(whole), i), Edge::Successor)),
            (None, None) => None,
        }
    }

    /// The last wood on the axis of an entity among the entities before another.
    fn end(&mut self, mut entity: usize, before: usize) -> usize {
        while let Some(first) = self.first_part[entity].filter(|first| *first < before) {
            let mut last = self.ends.get(&entity).copied().unwrap_or(first);
            while let Some(next) = self.successor[last].filter(|next| *next < before) {
                last = next;
            }
            self.ends.insert(entity, last);
            entity = last;
        }
        entity
    }

    /// Finds sympodial axes: a branch in the same axis as its parent, which nothing else continues, continues it.
    fn relays(&self, parts: &mut [Part], ids: &[usize]) {
        let mut continued = vec![false; parts.len()];
        for part in parts.iter().filter(|part| !part.branches) {
            if let Some(parent) = part.parent {
                continued[parent] = true;
            }
        }
        for i in 0..parts.len() {
            let Some(parent) = parts[i].parent.filter(|parent| parts[i].branches && !continued[*parent])
            else {
                continue;
            };
            let axis = self.wholes(ids[parent]).any(|whole| {
                self.entities[whole].scale > 1 && self.wholes(ids[i]).any(|other| other == whole)
            });
            if axis {
                (parts[i].branches, continued[parent]) = (false, true);
            }
        }
    }

    fn wholes(&self, entity: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(self.entities[entity].whole, |whole| self.entities[*whole].whole)
    }

    /// Gives the values of entities with parts to their parts, finer entities first.
    fn spread(&self, parts: &mut [Part], place: &[Option<usize>], plant: usize) {
        let coarse = |i: &usize| self.entities[*i].plant == plant && !self.is_wood(*i);
        let mut coarse: Vec<usize> = (0..self.entities.len()).filter(coarse).collect();
        coarse.sort_by_key(|&i| std::cmp::Reverse(self.entities[i].scale));
        // Positions of the finest scale that has them are tips; those of coarser ones are bases.
        let tips = if parts.iter().any(|part| part.values.point.is_some()) {
            None
        } else {
            coarse
                .iter()
                .filter(|&&i| self.entities[i].values.point.is_some())
                .map(|&i| self.entities[i].scale)
                .max()
        };
        for i in coarse {
            let values = self.entities[i].values;
            if values == Values::default() {
                continue;
            }
            let mut chain = Vec::new();
            self.chain(i, &mut chain);
            let chain: Vec<usize> = chain.into_iter().filter_map(|entity| place[entity]).collect();
            let (Some(&first), Some(&last)) = (chain.first(), chain.last()) else { continue };
            let is_tip = tips == Some(self.entities[i].scale);
            if is_tip {
                parts[last].values.point = values.point;
            } else if parts[first].base.is_none() {
                parts[first].base = values.point;
            }
            let (top, bottom) = if values.point.is_some() && !is_tip {
                (None, values.top)
            } else {
                (values.top, values.bottom)
            };
            parts[last].values.top = parts[last].values.top.or(top);
            parts[first].values.bottom = parts[first].values.bottom.or(bottom);
            if let Some(length) =
                values.length.filter(|_| chain.iter().all(|&k| parts[k].values.length.is_none()))
            {
                for &k in &chain {
                    parts[k].values.length = Some(length / chain.len() as f64);
                    parts[k].shared = true;
                }
            }
        }
    }

    /// The wood along an entity's axis.
    fn chain(&self, entity: usize, wood: &mut Vec<usize>) {
        let Some(first) = self.first_part[entity] else { return wood.push(entity) };
        let mut part = Some(first);
        while let Some(entity) = part {
            self.chain(entity, wood);
            part = self.successor[entity];
        }
    }
}
