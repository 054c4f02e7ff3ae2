//! A node's inputs and attributes, as operators read them.

use std::cell::{Cell, RefCell};

use crate::proto;
use crate::spare::Spare;
use crate::tensor::{Kind, Tensor, Values};

/// A node while it is computed.
pub(crate) struct Call<'a> {
    /// Inputs; `None` where an optional one is left out.
    pub inputs: Vec<Option<&'a Tensor>>,
    pub attributes: &'a [proto::Attribute],
    /// Number of outputs that are asked for.
    pub outputs: usize,
    pub run: &'a Run,
    /// True if a `Relu` follows at once: the operator takes the positive parts itself.
    pub positive: bool,
}

/// Budget and spare memory of a run, which its nodes share.
pub(crate) struct Run {
    /// Work that may still be taken.
    pub budget: Cell<u64>,
    pub spare: RefCell<Spare>,
}

impl Run {
    pub fn new(spare: Spare) -> Self {
        Self { budget: Cell::new(WORK_MAX), spare: RefCell::new(spare) }
    }
}

/// Most products or elements that a run computes. Our own choice: a detector of images takes a thousandth of it for a small image, and a run
/// of so many takes some ten seconds.
pub(crate) const WORK_MAX: u64 = 1 << 34;

/// Outputs of an operator, or the reason why it has none.
pub(crate) type Done = Result<Vec<Tensor>, String>;

impl<'a> Call<'a> {
    /// Takes the work of so many products in all from the budget.
    pub fn spend(&self, factors: &[usize]) -> Result<(), String> {
        let work = factors.iter().try_fold(1_u64, |n, &f| n.checked_mul(f as u64));
        let left = work.and_then(|work| self.run.budget.get().checked_sub(work));
        self.run.budget.set(left.ok_or_else(|| format!("a run takes more than {WORK_MAX} products"))?);
        Ok(())
    }

    /// Memory for so many numbers; whatever stands in it is to be overwritten.
    pub fn take(&self, n: usize) -> Vec<f32> {
        self.run.spare.borrow_mut().take(n)
    }

    /// Gives memory back that `take` gave.
    pub fn give(&self, numbers: Vec<f32>) {
        self.run.spare.borrow_mut().give(numbers);
    }

    /// An input that must be there.
    pub fn input(&self, i: usize) -> Result<&'a Tensor, String> {
        self.optional(i).ok_or_else(|| format!("input {i} is missing"))
    }

    pub fn optional(&self, i: usize) -> Option<&'a Tensor> {
        self.inputs.get(i).copied().flatten()
    }

    /// An input of 32-bit numbers.
    pub fn numbers(&self, i: usize) -> Result<&'a [f32], String> {
        numbers(self.input(i)?, i)
    }

    /// An input of 32-bit numbers that has a stated length.
    pub fn numbers_of(&self, i: usize, length: usize) -> Result<&'a [f32], String> {
        let v = self.numbers(i)?;
        if v.len() == length {
            Ok(v)
        } else {
            Err(format!("input {i} has {} numbers, not {length}", v.len()))
        }
    }

    /// An input of whole numbers; `None` if it is left out.
    pub fn whole(&self, i: usize) -> Result<Option<&'a [i64]>, String> {
        match self.optional(i).map(|t| (t, t.values())) {
            None => Ok(None),
            Some((_, Values::I64(v))) => Ok(Some(v)),
            Some((t, _)) => Err(format!("input {i} is {}, not INT64", t.values().kind().name())),
        }
    }

    /// One number of an input, or a default where it is left out.
    pub fn number_or(&self, i: usize, default: f32) -> Result<f32, String> {
        match self.optional(i) {
            None => Ok(default),
            Some(_) => self.numbers_of(i, 1).map(|v| v[0]),
        }
    }

    fn attribute(&self, name: &str) -> Option<&'a proto::Attribute> {
        self.attributes.iter().find(|a| a.name == name)
    }

    pub fn int(&self, name: &str, default: i64) -> i64 {
        self.attribute(name).map_or(default, |a| a.i)
    }

    pub fn flag(&self, name: &str, default: bool) -> bool {
        self.int(name, i64::from(default)) != 0
    }

    pub fn float(&self, name: &str, default: f32) -> f32 {
        self.attribute(name).map_or(default, |a| a.f)
    }

    pub fn ints(&self, name: &str) -> Option<&'a [i64]> {
        self.attribute(name).map(|a| a.ints.as_slice())
    }

    pub fn text(&self, name: &str, default: &'static str) -> Result<&'a str, String> {
        let found = self.attribute(name).map(|a| str::from_utf8(&a.s));
        found.unwrap_or(Ok(default)).map_err(|_| format!("attribute {name} is not text"))
    }

    /// The only attribute of several that is set.
    pub fn only(&self, names: &[&'static str]) -> Result<&'a proto::Attribute, String> {
        let mut set = self.attributes.iter().filter(|a| names.contains(&a.name.as_str()));
        match (set.next(), set.next()) {
            (Some(one), None) => Ok(one),
            _ => Err(format!("it needs one of the attributes {}", names.join(", "))),
        }
    }

    /// Whole numbers that newer operators take as an input and older ones as an attribute.
    pub fn ints_of(&self, i: usize, name: &str) -> Result<Option<&'a [i64]>, String> {
        Ok(self.whole(i)?.or_else(|| self.ints(name)))
    }

    /// An axis as an index of a dimension; negative ones count from the end.
    pub fn axis(&self, default: i64, rank: usize) -> Result<usize, String> {
        axis(self.int("axis", default), rank)
    }
}

/// The 32-bit numbers of an array.
pub(crate) fn numbers(tensor: &Tensor, i: usize) -> Result<&[f32], String> {
    tensor
        .as_f32()
        .ok_or_else(|| format!("input {i} is {}, not {}", tensor.values().kind().name(), Kind::F32.name()))
}

/// An axis as an index of a dimension; negative ones count from the end.
pub(crate) fn axis(given: i64, rank: usize) -> Result<usize, String> {
    let from_start = if given < 0 { given.saturating_add(rank as i64) } else { given };
    let found = usize::try_from(from_start).ok().filter(|&a| a < rank);
    found.ok_or_else(|| format!("axis {given} is not one of {rank} dimensions"))
}

/// Axes as indices of dimensions, each once, in order.
pub(crate) fn axes(given: &[i64], rank: usize) -> Result<Vec<usize>, String> {
    let mut all = given.iter().map(|&a| axis(a, rank)).collect::<Result<Vec<_>, _>>()?;
    all.sort_unstable();
    if all.windows(2).any(|pair| pair[0] == pair[1]) {
        return Err(format!("axes {given:?} name a dimension twice"));
    }
    Ok(all)
}

/// A whole number as a length.
pub(crate) fn length(given: i64) -> Result<usize, String> {
    usize::try_from(given).map_err(|_| format!("{given} is not a length"))
}

/// One array as the only output.
pub(crate) fn one(tensor: Result<Tensor, String>) -> Done {
    tensor.map(|tensor| vec![tensor])
}
