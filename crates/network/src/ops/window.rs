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
    /// True if a place of a window is within the input.
    pub fn is_within(&self, output: usize, kernel: usize) -> bool {
        let at = output * self.stride + kernel * self.dilation;
        (self.pads[0]..self.pads[0] + self.input).contains(&at)
    }

    /// True if a place of a window is within the input and its pads.
    pub fn is_padded(&self, output: usize, kernel: usize) -> bool {
        output * self.stride + kernel * self.dilation < self.input + self.pads[0] + self.pads[1]
    }
}

/// The arrangement of an image for windows that slide over it: lines as long as the windows reach, pads and all. In a line, places with the same
/// remainder by the stride stand together, so that the numbers under one place of neighbouring windows stand side by side.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    rows: Axis,
    columns: Axis,
    /// Numbers of a line with the same remainder.
    alike: usize,
}

impl Layout {
    pub fn new([rows, columns]: [Axis; 2]) -> Self {
        Self {
            rows,
            columns,
            alike: columns.output + (columns.kernel - 1) * columns.dilation / columns.stride,
        }
    }

    /// Numbers of a line.
    pub fn line(&self) -> usize {
        self.columns.stride * self.alike
    }

    /// Lines under some rows of windows.
    pub fn lines(&self, windows: usize) -> usize {
        (windows.max(1) - 1) * self.rows.stride + (self.rows.kernel - 1) * self.rows.dilation + 1
    }

    /// From a row of windows to the next.
    pub fn step(&self) -> usize {
        self.rows.stride.saturating_mul(self.line())
    }

    /// True if an image is laid out as it is.
    pub fn is_plain(&self) -> bool {
        [self.rows, self.columns].iter().all(|axis| axis.stride == 1 && axis.pads == [0, 0])
    }

    /// Index of the number under each place of the first window.
    pub fn starts(&self) -> impl Iterator<Item = usize> {
        let Self { rows, columns, alike } = *self;
        let down = move |ky: usize| ky * rows.dilation * self.line();
        let across = move |kx: usize| {
            let at = kx * columns.dilation;
            at % columns.stride * alike + at / columns.stride
        };
        (0..rows.kernel).flat_map(move |ky| (0..columns.kernel).map(move |kx| down(ky) + across(kx)))
    }

    /// Rows of windows whose lines fill a piece of so many numbers, of so many images at a time.
    pub fn at_once(&self, images: usize) -> usize {
        (PIECE / images.saturating_mul(self.step()).max(1)).clamp(1, self.rows.output.max(1))
    }

    /// Lays out the lines under the windows from a row on, with a number that stands beside the image.
    pub fn lay(&self, image: &[f32], top: usize, beside: f32, lines: &mut [f32]) {
        let Self { rows, columns, alike } = self;
        for (y, line) in (top * rows.stride..).zip(lines.chunks_exact_mut(self.line())) {
            let own = y.checked_sub(rows.pads[0]).filter(|&y| y < rows.input);
            let Some(own) = own.map(|y| &image[y * columns.input..][..columns.input]) else {
                line.fill(beside);
                continue;
            };
            for (remainder, part) in line.chunks_exact_mut(*alike).enumerate() {
                copy_every(own, part, columns, remainder, beside);
            }
        }
    }
}

/// Copies the numbers of a line that are a whole number of strides behind a place; the place counts from the pad.
fn copy_every(from: &[f32], part: &mut [f32], columns: &Axis, place: usize, beside: f32) {
    let (pad, n) = (columns.pads[0], part.len());
    let first = pad.saturating_sub(place).div_ceil(columns.stride).min(n);
    let end = (columns.input + pad).saturating_sub(place).div_ceil(columns.stride).clamp(first, n);
    part[..first].fill(beside);
    part[end..].fill(beside);
    if first == end {
        return;
    }
    let (from, part) = (&from[first * columns.stride + place - pad..], &mut part[first..end]);
    match columns.stride {
        1 => part.copy_from_slice(&from[..end - first]),
        2 => copy_first::<2>(from, part),
        4 => copy_first::<4>(from, part),
        stride => part.iter_mut().zip(from.iter().step_by(stride)).for_each(|(to, &x)| *to = x),
    }
}

/// Copies the first of every `N` numbers.
fn copy_first<const N: usize>(from: &[f32], part: &mut [f32]) {
    let (chunks, rest) = from.as_chunks::<N>();
    part.iter_mut().zip(chunks).for_each(|(to, chunk)| *to = chunk[0]);
    // The last ones may be fewer than `N`.
    if let (Some(to), Some(&x)) = (part.get_mut(chunks.len()), rest.first()) {
        *to = x;
    }
}

/// Numbers that are laid out at a time: 256 kB stay in the cache.
const PIECE: usize = 1 << 16;

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
