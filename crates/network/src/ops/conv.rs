//! Convolutions over one or two dimensions.

use crate::call::{Call, Done, length, one};
use crate::ops::product::{End, Right, Turned};
use crate::ops::window::{self, Layout};
use crate::tensor::{Tensor, Values, count};

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
    call.spend(&[n, depth])?;
    let image = rows.input * columns.input;
    if n == 0 || image * channels == 0 {
        return Err(format!("shape {:?} is empty", x.shape()));
    }
    let layout = Layout::new(axes);
    let plain = layout.is_plain();
    let at_once = if plain { rows.output } else { layout.at_once(channels) };
    let own_lines =
        if plain { image } else { count(&[channels, layout.lines(at_once), layout.line()])? / channels };
    let starts: Vec<usize> = (0..channels)
        .flat_map(|channel| layout.starts().map(move |start| channel * own_lines + start))
        .collect();
    let mut laid = call.take(if plain { 0 } else { channels * own_lines });
    let mut out = call.take(n);
    let own = outputs / group;
    let own_weights = |g: usize| Turned::new(&weights[g * own * depth..(g + 1) * own * depth], own, depth);
    let turned: Vec<Turned<'_>> = (0..group).map(own_weights).collect();
    let parts = input.chunks_exact(image * channels).zip(out.chunks_exact_mut(own * places));
    // Groups of all images, one after another.
    for (g, (input, out)) in parts.enumerate() {
        let g = g % group;
        let end = End { bias: bias.map(|bias| &bias[g * own..]), positive: call.positive };
        for top in (0..rows.output).step_by(at_once) {
            let height = at_once.min(rows.output - top);
            for (image, lines) in input.chunks_exact(image).zip(laid.chunks_exact_mut(own_lines)) {
                layout.lay(image, top, 0.0, lines);
            }
            let numbers = if plain { input } else { &laid };
            // Windows of one column and stride stand in one line from row to row.
            let (width, count) = match layout.step() == columns.output {
                true => (columns.output * height, 1),
                false => (columns.output, height),
            };
            let right = Right { numbers, starts: &starts, columns: width, count, step: layout.step() };
            turned[g].multiply(&right, &mut out[top * columns.output..], places, end);
        }
    }
    call.give(laid);
    one(Tensor::of(shape, Values::F32(out)))
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
