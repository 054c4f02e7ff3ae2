//! Windows, pictures in another size, and outputs in used memory against plain loops, bit by bit.

use super::*;
use crate::call::Run;
use crate::spare::Spare;
use crate::tensor::Tensor;

/// Numbers of both signs, with zeros of both.
fn numbers(shape: &[usize], seed: usize) -> Tensor {
    let of = |i: usize| match (i * 7919 + seed * 104_729) % 1009 {
        k if k.is_multiple_of(11) => [0.0, -0.0][k % 2],
        k => (k as f32 - 500.0) / 37.0,
    };
    Tensor::f32(shape, (0..shape.iter().product()).map(of).collect()).unwrap()
}

fn ints(name: &str, ints: &[usize]) -> Attribute {
    Attribute { name: name.into(), ints: ints.iter().map(|&x| x as i64).collect(), ..Default::default() }
}

fn int(name: &str, i: usize) -> Attribute {
    Attribute { name: name.into(), i: i as i64, ..Default::default() }
}

fn text(name: &str, s: &str) -> Attribute {
    Attribute { name: name.into(), s: s.into(), ..Default::default() }
}

/// The shape and bits of an operator's output; those of anything that is not a number are the same. The memory is that of an output before.
fn computed(
    name: &str,
    inputs: &[&Tensor],
    attributes: &[Attribute],
    positive: bool,
) -> (Vec<usize>, Vec<u32>) {
    let run = Run::new(Spare::default());
    run.spare.borrow_mut().alive(1 << 20);
    let inputs: Vec<_> = inputs.iter().map(|&input| Some(input)).collect();
    let mut given = Vec::new();
    for _ in 0..2 {
        let call = Call { inputs: inputs.clone(), attributes, outputs: 1, run: &run, positive };
        given = (Operator::named(name).unwrap().run)(&call).unwrap();
        call.give(given[0].as_f32().unwrap().to_vec());
    }
    (given[0].shape().to_vec(), bits(given[0].as_f32().unwrap()))
}

fn bits(v: &[f32]) -> Vec<u32> {
    v.iter().map(|x| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }).collect()
}

/// Windows along a dimension: length, window, stride, dilation and pads.
type Windows = [usize; 6];

fn windows_out([n, k, s, d, before, after]: Windows) -> usize {
    (n + before + after - (k - 1) * d - 1) / s + 1
}

/// The place under a window; `None` beside the input.
fn under([n, _, s, d, before, _]: Windows, window: usize, at: usize) -> Option<usize> {
    (window * s + at * d).checked_sub(before).filter(|&i| i < n)
}

fn window_attributes([rows, columns]: [Windows; 2]) -> Vec<Attribute> {
    let both = |i: usize| [rows[i], columns[i]];
    vec![
        ints("kernel_shape", &both(1)),
        ints("strides", &both(2)),
        ints("dilations", &both(3)),
        ints("pads", &[rows[4], columns[4], rows[5], columns[5]]),
    ]
}

const WINDOWS: [[Windows; 2]; 12] = [
    [[7, 3, 1, 1, 1, 1], [53, 3, 1, 1, 1, 1]],
    [[9, 3, 2, 1, 1, 1], [71, 3, 2, 1, 1, 1]],
    [[8, 3, 2, 1, 1, 0], [40, 3, 2, 1, 0, 1]],
    [[5, 1, 1, 1, 0, 0], [19, 1, 1, 1, 0, 0]],
    [[5, 1, 2, 1, 0, 0], [34, 1, 2, 1, 0, 0]],
    [[6, 3, 1, 1, 0, 0], [39, 5, 1, 1, 0, 0]],
    [[6, 3, 1, 1, 1, 1], [33, 1, 1, 1, 0, 0]],
    [[12, 4, 4, 1, 0, 0], [68, 4, 4, 1, 0, 0]],
    [[13, 2, 3, 2, 2, 1], [47, 3, 3, 2, 5, 0]],
    [[11, 3, 1, 4, 4, 4], [10, 3, 5, 3, 6, 4]],
    [[1, 1, 1, 1, 0, 0], [2, 4, 1, 1, 3, 2]],
    [[2, 3, 5, 1, 4, 4], [3, 2, 7, 1, 9, 9]],
];

#[test]
fn convolutions_have_the_bits_of_plain_loops() {
    for axes in WINDOWS {
        for (batch, channels, outputs, group) in [(1, 3, 9, 1), (2, 4, 4, 4), (1, 4, 6, 2), (2, 1, 1, 1)] {
            for (biased, positive, endless) in
                [(false, false, false), (true, true, false), (true, false, true)]
            {
                let [rows, columns] = axes;
                let own = channels / group;
                let x = numbers(&[batch, channels, rows[0], columns[0]], 1);
                let shape = [outputs, own, rows[1], columns[1]];
                let mut w = numbers(&shape, 2).as_f32().unwrap().to_vec();
                if endless {
                    w[0] = f32::INFINITY;
                }
                let bias = numbers(&[outputs], 3);
                let [out_rows, out_columns] = axes.map(windows_out);
                let mut plain = Vec::new();
                for n in 0..batch * outputs * out_rows * out_columns {
                    let (v, u) = (n / out_columns % out_rows, n % out_columns);
                    let o = n / out_columns / out_rows % outputs;
                    let first =
                        n / (out_columns * out_rows * outputs) * channels + o / (outputs / group) * own;
                    let mut sum = 0.0;
                    for k in 0..own * rows[1] * columns[1] {
                        let (c, ky, kx) =
                            (k / columns[1] / rows[1], k / columns[1] % rows[1], k % columns[1]);
                        let place = under(rows, v, ky).zip(under(columns, u, kx));
                        let value = place.map_or(0.0, |(y, i)| {
                            x.as_f32().unwrap()[((first + c) * rows[0] + y) * columns[0] + i]
                        });
                        sum += w[o * own * rows[1] * columns[1] + k] * value;
                    }
                    if biased {
                        sum += bias.as_f32().unwrap()[o];
                    }
                    plain.push(if !positive || sum > 0.0 { sum } else { 0.0 });
                }
                let mut attributes = window_attributes(axes);
                attributes.push(int("group", group));
                let w = Tensor::f32(&shape, w).unwrap();
                let inputs = [&x, &w, &bias];
                let inputs = if biased { &inputs[..] } else { &inputs[..2] };
                let (found, given) = computed("Conv", inputs, &attributes, positive);
                assert_eq!(found, [batch, outputs, out_rows, out_columns]);
                assert_eq!(given, bits(&plain), "{axes:?} {group} {biased}");
            }
        }
    }
}

#[test]
fn poolings_have_the_bits_of_plain_loops() {
    for axes in WINDOWS {
        let [rows, columns] = axes;
        let x = numbers(&[1, 3, rows[0], columns[0]], 4);
        let [out_rows, out_columns] = axes.map(windows_out);
        let (mut largest, mut means, mut padded_means) = (Vec::new(), Vec::new(), Vec::new());
        for n in 0..3 * out_rows * out_columns {
            let (c, v, u) = (n / out_columns / out_rows, n / out_columns % out_rows, n % out_columns);
            let (mut most, mut sum, mut count) = (f32::NEG_INFINITY, 0.0_f64, 0);
            for k in 0..rows[1] * columns[1] {
                let place = under(rows, v, k / columns[1]).zip(under(columns, u, k % columns[1]));
                if let Some((y, i)) = place {
                    let value = x.as_f32().unwrap()[(c * rows[0] + y) * columns[0] + i];
                    most = if value > most { value } else { most };
                    (sum, count) = (sum + f64::from(value), count + 1);
                }
            }
            largest.push(most);
            means.push((sum / f64::from(count)) as f32);
            padded_means.push((sum / (rows[1] * columns[1]) as f64) as f32);
        }
        let mut attributes = window_attributes(axes);
        assert_eq!(computed("MaxPool", &[&x], &attributes, false).1, bits(&largest), "{axes:?}");
        assert_eq!(computed("AveragePool", &[&x], &attributes, false).1, bits(&means), "{axes:?}");
        attributes.push(int("count_include_pad", 1));
        assert_eq!(computed("AveragePool", &[&x], &attributes, false).1, bits(&padded_means), "{axes:?}");
    }
}

#[test]
fn nearest_numbers_are_those_of_a_plain_loop() {
    let x = numbers(&[2, 1, 6, 5], 5);
    let attributes = [text("coordinate_transformation_mode", "asymmetric"), text("nearest_mode", "floor")];
    for scales in [[1.0, 1.0, 4.0, 4.0], [1.0, 3.0, 0.5, 2.0], [2.0, 1.0, 1.5, 0.4], [1.0; 4]] {
        let shape: Vec<usize> =
            x.shape().iter().zip(scales).map(|(&n, scale)| (n as f32 * scale) as usize).collect();
        let plain: Vec<f32> = (0..shape.iter().product())
            .map(|mut k: usize| {
                let (mut at, mut step) = (0, 1);
                for d in (0..4).rev() {
                    let place = (k % shape[d]) as f64 / f64::from(scales[d]);
                    at += (place as usize).min(x.shape()[d] - 1) * step;
                    (k, step) = (k / shape[d], step * x.shape()[d]);
                }
                x.as_f32().unwrap()[at]
            })
            .collect();
        let (empty, scales) = (numbers(&[0], 0), Tensor::f32(&[4], scales.to_vec()).unwrap());
        let given = computed("Resize", &[&x, &empty, &scales], &attributes, false);
        assert_eq!(given, (shape, bits(&plain)));
    }
}

#[test]
fn arrays_are_spread_as_in_a_plain_loop() {
    for (a, b) in [
        ([3, 4, 17], [3, 4, 17]),
        ([3, 4, 17], [1, 1, 1]),
        ([3, 1, 17], [1, 4, 17]),
        ([1, 4, 1], [3, 1, 17]),
        ([3, 4, 1], [3, 4, 1]),
    ] {
        let shape: Vec<usize> = (0..3).map(|d| a[d].max(b[d])).collect();
        let (x, y) = (numbers(&a, 6), numbers(&b, 7));
        let at = |own: [usize; 3], k: usize| {
            let index = [k / shape[2] / shape[1], k / shape[2] % shape[1], k % shape[2]];
            (0..3).fold(0, |at, d| at * own[d] + index[d].min(own[d] - 1))
        };
        let plain: Vec<f32> = (0..shape.iter().product())
            .map(|k| x.as_f32().unwrap()[at(a, k)] - y.as_f32().unwrap()[at(b, k)])
            .collect();
        assert_eq!(computed("Sub", &[&x, &y], &[], false), (shape, bits(&plain)));
    }
}
