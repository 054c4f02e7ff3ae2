//! Pictures in another size.

use std::borrow::Cow;
use std::cmp::Reverse;

use crate::call::{Call, Done, length, one};
use crate::tensor::{Tensor, Values, count};

/// Scales each dimension by the nearest number or linearly between two.
pub fn resize(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let rank = tensor.shape().len();
    if call.ints("axes").is_some()
        || call.flag("antialias", false)
        || call.text("keep_aspect_ratio_policy", "stretch")? != "stretch"
    {
        return Err("axes, antialias and keep_aspect_ratio_policy are not supported".to_owned());
    }
    let given = |i: usize| call.optional(i).filter(|t| !t.values().is_empty());
    let (mut shape, mut scales) = (Vec::new(), Vec::new());
    if given(2).is_some() {
        for (&scale, &n) in call.numbers_of(2, rank)?.iter().zip(tensor.shape()) {
            let output = f64::from(scale) * n as f64;
            if !(0.0..1e9).contains(&output) || scale <= 0.0 {
                return Err(format!("scale {scale} is out of range"));
            }
            shape.push(output.floor() as usize);
            scales.push(f64::from(scale));
        }
    } else {
        let sizes =
            call.whole(3)?.filter(|sizes| sizes.len() == rank).ok_or("neither scales nor sizes are given")?;
        for (&size, &n) in sizes.iter().zip(tensor.shape()) {
            shape.push(length(size)?);
            scales.push(size as f64 / n as f64);
        }
    }
    count(&shape)?;
    let linear = match call.text("mode", "nearest")? {
        "nearest" => false,
        "linear" => true,
        other => return Err(format!("mode {other} is not supported")),
    };
    let nearest = call.text("nearest_mode", "round_prefer_floor")?;
    let transform = call.text("coordinate_transformation_mode", "half_pixel")?;
    let mut v = Cow::Borrowed(call.numbers(0)?);
    let mut now = tensor.shape().to_vec();
    let mut order: Vec<usize> = (0..rank).collect();
    if !linear {
        // Copies are the same in any order: first those that leave fewest numbers, then from the last dimension on, where they are single numbers.
        order.sort_by_key(|&d| (shape[d] > now[d], Reverse(d)));
    }
    for d in order {
        let (n, output) = (tensor.shape()[d], shape[d]);
        if n == output && scales[d] == 1.0 {
            continue;
        }
        if n == 0 {
            return Err("an empty array cannot be scaled".to_owned());
        }
        let place = |k: usize| {
            let (k, n, output) = (k as f64, n as f64, output as f64);
            Ok::<f64, String>(match transform {
                "half_pixel" => (k + 0.5) / scales[d] - 0.5,
                "pytorch_half_pixel" if output <= 1.0 => 0.0,
                "pytorch_half_pixel" => (k + 0.5) / scales[d] - 0.5,
                "asymmetric" => k / scales[d],
                "align_corners" if output <= 1.0 => 0.0,
                "align_corners" => k * (n - 1.0) / (output - 1.0),
                other => return Err(format!("coordinate_transformation_mode {other} is not supported")),
            })
        };
        let mut pairs = Vec::with_capacity(output);
        for k in 0..output {
            let at = place(k)?;
            let index = |x: f64| (x.max(0.0) as usize).min(n - 1);
            pairs.push(if linear {
                let low = at.floor();
                (index(low), index(low + 1.0), (at - low) as f32)
            } else {
                let whole = match nearest {
                    "round_prefer_floor" => (at - 0.5).ceil(),
                    "round_prefer_ceil" => (at + 0.5).floor(),
                    "floor" => at.floor(),
                    "ceil" => at.ceil(),
                    other => return Err(format!("nearest_mode {other} is not supported")),
                };
                (index(whole), index(whole), 0.0)
            });
        }
        let inner: usize = now[d + 1..].iter().product();
        now[d] = output;
        let mut scaled = call.take(count(&now)?);
        let blocks = v.chunks_exact((n * inner).max(1));
        for (block, scaled) in blocks.zip(scaled.chunks_exact_mut((output * inner).max(1))) {
            if inner == 1 && !linear {
                scaled.iter_mut().zip(&pairs).for_each(|(to, &(place, ..))| *to = block[place]);
                continue;
            }
            for (&(low, high, share), scaled) in pairs.iter().zip(scaled.chunks_exact_mut(inner.max(1))) {
                let (a, b) = (&block[low * inner..][..inner], &block[high * inner..][..inner]);
                match share {
                    0.0 => scaled.copy_from_slice(a),
                    _ => {
                        let mixed = a.iter().zip(b).map(|(a, b)| a * (1.0 - share) + b * share);
                        scaled.iter_mut().zip(mixed).for_each(|(to, x)| *to = x);
                    }
                }
            }
        }
        if let Cow::Owned(used) = std::mem::replace(&mut v, Cow::Owned(scaled)) {
            call.give(used);
        }
    }
    one(Tensor::of(shape, Values::F32(v.into_owned())))
}
