//! Windows that slide over one or two dimensions: sizes and pads of convolutions and poolings.

use crate::call::{Call, length};

/// A window along one dimension.
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    /// Length of the input, of the window and of the output.
    pub input: usize,
    pub kernel: usize,
    pub output: usize,
    pub stride: usize,
    pub dilation: usize,
    /// Places before the first and behind the last of the input that windows may cover.
    pub pads: [usize; 2],
}

impl Axis {
    /// The place in the input under a place of the window; `None` beside the input.
    pub fn place(&self, output: usize, kernel: usize) -> Option<usize> {
        (output * self.stride + kernel * self.dilation).checked_sub(self.pads[0]).filter(|&i| i < self.input)
    }

    /// True if a place of the window is within the input and its pads.
    pub fn is_padded(&self, output: usize, kernel: usize) -> bool {
        output * self.stride + kernel * self.dilation < self.input + self.pads[0] + self.pads[1]
    }
}

/// The windows of a node over an input of shape batch x channels x length, or batch x channels x height x width; one of a single dimension gets
/// a height of 1.
pub fn axes(call: &Call<'_>, shape: &[usize], kernel: &[usize]) -> Result<[Axis; 2], String> {
    let n = kernel.len();
    if shape.len() != n + 2 || !(1..=2).contains(&n) {
        return Err(format!("an input of shape {shape:?} is not supported: it must have 3 or 4 dimensions"));
    }
    let list = |name: &str, default: i64, count: usize| match call.ints(name) {
        None => Ok(vec![length(default)?; count]),
        Some(v) if v.len() == count => v.iter().map(|&v| length(v)).collect::<Result<Vec<_>, _>>(),
        Some(v) => Err(format!("attribute {name} has {} numbers, not {count}", v.len())),
    };
    let (strides, dilations) = (list("strides", 1, n)?, list("dilations", 1, n)?);
    let pads = list("pads", 0, 2 * n)?;
    let auto = call.text("auto_pad", "NOTSET")?;
    let (ceil, mut all) = (call.flag("ceil_mode", false), [ONE; 2]);
    for i in 0..n {
        let (input, kernel, stride, dilation) = (shape[i + 2], kernel[i], strides[i], dilations[i]);
        if [kernel, stride, dilation].contains(&0)
            || [input, kernel, stride, dilation, pads[i], pads[i + n]].iter().any(|&x| x > LENGTH_MAX)
        {
            return Err("a window, stride, dilation or pad is out of range".to_owned());
        }
        let reach = (kernel - 1) * dilation + 1;
        let pads = match auto {
            "NOTSET" => [pads[i], pads[i + n]],
            "VALID" => [0, 0],
            "SAME_UPPER" | "SAME_LOWER" => {
                let output = input.div_ceil(stride);
                let both = ((output.max(1) - 1) * stride + reach).saturating_sub(input);
                let (less, more) = (both / 2, both - both / 2);
                if auto == "SAME_UPPER" { [less, more] } else { [more, less] }
            }
            other => return Err(format!("auto_pad {other} is not supported")),
        };
        let room = (input + pads[0] + pads[1]).checked_sub(reach);
        let room = room.ok_or_else(|| format!("the window is larger than the input, {input}"))?;
        let mut output = if ceil { room.div_ceil(stride) } else { room / stride } + 1;
        // The last window begins within the input or the pad before it.
        if ceil && (output - 1) * stride >= input + pads[0] {
            output -= 1;
        }
        all[2 - n + i] = Axis { input, kernel, output, stride, dilation, pads };
    }
    Ok(all)
}

/// The height of an input that has none.
const ONE: Axis = Axis { input: 1, kernel: 1, output: 1, stride: 1, dilation: 1, pads: [0; 2] };

/// Largest length, stride or pad. Our own choice.
const LENGTH_MAX: usize = 1 << 20;

/// The shape of an output with these windows.
pub fn shape(input: &[usize], channels: usize, axes: &[Axis; 2]) -> Vec<usize> {
    let mut shape = vec![input[0], channels];
    shape.extend(axes[4 - input.len()..].iter().map(|axis| axis.output));
    shape
}
