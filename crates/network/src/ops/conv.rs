//! Convolutions over one or two dimensions.

use crate::call::{Call, Done, length, one};
use crate::ops::product::{Sizes, Turned};
use crate::ops::window::{self, Axis};
use crate::tensor::{Tensor, Values, count};

/// Numbers under the windows of one piece of the output: 256 kB stay in the cache.
const PIECE: usize = 1 << 16;

/// Each output is the sum over channels, rows and columns of the window, in this order; then the bias is added.
pub fn conv(call: &Call<'_>) -> Done {
    let (x, w) = (call.input(0)?, call.input(1)?);
    let (input, weights) = (call.numbers(0)?, call.numbers(1)?);
    let kernel = w.shape().get(2..).unwrap_or_default();
    if let Some(stated) = call.ints("kernel_shape")
        && !stated.iter().copied().eq(kernel.iter().map(|&k| k as i64))
    {
        return Err(format!("kernel_shape {stated:?} is not that of weights of shape {:?}", w.shape()));
    }
    let axes = window::axes(call, x.shape(), kernel)?;
    let (group, outputs) = (length(call.int("group", 1))?, w.shape()[0]);
    let channels = w.shape()[1];
    if group == 0 || outputs % group != 0 || Some(x.shape()[1]) != channels.checked_mul(group) {
        return Err(format!(
            "{:?} and weights {:?} do not fit together in {group} groups",
            x.shape(),
            w.shape()
        ));
    }
    let bias = call.optional(2).map(|_| call.numbers_of(2, outputs)).transpose()?;
    let shape = window::shape(x.shape(), outputs, &axes);
    let [rows, columns] = axes;
    let (depth, places) = (channels * rows.kernel * columns.kernel, rows.output * columns.output);
    let n = count(&shape)?;
    count(&[depth, columns.output])?;
    call.spend(&[n, depth])?;
    let mut out = vec![0.0_f32; n];
    let own = outputs / group;
    let at_once = (PIECE / (depth * columns.output).max(1)).clamp(1, rows.output.max(1));
    let mut under = vec![0.0_f32; depth * at_once * columns.output];
    let image = channels * rows.input * columns.input;
    if n == 0 || image == 0 {
        return Err(format!("shape {:?} is empty", x.shape()));
    }
    let own_weights = |g: usize| Turned::new(&weights[g * own * depth..(g + 1) * own * depth], own, depth);
    let turned: Vec<Turned<'_>> = (0..group).map(own_weights).collect();
    // Groups of all images, one after another.
    for (g, (input, out)) in input.chunks_exact(image).zip(out.chunks_exact_mut(own * places)).enumerate() {
        let first = (g % group) * own;
        for top in (0..rows.output).step_by(at_once) {
            let height = at_once.min(rows.output - top);
            let width = height * columns.output;
            unfold(input, &mut under, [rows, columns], channels, top, height);
            let sizes = Sizes { rows: own, depth, columns: width, stride: places };
            turned[g % group].multiply(&under[..depth * width], &mut out[top * columns.output..], sizes);
        }
        for (row, bias) in out.chunks_exact_mut(places).zip(bias.into_iter().flat_map(|bias| &bias[first..]))
        {
            row.iter_mut().for_each(|x| *x += bias);
        }
    }
    one(Tensor::of(shape, Values::F32(out)))
}

/// Writes the numbers under the windows of some rows of the output: a row for each place of the window, zeros beside the input.
fn unfold(
    input: &[f32],
    under: &mut [f32],
    [rows, columns]: [Axis; 2],
    channels: usize,
    top: usize,
    height: usize,
) {
    let width = columns.output;
    let mut lines = under.chunks_exact_mut(width);
    for channel in 0..channels {
        let image = &input[channel * rows.input * columns.input..][..rows.input * columns.input];
        for ky in 0..rows.kernel {
            for kx in 0..columns.kernel {
                for y in top..top + height {
                    let Some(line) = lines.next() else { return };
                    match rows.place(y, ky) {
                        None => line.fill(0.0),
                        Some(v) => {
                            copy_line(&image[v * columns.input..][..columns.input], line, &columns, kx)
                        }
                    }
                }
            }
        }
    }
}

fn copy_line(from: &[f32], line: &mut [f32], columns: &Axis, kx: usize) {
    let (shift, pad, n) = (kx * columns.dilation, columns.pads[0], line.len());
    // Windows from `first` to `end` have this place within the input.
    let first = pad.saturating_sub(shift).div_ceil(columns.stride).min(n);
    let end = (columns.input + pad).saturating_sub(shift).div_ceil(columns.stride).min(n).max(first);
    line[..first].fill(0.0);
    line[end..].fill(0.0);
    if first == end {
        return;
    }
    let from = &from[first * columns.stride + shift - pad..];
    match columns.stride {
        1 => line[first..end].copy_from_slice(&from[..end - first]),
        2 => spread_pairs(from, &mut line[first..end]),
        stride => {
            line[first..end].iter_mut().zip(from.iter().step_by(stride)).for_each(|(to, &x)| *to = x);
        }
    }
}

/// Writes every second number, from the first on.
fn spread_pairs(from: &[f32], line: &mut [f32]) {
    let (pairs, rest) = from.as_chunks::<2>();
    let firsts = pairs.iter().map(|[x, _]| x).chain(rest);
    line.iter_mut().zip(firsts).for_each(|(to, &x)| *to = x);
}

/// The transpose of a convolution: every input spreads the weights over the output, input channels in order.
pub fn conv_transpose(call: &Call<'_>) -> Done {
    let (x, w) = (call.input(0)?, call.input(1)?);
    let (input, weights) = (call.numbers(0)?, call.numbers(1)?);
    let kernel = w.shape().get(2..).unwrap_or_default();
    let n = kernel.len();
    if x.shape().len() != n + 2 || !(1..=2).contains(&n) || call.ints("output_shape").is_some() {
        return Err(format!("an input of shape {:?}, or an output_shape, is not supported", x.shape()));
    }
    if call.text("auto_pad", "NOTSET")? != "NOTSET" {
        return Err("auto_pad is not supported".to_owned());
    }
    let list = |name: &str, default: usize, count: usize| -> Result<Vec<usize>, String> {
        let Some(v) = call.ints(name) else { return Ok(vec![default; count]) };
        let v = v.iter().map(|&v| length(v)).collect::<Result<Vec<_>, _>>()?;
        let fits = v.len() == count && v.iter().all(|&x| x <= LENGTH_MAX);
        if fits { Ok(v) } else { Err(format!("attribute {name} does not fit")) }
    };
    let (strides, dilations) = (list("strides", 1, n)?, list("dilations", 1, n)?);
    let (pads, more) = (list("pads", 0, 2 * n)?, list("output_padding", 0, n)?);
    let mut sizes = [[1_usize, 1, 1, 1, 1, 0]; 2];
    for i in 0..n {
        let (input, kernel) = (x.shape()[i + 2], kernel[i]);
        if input == 0 || kernel == 0 {
            return Err("an empty input or window is not supported".to_owned());
        }
        count(&[input, strides[i]])?;
        count(&[kernel, dilations[i]])?;
        let whole = (input - 1) * strides[i] + (kernel - 1) * dilations[i] + 1 + more[i];
        let output = whole.checked_sub(pads[i] + pads[i + n]).filter(|&output| output > 0);
        let output = output.ok_or("the pads are larger than the output")?;
        sizes[2 - n + i] = [input, kernel, output, strides[i], dilations[i], pads[i]];
    }
    let (group, channels, per_group) = (length(call.int("group", 1))?, x.shape()[1], w.shape()[1]);
    if group == 0 || channels % group != 0 || w.shape()[0] != channels {
        return Err(format!(
            "{:?} and weights {:?} do not fit together in {group} groups",
            x.shape(),
            w.shape()
        ));
    }
    let outputs = per_group.checked_mul(group).ok_or("too many channels")?;
    let bias = call.optional(2).map(|_| call.numbers_of(2, outputs)).transpose()?;
    let [[ih, kh, oh, sh, dh, ph], [iw, kw, ow, sw, dw, pw]] = sizes;
    let mut shape = vec![x.shape()[0], outputs];
    shape.extend([oh, ow][2 - n..].iter());
    let mut out = vec![0.0_f32; count(&shape)?];
    call.spend(&[input.len(), per_group, kh, kw])?;
    let (own, image) = (channels / group, ih * iw);
    for (i, image) in input.chunks_exact(image).enumerate() {
        let (batch, channel) = (i / channels, i % channels);
        for o in 0..per_group {
            let target = (batch * outputs + (channel / own) * per_group + o) * oh * ow;
            let target = &mut out[target..target + oh * ow];
            let weights = &weights[(channel * per_group + o) * kh * kw..][..kh * kw];
            for (ky, weights) in weights.chunks_exact(kw).enumerate() {
                for (y, line) in image.chunks_exact(iw).enumerate() {
                    let Some(v) = (y * sh + ky * dh).checked_sub(ph).filter(|&v| v < oh) else { continue };
                    for (kx, &weight) in weights.iter().enumerate() {
                        for (x, &value) in line.iter().enumerate() {
                            if let Some(u) = (x * sw + kx * dw).checked_sub(pw).filter(|&u| u < ow) {
                                target[v * ow + u] += weight * value;
                            }
                        }
                    }
                }
            }
        }
    }
    for (row, bias) in
        out.chunks_exact_mut((oh * ow).max(1)).zip(bias.into_iter().flat_map(|bias| bias.iter().cycle()))
    {
        row.iter_mut().for_each(|x| *x += bias);
    }
    one(Tensor::of(shape, Values::F32(out)))
}

/// Largest stride, dilation or pad. Our own choice.
const LENGTH_MAX: usize = 1 << 20;
