//! Poolings: one number for each window.

use crate::call::{Call, Done, length, one};
use crate::ops::window::{self, Axis, Layout};
use crate::tensor::{Tensor, Values, count};

/// The largest number of each window.
pub fn max_pool(call: &Call<'_>) -> Done {
    if call.flag("storage_order", false) {
        return Err("storage_order 1 is not supported".to_owned());
    }
    let larger = |most, x: f32| if x > most || x.is_nan() { x } else { most };
    pool(call, f32::NEG_INFINITY, f32::NEG_INFINITY, larger, |most, _, _| most)
}

/// The mean of each window: of the numbers in the input or, with `count_include_pad`, of the pads' zeros, too.
pub fn average_pool(call: &Call<'_>) -> Done {
    let with_pads = call.flag("count_include_pad", false);
    let mean = |sum, n, padded| (sum / if with_pads { padded } else { n } as f64) as f32;
    pool(call, 0.0_f64, 0.0, |sum, x| sum + f64::from(x), mean)
}

/// Joins the numbers of each window, from `start` on. What stands beside the input must change nothing: the least of all numbers, or 0 to a sum, which
/// begins at 0 and so is never -0. `end` is given what came of it, the number of places within the input, and that within input and pads.
fn pool<T: Copy>(
    call: &Call<'_>,
    start: T,
    beside: f32,
    join: impl Fn(T, f32) -> T,
    end: impl Fn(T, usize, usize) -> f32,
) -> Done {
    let tensor = call.input(0)?;
    let kernel = call.ints("kernel_shape").ok_or("kernel_shape is missing")?;
    let kernel = kernel.iter().map(|&k| length(k)).collect::<Result<Vec<_>, _>>()?;
    let axes = window::axes(call, tensor.shape(), &kernel)?;
    let shape = window::shape(tensor.shape(), tensor.shape()[1], &axes);
    let [rows, columns] = axes;
    let n = count(&shape)?;
    call.spend(&[n, rows.kernel, columns.kernel])?;
    if n > 0 && tensor.values().is_empty() {
        return Err(format!("shape {:?} is empty", tensor.shape()));
    }
    let layout = Layout::new(axes);
    let (at_once, line) = (layout.at_once(1), layout.line());
    let mut laid = call.take(count(&[layout.lines(at_once), line])?);
    let mut out = call.take(n);
    let places = |axis: &Axis, is_in: &dyn Fn(usize, usize) -> bool| -> Vec<usize> {
        (0..axis.output).map(|at| (0..axis.kernel).filter(|&k| is_in(at, k)).count()).collect()
    };
    let within = axes.each_ref().map(|axis| places(axis, &|at, k| axis.is_within(at, k)));
    let padded = axes.each_ref().map(|axis| places(axis, &|at, k| axis.is_padded(at, k)));
    let starts: Vec<usize> = layout.starts().collect();
    let mut joined = vec![start; columns.output];
    let images = call.numbers(0)?.chunks_exact((rows.input * columns.input).max(1));
    for (image, out) in images.zip(out.chunks_exact_mut((rows.output * columns.output).max(1))) {
        for (y, out) in out.chunks_exact_mut(columns.output).enumerate() {
            if y.is_multiple_of(at_once) {
                layout.lay(image, y, beside, &mut laid);
            }
            let first = y % at_once * layout.step();
            joined.fill(start);
            for from in &starts {
                let line = &laid[first + from..][..joined.len()];
                joined.iter_mut().zip(line).for_each(|(joined, &x)| *joined = join(*joined, x));
            }
            let across = within[1].iter().zip(&padded[1]);
            for ((to, &joined), (n, with_pads)) in out.iter_mut().zip(&joined).zip(across) {
                *to = end(joined, within[0][y] * n, padded[0][y] * with_pads);
            }
        }
    }
    call.give(laid);
    one(Tensor::of(shape, Values::F32(out)))
}
