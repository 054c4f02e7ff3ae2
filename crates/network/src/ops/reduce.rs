//! Operators that make one number of many. Sums run in 64 bits, in order.

use crate::call::{Call, Done, axes, axis, one};
use crate::tensor::{Tensor, Values, count, strides};

/// Reduces the axes that a node names; without any, all. A function turns each group of numbers into one.
fn reduce(call: &Call<'_>, of: impl Fn(&[f32]) -> f32) -> Done {
    let tensor = call.input(0)?;
    let rank = tensor.shape().len();
    let named = call.ints_of(1, "axes")?.filter(|named| !named.is_empty());
    let reduced = match named {
        Some(named) => axes(named, rank)?,
        None if call.flag("noop_with_empty_axes", false) => return Ok(vec![tensor.clone()]),
        None => (0..rank).collect(),
    };
    reduce_axes(tensor, call.numbers(0)?, &reduced, call.flag("keepdims", true), of)
}

fn reduce_axes(
    tensor: &Tensor,
    v: &[f32],
    reduced: &[usize],
    keep: bool,
    of: impl Fn(&[f32]) -> f32,
) -> Done {
    let (shape, steps) = (tensor.shape(), strides(tensor.shape()));
    let kept: Vec<usize> = (0..shape.len()).filter(|d| !reduced.contains(d)).collect();
    // Kept dimensions first: each group of numbers stands together.
    let order: Vec<usize> = kept.iter().chain(reduced).copied().collect();
    let turned_shape = order.iter().map(|&d| shape[d]).collect();
    let turned_steps: Vec<isize> = order.iter().map(|&d| steps[d]).collect();
    let is_in_order = order.is_sorted();
    let turned;
    let v = match is_in_order {
        true => v,
        false => {
            turned = tensor.strided(turned_shape, 0, &turned_steps)?;
            turned.as_f32().unwrap_or_default()
        }
    };
    let out_shape: Vec<usize> = match keep {
        true => (0..shape.len()).map(|d| if reduced.contains(&d) { 1 } else { shape[d] }).collect(),
        false => kept.iter().map(|&d| shape[d]).collect(),
    };
    let group: usize = reduced.iter().map(|&d| shape[d]).product();
    if group == 0 {
        return Err(format!("shape {shape:?} has nothing to reduce"));
    }
    count(&out_shape)?;
    one(Tensor::of(out_shape, Values::F32(v.chunks_exact(group).map(of).collect())))
}

fn sum_of(v: &[f32], f: impl Fn(f64) -> f64) -> f64 {
    v.iter().map(|&x| f(f64::from(x))).sum()
}

pub fn sum(call: &Call<'_>) -> Done {
    reduce(call, |v| sum_of(v, |x| x) as f32)
}

pub fn mean(call: &Call<'_>) -> Done {
    reduce(call, |v| (sum_of(v, |x| x) / v.len() as f64) as f32)
}

pub fn sum_square(call: &Call<'_>) -> Done {
    reduce(call, |v| sum_of(v, |x| x * x) as f32)
}

pub fn l1(call: &Call<'_>) -> Done {
    reduce(call, |v| sum_of(v, f64::abs) as f32)
}

pub fn l2(call: &Call<'_>) -> Done {
    reduce(call, |v| sum_of(v, |x| x * x).sqrt() as f32)
}

pub fn product(call: &Call<'_>) -> Done {
    reduce(call, |v| v.iter().map(|&x| f64::from(x)).product::<f64>() as f32)
}

pub fn max(call: &Call<'_>) -> Done {
    reduce(call, most)
}

pub fn min(call: &Call<'_>) -> Done {
    reduce(call, |v| {
        v.iter().copied().fold(f32::INFINITY, |least, x| if x < least || x.is_nan() { x } else { least })
    })
}

fn most(v: &[f32]) -> f32 {
    v.iter().copied().fold(f32::NEG_INFINITY, |most, x| if x > most || x.is_nan() { x } else { most })
}

/// The mean of each channel.
pub fn global_average(call: &Call<'_>) -> Done {
    global(call, |v| (sum_of(v, |x| x) / v.len() as f64) as f32)
}

/// The largest number of each channel.
pub fn global_max(call: &Call<'_>) -> Done {
    global(call, most)
}

fn global(call: &Call<'_>, of: impl Fn(&[f32]) -> f32) -> Done {
    let tensor = call.input(0)?;
    let spatial: Vec<usize> = (2..tensor.shape().len()).collect();
    reduce_axes(tensor, call.numbers(0)?, &spatial, true, of)
}

/// The index of the largest number along an axis.
pub fn arg_max(call: &Call<'_>) -> Done {
    extreme(call, |x, best| x > best)
}

/// The index of the smallest number along an axis.
pub fn arg_min(call: &Call<'_>) -> Done {
    extreme(call, |x, best| x < best)
}

fn extreme(call: &Call<'_>, better: impl Fn(f32, f32) -> bool) -> Done {
    let tensor = call.input(0)?;
    let d = axis(call.int("axis", 0), tensor.shape().len())?;
    let last = call.flag("select_last_index", false);
    let index = |v: &[f32]| {
        let mut best = 0;
        for (i, &x) in v.iter().enumerate() {
            if better(x, v[best]) || (last && x == v[best]) {
                best = i;
            }
        }
        best as f32
    };
    // An index is below 2^24, so that 32 bits hold it.
    let found = reduce_axes(tensor, call.numbers(0)?, &[d], call.flag("keepdims", true), index)?;
    let whole = found[0].as_f32().unwrap_or_default().iter().map(|&x| x as i64).collect();
    one(Tensor::of(found[0].shape().to_vec(), Values::I64(whole)))
}
