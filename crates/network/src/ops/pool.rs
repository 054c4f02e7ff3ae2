//! Poolings: one number for each window.

use crate::call::{Call, Done, length, one};
use crate::ops::window::{self, Axis};
use crate::tensor::{Tensor, Values, count};

/// The largest number of each window.
pub fn max_pool(call: &Call<'_>) -> Done {
    if call.flag("storage_order", false) {
        return Err("storage_order 1 is not supported".to_owned());
    }
    let larger = |most, x: f32| if x > most || x.is_nan() { x } else { most };
    pool(call, f32::NEG_INFINITY, larger, |most, _, _| most)
}

/// The mean of each window: of the numbers in the input or, with `count_include_pad`, of the pads' zeros, too.
pub fn average_pool(call: &Call<'_>) -> Done {
    let with_pads = call.flag("count_include_pad", false);
    let mean = |sum, n, padded| (sum / if with_pads { padded } else { n } as f64) as f32;
    pool(call, 0.0_f64, |sum, x| sum + f64::from(x), mean)
}

/// Joins the numbers of each window that are within the input, from `start` on. `end` is given what came of it, the number of these numbers, and the number of the window's places
/// within input and pads.
fn pool<T>(
    call: &Call<'_>,
    start: T,
    join: impl Fn(T, f32) -> T,
    end: impl Fn(T, usize, usize) -> f32,
) -> Done
where
    T: Copy,
{
    let tensor = call.input(0)?;
    let kernel = call.ints("kernel_shape").ok_or("kernel_shape is missing")?;
    let kernel = kernel.iter().map(|&k| length(k)).collect::<Result<Vec<_>, _>>()?;
    let axes = window::axes(call, tensor.shape(), &kernel)?;
    let shape = window::shape(tensor.shape(), tensor.shape()[1], &axes);
    let [rows, columns] = axes;
    call.spend(&[count(&shape)?, rows.kernel, columns.kernel])?;
    let mut out = Vec::with_capacity(count(&shape)?);
    let padded = |axis: &Axis, at: usize| (0..axis.kernel).filter(|&k| axis.is_padded(at, k)).count();
    let across: Vec<usize> = (0..columns.output).map(|x| padded(&columns, x)).collect();
    for image in call.numbers(0)?.chunks_exact((rows.input * columns.input).max(1)) {
        for y in 0..rows.output {
            let down = padded(&rows, y);
            for (x, across) in across.iter().enumerate() {
                let (mut joined, mut n) = (start, 0);
                for v in (0..rows.kernel).filter_map(|ky| rows.place(y, ky)) {
                    let line = &image[v * columns.input..][..columns.input];
                    for u in (0..columns.kernel).filter_map(|kx| columns.place(x, kx)) {
                        (joined, n) = (join(joined, line[u]), n + 1);
                    }
                }
                out.push(end(joined, n, down * across));
            }
        }
    }
    one(Tensor::of(shape, Values::F32(out)))
}
