//! Operators that give the same numbers in another shape or order, and those that make arrays.

use crate::call::{Call, Done, axes, axis, length, one};
use crate::read;
use crate::tensor::{Kind, Tensor, Values, count, each, spread, spread_strides, strides};

/// The numbers in a stated shape: 0 keeps a length, -1 stands for what is left.
pub fn reshape(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let wanted = call.whole(1)?.ok_or("input 1 is missing")?;
    let keep_zero = call.flag("allowzero", false);
    let mut shape = Vec::new();
    for (i, &d) in wanted.iter().enumerate() {
        shape.push(match d {
            -1 => 1,
            0 if !keep_zero => {
                *tensor.shape().get(i).ok_or("a length 0 stands where the input has no dimension")?
            }
            d => length(d)?,
        });
    }
    let open: Vec<usize> = (0..wanted.len()).filter(|&i| wanted[i] == -1).collect();
    if let &[i] = open.as_slice() {
        let rest = count(&shape)?;
        shape[i] = tensor.values().len().checked_div(rest).unwrap_or(0);
    } else if open.len() > 1 {
        return Err(format!("shape {wanted:?} leaves several lengths open"));
    }
    one(tensor.reshaped(shape))
}

pub fn flatten(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let rank = tensor.shape().len();
    let at = match call.int("axis", 1) {
        a if a == rank as i64 => rank,
        a => axis(a, rank)?,
    };
    let (first, second) = tensor.shape().split_at(at);
    one(tensor.reshaped(vec![first.iter().product(), second.iter().product()]))
}

pub fn squeeze(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let shape = tensor.shape();
    let gone = match call.whole(1)? {
        Some(named) => axes(named, shape.len())?,
        None => (0..shape.len()).filter(|&d| shape[d] == 1).collect(),
    };
    if let Some(&d) = gone.iter().find(|&&d| shape[d] != 1) {
        return Err(format!("dimension {d} of shape {shape:?} is not 1"));
    }
    one(tensor.reshaped((0..shape.len()).filter(|d| !gone.contains(d)).map(|d| shape[d]).collect()))
}

pub fn unsqueeze(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let named = call.whole(1)?.ok_or("input 1 is missing")?;
    let rank = tensor.shape().len() + named.len();
    let new = axes(named, rank)?;
    let mut old = tensor.shape().iter().copied();
    let shape = (0..rank).map(|d| if new.contains(&d) { 1 } else { old.next().unwrap_or(1) }).collect();
    one(tensor.reshaped(shape))
}

pub fn transpose(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let (shape, steps) = (tensor.shape(), strides(tensor.shape()));
    let order: Vec<usize> = match call.ints("perm") {
        None => (0..shape.len()).rev().collect(),
        Some(perm) => {
            let order = perm.iter().map(|&d| axis(d, shape.len())).collect::<Result<Vec<_>, _>>()?;
            if order.len() != shape.len() || axes(perm, shape.len()).is_err() {
                return Err(format!("perm {perm:?} does not order {} dimensions", shape.len()));
            }
            order
        }
    };
    let turned: Vec<isize> = order.iter().map(|&d| steps[d]).collect();
    one(tensor.strided(order.iter().map(|&d| shape[d]).collect(), 0, &turned))
}

pub fn expand(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let wanted = call.whole(1)?.ok_or("input 1 is missing")?;
    let wanted = wanted.iter().map(|&d| length(d)).collect::<Result<Vec<_>, _>>()?;
    let shape = spread(tensor.shape(), &wanted)?;
    let steps = spread_strides(tensor.shape(), &shape);
    one(tensor.strided(shape, 0, &steps))
}

pub fn tile(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let repeats = call.whole(1)?.ok_or("input 1 is missing")?;
    if repeats.len() != tensor.shape().len() {
        return Err(format!("{} repeats are given for shape {:?}", repeats.len(), tensor.shape()));
    }
    let mut result = tensor.clone();
    for (d, &n) in repeats.iter().enumerate() {
        let mut shape = result.shape().to_vec();
        shape[d] = shape[d].checked_mul(length(n)?).ok_or("the array is too large")?;
        count(&shape)?;
        result = joined(call, &vec![&result; length(n)?], d, shape)?;
    }
    Ok(vec![result])
}

pub fn concat(call: &Call<'_>) -> Done {
    let parts = (0..call.inputs.len()).map(|i| call.input(i)).collect::<Result<Vec<_>, _>>()?;
    let first = *parts.first().ok_or("there is no input")?;
    let d = axis(call.int("axis", 0), first.shape().len())?;
    let mut shape = first.shape().to_vec();
    shape[d] = 0;
    for part in &parts {
        let fits = part.shape().len() == shape.len()
            && (0..shape.len()).all(|i| i == d || part.shape()[i] == shape[i]);
        if !fits || part.values().kind() != first.values().kind() {
            return Err(format!(
                "{:?} cannot be joined to {:?} along dimension {d}",
                part.shape(),
                first.shape()
            ));
        }
        shape[d] += part.shape()[d];
    }
    one(joined(call, &parts, d, shape))
}

/// Arrays of one type joined along a dimension.
fn joined(call: &Call<'_>, parts: &[&Tensor], d: usize, shape: Vec<usize>) -> Result<Tensor, String> {
    let mut out = match parts.first().map_or(Kind::F32, |part| part.values().kind()) {
        Kind::F32 => Tensor::of(shape.clone(), Values::F32(call.take(count(&shape)?)))?,
        other => Tensor::zeros(shape.clone(), other)?,
    };
    let whole: usize = shape[d..].iter().product();
    let mut at = 0;
    for part in parts {
        let own: usize = part.shape()[d..].iter().product();
        out.write(part, own, whole, at);
        at += own;
    }
    Ok(out)
}

pub fn split(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let d = axis(call.int("axis", 0), tensor.shape().len())?;
    let whole = tensor.shape()[d];
    let sizes = match call.whole(1)? {
        Some(sizes) => sizes.iter().map(|&n| length(n)).collect::<Result<Vec<_>, _>>()?,
        None => {
            let n = length(call.int("num_outputs", call.outputs as i64))?;
            let each = whole.div_ceil(n.max(1));
            (0..n).map(|i| each.min(whole.saturating_sub(i * each))).collect()
        }
    };
    if sizes.iter().try_fold(0_usize, |sum, &n| sum.checked_add(n)) != Some(whole) {
        return Err(format!("parts {sizes:?} do not make up dimension {d} of shape {:?}", tensor.shape()));
    }
    let steps = strides(tensor.shape());
    let mut start = 0;
    let part = |&n: &usize| {
        let mut shape = tensor.shape().to_vec();
        shape[d] = n;
        let part = tensor.strided(shape, start * steps[d] as usize, &steps);
        start += n;
        part
    };
    sizes.iter().map(part).collect()
}

pub fn slice(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let rank = tensor.shape().len();
    let list = |i: usize| call.whole(i).and_then(|v| v.ok_or_else(|| format!("input {i} is missing")));
    let (starts, ends) = (list(1)?, list(2)?);
    let all: Vec<i64> = (0..starts.len() as i64).collect();
    let named = call.whole(3)?.unwrap_or(&all);
    let ones = vec![1; starts.len()];
    let by = call.whole(4)?.unwrap_or(&ones);
    if [ends.len(), named.len(), by.len()].iter().any(|&n| n != starts.len()) {
        return Err("starts, ends, axes and steps have different lengths".to_owned());
    }
    axes(named, rank)?;
    let (mut shape, mut steps, mut base) = (tensor.shape().to_vec(), strides(tensor.shape()), 0);
    for i in 0..starts.len() {
        let d = axis(named[i], rank)?;
        let (n, step) = (shape[d] as i64, by[i]);
        if step == 0 {
            return Err("a step is 0".to_owned());
        }
        // Negative places count from the end; places beyond the ends are those of the ends.
        let from_start = |place: i64| if place < 0 { place.saturating_add(n) } else { place };
        let (low, high) = if step > 0 { (0, n) } else { (-1, n - 1) };
        let start = from_start(starts[i]).clamp(low.max(0).min(high.max(0)), high.max(0));
        let end = from_start(ends[i]).clamp(low, high.max(low));
        let span = if step > 0 { end - start } else { start - end };
        let taken = if n == 0 || span <= 0 { 0 } else { (span - 1) / step.saturating_abs() + 1 };
        if taken > 0 {
            base += start as usize * steps[d] as usize;
        }
        shape[d] = taken as usize;
        // A step over the whole dimension takes one number only.
        steps[d] = if taken > 1 { steps[d] * step as isize } else { 0 };
    }
    one(tensor.strided(shape, base, &steps))
}

/// The shape of an array, or a part of it.
pub fn shape(call: &Call<'_>) -> Done {
    let shape = call.input(0)?.shape();
    let rank = shape.len() as i64;
    let place = |at: i64| if at < 0 { at.saturating_add(rank) } else { at }.clamp(0, rank) as usize;
    let (start, end) = (place(call.int("start", 0)), place(call.int("end", rank)));
    let taken: Vec<i64> = shape.get(start..end).unwrap_or_default().iter().map(|&d| d as i64).collect();
    one(Tensor::of(vec![taken.len()], Values::I64(taken)))
}

pub fn size(call: &Call<'_>) -> Done {
    one(Tensor::of(vec![], Values::I64(vec![call.input(0)?.values().len() as i64])))
}

pub fn constant(call: &Call<'_>) -> Done {
    let given = call.only(&["value", "value_float", "value_floats", "value_int", "value_ints"])?;
    let (floats, ints) = (given.floats.clone(), given.ints.clone());
    one(match given.name.as_str() {
        "value" => read::tensor(given.t.clone().ok_or("value is no array")?),
        "value_float" => Tensor::of(vec![], Values::F32(vec![given.f])),
        "value_floats" => Tensor::of(vec![floats.len()], Values::F32(floats)),
        "value_int" => Tensor::of(vec![], Values::I64(vec![given.i])),
        _ => Tensor::of(vec![ints.len()], Values::I64(ints)),
    })
}

/// One number in a stated shape.
pub fn filled(call: &Call<'_>) -> Done {
    let shape = call.whole(0)?.ok_or("input 0 is missing")?;
    let shape = shape.iter().map(|&d| length(d)).collect::<Result<Vec<_>, _>>()?;
    let value = match call.attributes.iter().find(|a| a.name == "value").and_then(|a| a.t.clone()) {
        Some(value) => read::tensor(value)?,
        None => Tensor::of(vec![], Values::F32(vec![0.0]))?,
    };
    if value.values().len() != 1 {
        return Err("value is not one number".to_owned());
    }
    let still = vec![0; shape.len()];
    one(value.strided(shape, 0, &still))
}

/// Numbers from a start to a limit by a step.
pub fn range(call: &Call<'_>) -> Done {
    if let (Some(a), Some(b), Some(by)) = (call.optional(0), call.optional(1), call.optional(2))
        && let (Values::I64(a), Values::I64(b), Values::I64(by)) = (a.values(), b.values(), by.values())
        && let (&[a], &[b], &[by]) = (a.as_slice(), b.as_slice(), by.as_slice())
    {
        let n = (i128::from(b) - i128::from(a)).checked_div(i128::from(by)).ok_or("the step is 0")?;
        let ragged = (i128::from(b) - i128::from(a)) % i128::from(by) != 0 && n >= 0;
        let ahead = (b > a) == (by > 0) && a != b;
        let n = if ahead {
            usize::try_from(n).unwrap_or(usize::MAX).saturating_add(usize::from(ragged))
        } else {
            0
        };
        count(&[n])?;
        let v = (0..n as i64).map(|i| a.wrapping_add(i.wrapping_mul(by))).collect();
        return one(Tensor::of(vec![n], Values::I64(v)));
    }
    let [a, b, by] = [call.numbers_of(0, 1)?[0], call.numbers_of(1, 1)?[0], call.numbers_of(2, 1)?[0]];
    let n = ((f64::from(b) - f64::from(a)) / f64::from(by)).ceil();
    if n.is_nan() || n > 1e9 {
        return Err(format!("from {a} to {b} by {by} is no range"));
    }
    let n = n.max(0.0) as usize;
    count(&[n])?;
    let v = (0..n).map(|i| (f64::from(a) + i as f64 * f64::from(by)) as f32).collect();
    one(Tensor::of(vec![n], Values::F32(v)))
}

/// Numbers around an array: a constant, the border's, or the array mirrored at its border.
pub fn pad(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let rank = tensor.shape().len();
    let all: Vec<i64> = (0..rank as i64).collect();
    let named = call.whole(3)?.unwrap_or(&all);
    let pads = call.whole(1)?.filter(|pads| pads.len() == 2 * named.len());
    let pads = pads.ok_or("the pads are not two for each dimension")?;
    let mode = call.text("mode", "constant")?;
    let mut result = tensor.clone();
    let mut value = None;
    if mode == "constant" {
        let given = call.optional(2).filter(|t| t.values().len() == 1);
        value = Some(match given {
            Some(given) => given.clone(),
            None => Tensor::zeros(vec![], tensor.values().kind())?,
        });
    }
    for (i, &d) in named.iter().enumerate() {
        let d = axis(d, rank)?;
        let (n, before, after) = (result.shape()[d] as i64, pads[i], pads[i + named.len()]);
        let whole = n.checked_add(before).and_then(|sum| sum.checked_add(after)).filter(|&whole| whole >= 0);
        let mut shape = result.shape().to_vec();
        shape[d] = length(whole.ok_or("the pads take away more than there is")?)?;
        count(&shape)?;
        let place = |k: i64| {
            let at = k.saturating_sub(before);
            match mode {
                "edge" => Some(at.max(0).min(n - 1)),
                "reflect" if at < 0 => at.checked_neg(),
                "reflect" if at >= n => (2 * (n - 1)).checked_sub(at),
                _ => Some(at),
            }
            .filter(|at| (0..n).contains(at))
        };
        let places: Vec<Option<usize>> =
            (0..shape[d] as i64).map(|k| place(k).map(|at| at as usize)).collect();
        if !["constant", "edge", "reflect"].contains(&mode) {
            return Err(format!("mode {mode} is not supported"));
        }
        if value.is_none() && places.contains(&None) {
            return Err(format!("mode {mode} cannot fill pads wider than the array"));
        }
        result = taken(&result, d, &places, shape, value.as_ref())?;
    }
    Ok(vec![result])
}

/// Numbers at places along a dimension; a value stands where there is no place.
fn taken(
    tensor: &Tensor,
    d: usize,
    places: &[Option<usize>],
    shape: Vec<usize>,
    value: Option<&Tensor>,
) -> Result<Tensor, String> {
    let (n, inner): (usize, usize) = (tensor.shape()[d], tensor.shape()[d + 1..].iter().product());
    let outer: usize = tensor.shape()[..d].iter().product();
    if value.is_some_and(|value| value.values().kind() != tensor.values().kind()) {
        return Err("the constant is of another type than the array".to_owned());
    }
    // The value, or any number where it is never used.
    let rest = value.map(|value| value.values().clone());
    fn walk<T: Copy>(
        v: &[T],
        rest: Option<T>,
        outer: usize,
        n: usize,
        inner: usize,
        places: &[Option<usize>],
    ) -> Vec<T> {
        let mut out = Vec::with_capacity(outer * places.len() * inner);
        for o in 0..outer {
            for place in places {
                match (place, rest) {
                    (Some(i), _) => out.extend_from_slice(&v[(o * n + i) * inner..][..inner]),
                    (None, Some(rest)) => out.extend(std::iter::repeat_n(rest, inner)),
                    (None, None) => {}
                }
            }
        }
        out
    }
    let values = match (tensor.values(), &rest) {
        (Values::F32(v), Some(Values::F32(r))) => {
            Values::F32(walk(v, r.first().copied(), outer, n, inner, places))
        }
        (Values::I64(v), Some(Values::I64(r))) => {
            Values::I64(walk(v, r.first().copied(), outer, n, inner, places))
        }
        (other, _) => each!(other, v => walk(v, v.first().copied(), outer, n, inner, places)),
    };
    Tensor::of(shape, values)
}

/// Parts of an array by their places along a dimension.
pub fn gather(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let d = axis(call.int("axis", 0), tensor.shape().len())?;
    let indices = call.whole(1)?.ok_or("input 1 is missing")?;
    let n = tensor.shape()[d];
    let places =
        indices.iter().map(|&i| axis(i, n).map(Some).map_err(|_| format!("index {i} is beyond {n} places")));
    let places = places.collect::<Result<Vec<_>, _>>()?;
    let mut shape = tensor.shape()[..d].to_vec();
    shape.extend(call.input(1)?.shape());
    shape.extend(&tensor.shape()[d + 1..]);
    count(&shape)?;
    one(taken(tensor, d, &places, shape, None))
}

/// Numbers of an array, each by its place along a dimension.
pub fn gather_elements(call: &Call<'_>) -> Done {
    let (tensor, index) = (call.input(0)?, call.input(1)?);
    let d = axis(call.int("axis", 0), tensor.shape().len())?;
    let indices = call.whole(1)?.ok_or("input 1 is missing")?;
    let shape = index.shape();
    let fits = shape.len() == tensor.shape().len()
        && (0..shape.len()).all(|k| k == d || shape[k] <= tensor.shape()[k]);
    if !fits {
        return Err(format!("indices {shape:?} do not fit shape {:?}", tensor.shape()));
    }
    let (own, steps, n) = (strides(shape), strides(tensor.shape()), tensor.shape()[d]);
    let place = |(k, &i): (usize, &i64)| {
        let mut at = axis(i, n).map_err(|_| format!("index {i} is beyond {n} places"))? * steps[d] as usize;
        for e in (0..shape.len()).filter(|&e| e != d) {
            at += (k / own[e] as usize % shape[e]) * steps[e] as usize;
        }
        Ok(at)
    };
    let places = indices.iter().enumerate().map(place).collect::<Result<Vec<usize>, String>>()?;
    let values = each!(tensor.values(), v => places.iter().map(|&at| v[at]).collect());
    one(Tensor::of(shape.to_vec(), values))
}

/// Channels as pixels: each block of channels becomes a square of pixels.
pub fn depth_to_space(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let &[n, c, h, w] = tensor.shape() else { return Err("the input must have 4 dimensions".to_owned()) };
    let b = length(call.int("blocksize", 0))?;
    let squares = b.checked_mul(b).filter(|&squares| squares > 0 && c % squares == 0);
    let out = c / squares.ok_or_else(|| format!("{c} channels are no blocks of {b} x {b}"))?;
    let (parts, order) = match call.text("mode", "DCR")? {
        "DCR" => ([n, b, b, out, h, w], [0, 3, 4, 1, 5, 2]),
        "CRD" => ([n, out, b, b, h, w], [0, 1, 4, 2, 5, 3]),
        other => return Err(format!("mode {other} is not supported")),
    };
    let steps = strides(&parts);
    let turned = tensor.strided(order.map(|d| parts[d]).to_vec(), 0, &order.map(|d| steps[d]))?;
    one(turned.reshaped(vec![n, out, h * b, w * b]))
}
