//! Normalisations and softmax. Means and variances are summed in 64 bits, in order.

use orchard_geometry::math;

use crate::call::{Call, Done, length, one};
use crate::tensor::{Tensor, Values};

/// Numbers less their mean, over the root of their variance.
fn standardise(v: &[f32], epsilon: f64, out: &mut Vec<f32>) {
    let n = v.len() as f64;
    let mean = v.iter().map(|&x| f64::from(x)).sum::<f64>() / n;
    let variance = v.iter().map(|&x| (f64::from(x) - mean) * (f64::from(x) - mean)).sum::<f64>() / n;
    let scale = 1.0 / (variance + epsilon).sqrt();
    out.extend(v.iter().map(|&x| ((f64::from(x) - mean) * scale) as f32));
}

fn epsilon(call: &Call<'_>) -> f64 {
    f64::from(call.float("epsilon", 1e-5))
}

/// The shape of batch x channels x ..., as numbers per channel.
fn channels<'a>(call: &Call<'a>) -> Result<(&'a Tensor, usize, usize), String> {
    let tensor = call.input(0)?;
    match tensor.shape() {
        [_, channels, rest @ ..] => Ok((tensor, *channels, rest.iter().product())),
        shape => Err(format!("shape {shape:?} has no channels")),
    }
}

pub fn batch(call: &Call<'_>) -> Done {
    if call.flag("training_mode", false) {
        return Err("training_mode is 1; export the model for inference".to_owned());
    }
    let (tensor, channels, size) = channels(call)?;
    let [scale, bias, mean, variance] = [1, 2, 3, 4].map(|i| call.numbers_of(i, channels));
    let (scale, bias, mean, variance) = (scale?, bias?, mean?, variance?);
    let epsilon = epsilon(call);
    let mut out = call.numbers(0)?.to_vec();
    for (i, part) in out.chunks_exact_mut(size.max(1)).enumerate() {
        let c = i % channels;
        let factor = f64::from(scale[c]) / (f64::from(variance[c]) + epsilon).sqrt();
        let offset = (f64::from(bias[c]) - f64::from(mean[c]) * factor) as f32;
        let factor = factor as f32;
        part.iter_mut().for_each(|x| *x = *x * factor + offset);
    }
    one(Tensor::of(tensor.shape().to_vec(), Values::F32(out)))
}

pub fn instance(call: &Call<'_>) -> Done {
    grouped(call, Ok)
}

pub fn group(call: &Call<'_>) -> Done {
    grouped(call, |_| length(call.int("num_groups", 0)))
}

fn grouped(call: &Call<'_>, groups: impl Fn(usize) -> Result<usize, String>) -> Done {
    let (tensor, channels, size) = channels(call)?;
    let groups = groups(channels)?;
    if groups == 0 || channels % groups != 0 || size == 0 {
        return Err(format!("shape {:?} cannot be split into {groups} groups", tensor.shape()));
    }
    let (scale, bias) = (call.numbers_of(1, channels)?, call.numbers_of(2, channels)?);
    let (v, mut out) = (call.numbers(0)?, Vec::new());
    for part in v.chunks_exact(channels / groups * size) {
        standardise(part, epsilon(call), &mut out);
    }
    for (i, part) in out.chunks_exact_mut(size).enumerate() {
        let c = i % channels;
        part.iter_mut().for_each(|x| *x = *x * scale[c] + bias[c]);
    }
    one(Tensor::of(tensor.shape().to_vec(), Values::F32(out)))
}

pub fn layer(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let axis = call.axis(-1, tensor.shape().len())?;
    let size: usize = tensor.shape()[axis..].iter().product();
    let scale = call.numbers_of(1, size)?;
    let bias = call.optional(2).map(|_| call.numbers_of(2, size)).transpose()?;
    let mut out = Vec::new();
    for part in call.numbers(0)?.chunks_exact(size.max(1)) {
        standardise(part, epsilon(call), &mut out);
    }
    for part in out.chunks_exact_mut(size.max(1)) {
        for (i, x) in part.iter_mut().enumerate() {
            *x = *x * scale[i] + bias.map_or(0.0, |bias| bias[i]);
        }
    }
    one(Tensor::of(tensor.shape().to_vec(), Values::F32(out)))
}

pub fn softmax(call: &Call<'_>) -> Done {
    along(call, |v| {
        let most = most(v);
        let powers: Vec<f64> = v.iter().map(|&x| math::exp(f64::from(x) - most)).collect();
        let sum: f64 = powers.iter().sum();
        powers.into_iter().map(|p| (p / sum) as f32).collect()
    })
}

pub fn log_softmax(call: &Call<'_>) -> Done {
    along(call, |v| {
        let most = most(v);
        let sum: f64 = v.iter().map(|&x| math::exp(f64::from(x) - most)).sum();
        let log = math::ln(sum);
        v.iter().map(|&x| (f64::from(x) - most - log) as f32).collect()
    })
}

fn most(v: &[f32]) -> f64 {
    f64::from(v.iter().copied().fold(f32::NEG_INFINITY, |most, x| if x > most { x } else { most }))
}

/// Applies a function to the numbers along an axis, for every index of the others.
fn along(call: &Call<'_>, f: impl Fn(&[f32]) -> Vec<f32>) -> Done {
    let tensor = call.input(0)?;
    let shape = tensor.shape();
    let axis = call.axis(-1, shape.len())?;
    let (n, inner): (usize, usize) = (shape[axis], shape[axis + 1..].iter().product());
    let mut out = call.numbers(0)?.to_vec();
    for block in out.chunks_exact_mut((n * inner).max(1)) {
        for i in 0..inner {
            let line: Vec<f32> = block[i..].iter().step_by(inner).copied().collect();
            for (x, y) in block[i..].iter_mut().step_by(inner).zip(f(&line)) {
                *x = y;
            }
        }
    }
    one(Tensor::of(shape.to_vec(), Values::F32(out)))
}
