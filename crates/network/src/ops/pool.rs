//! Poolings: one number for each window.

use crate::call::{Call, Done, length, one};
use crate::ops::window::{self, Axis};
use crate::tensor::{Tensor, Values, count};

/// The largest number of each window.
pub fn max_pool(call: &Call<'_>) -> Done {
    if call.flag("storage_order", false) {
        return Err("storage_order 1 is not supported".to_owned());
    }
    pool(call, |window, _| {
        window.fold(f32::NEG_INFINITY, |most, x| if x > most || x.is_nan() { x } else { most })
    })
}

/// The mean of each window: of the numbers in the input or, with `count_include_pad`, of the pads' zeros, too.
pub fn average_pool(call: &Call<'_>) -> Done {
    let with_pads = call.flag("count_include_pad", false);
    pool(call, |window, padded| {
        let (mut sum, mut n) = (0.0_f64, 0_usize);
        for x in window {
            (sum, n) = (sum + f64::from(x), n + 1);
        }
        (sum / if with_pads { padded } else { n } as f64) as f32
    })
}

/// Calls a function with the numbers of each window that are within the input, and with the number of its places within input and pads.
fn pool(call: &Call<'_>, of: impl Fn(&mut dyn Iterator<Item = f32>, usize) -> f32) -> Done {
    let tensor = call.input(0)?;
    let kernel = call.ints("kernel_shape").ok_or("kernel_shape is missing")?;
    let kernel = kernel.iter().map(|&k| length(k)).collect::<Result<Vec<_>, _>>()?;
    let axes = window::axes(call, tensor.shape(), &kernel)?;
    let shape = window::shape(tensor.shape(), tensor.shape()[1], &axes);
    let [rows, columns] = axes;
    call.spend(&[count(&shape)?, rows.kernel, columns.kernel])?;
    let mut out = Vec::with_capacity(count(&shape)?);
    let padded = |axis: &Axis, at: usize| (0..axis.kernel).filter(|&k| axis.is_padded(at, k)).count();
    for image in call.numbers(0)?.chunks_exact((rows.input * columns.input).max(1)) {
        for y in 0..rows.output {
            for x in 0..columns.output {
                let line = |ky| rows.place(y, ky).map(|v| &image[v * columns.input..][..columns.input]);
                let mut window = (0..rows.kernel).filter_map(line).flat_map(|line| {
                    (0..columns.kernel).filter_map(move |kx| columns.place(x, kx).map(|u| line[u]))
                });
                out.push(of(&mut window, padded(&rows, y) * padded(&columns, x)));
            }
        }
    }
    one(Tensor::of(shape, Values::F32(out)))
}
