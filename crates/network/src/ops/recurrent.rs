//! Recurrent layers: GRU and LSTM, as ONNX defines them, forward, with the default activations.

use orchard_geometry::math;

use crate::call::{Call, Done};
use crate::ops::product::{Sizes, multiply};
use crate::tensor::{Tensor, Values};

fn sigmoid(x: f32) -> f32 {
    (1.0 / (1.0 + math::exp(-f64::from(x)))) as f32
}

fn tanh(x: f32) -> f32 {
    math::tanh(f64::from(x)) as f32
}

/// Inputs of a layer of `gates` gates.
struct Layer<'a> {
    /// Steps, sequences side by side, numbers of an input, numbers of the state.
    sizes: [usize; 4],
    x: &'a [f32],
    /// Weights of inputs and state, turned: a column a gate's number.
    w: Vec<f32>,
    r: Vec<f32>,
    /// Biases of inputs, then of the state, a number a gate's number each.
    bias: Vec<f32>,
    hidden: Vec<f32>,
}

impl<'a> Layer<'a> {
    fn of(call: &Call<'a>, gates: usize) -> Result<Self, String> {
        if call.text("direction", "forward")? != "forward" || call.int("layout", 0) != 0 {
            return Err("only direction forward and layout 0 are supported".to_owned());
        }
        if call.optional(4).is_some() {
            return Err("sequences of different lengths (sequence_lens) are not supported".to_owned());
        }
        let &[steps, batch, input] = call.input(0)?.shape() else {
            return Err("input 0 must have 3 dimensions".to_owned());
        };
        let &[1, rows, _] = call.input(2)?.shape() else {
            return Err("input 2 must be one matrix".to_owned());
        };
        let state = rows / gates;
        let wide = gates.checked_mul(state).ok_or("the state is too large")?;
        let (w, r) = (call.numbers_of(1, wide * input)?, call.numbers_of(2, wide * state)?);
        let bias = match call.optional(3) {
            Some(_) => call.numbers_of(3, 2 * wide)?.to_vec(),
            None => vec![0.0; 2 * wide],
        };
        call.spend(&[steps, batch, wide, input + state])?;
        let hidden = start(call, 5, batch * state)?;
        let sizes = [steps, batch, input, state];
        Ok(Self {
            sizes,
            x: call.numbers(0)?,
            w: turned(w, wide, input),
            r: turned(r, wide, state),
            bias,
            hidden,
        })
    }

    /// The products of inputs and weights of a step, and of the state and weights, each with its bias: a row a sequence.
    fn products(&self, step: usize, gates: usize) -> [Vec<f32>; 2] {
        let [_, batch, input, state] = self.sizes;
        let wide = gates * state;
        let x = &self.x[step * batch * input..][..batch * input];
        let parts =
            [(x, &self.w, input, &self.bias[..wide]), (&self.hidden[..], &self.r, state, &self.bias[wide..])];
        parts.map(|(v, weights, depth, bias)| {
            let mut product = vec![0.0; batch * wide];
            multiply(v, weights, &mut product, Sizes { rows: batch, depth, columns: wide });
            for row in product.chunks_exact_mut(wide.max(1)) {
                row.iter_mut().zip(bias).for_each(|(x, b)| *x += b);
            }
            product
        })
    }
}

fn turned(v: &[f32], rows: usize, columns: usize) -> Vec<f32> {
    (0..rows * columns).map(|i| v[(i % rows) * columns + i / rows]).collect()
}

/// A state at the start: an input, or zeros.
fn start(call: &Call<'_>, i: usize, n: usize) -> Result<Vec<f32>, String> {
    call.optional(i).map_or_else(|| Ok(vec![0.0; n]), |_| call.numbers_of(i, n).map(<[f32]>::to_vec))
}

fn arrays(all: Vec<f32>, last: Vec<Vec<f32>>, [steps, batch, _, state]: [usize; 4]) -> Done {
    let mut done = vec![Tensor::of(vec![steps, 1, batch, state], Values::F32(all))?];
    for v in last {
        done.push(Tensor::of(vec![1, batch, state], Values::F32(v))?);
    }
    Ok(done)
}

pub fn gru(call: &Call<'_>) -> Done {
    let mut layer = Layer::of(call, 3)?;
    let [steps, batch, _, n] = layer.sizes;
    let reset_after = call.flag("linear_before_reset", false);
    let mut all = Vec::new();
    for step in 0..steps {
        let [x, h] = layer.products(step, 3);
        let mut next = layer.hidden.clone();
        for b in 0..batch {
            let (x, h) = (&x[b * 3 * n..][..3 * n], &h[b * 3 * n..][..3 * n]);
            let old = &layer.hidden[b * n..][..n];
            let reset: Vec<f32> = (n..2 * n).map(|i| sigmoid(x[i] + h[i])).collect();
            let mut candidate = vec![0.0; n];
            if reset_after {
                candidate.iter_mut().enumerate().for_each(|(i, c)| *c = reset[i] * h[2 * n + i]);
            } else {
                // The weights of the candidate are the last third of each row.
                let kept: Vec<f32> = old.iter().zip(&reset).map(|(h, r)| h * r).collect();
                let weights: Vec<f32> =
                    layer.r.chunks_exact(3 * n).flat_map(|row| &row[2 * n..]).copied().collect();
                multiply(&kept, &weights, &mut candidate, Sizes { rows: 1, depth: n, columns: n });
                candidate.iter_mut().zip(&layer.bias[5 * n..]).for_each(|(c, b)| *c += b);
            }
            for i in 0..n {
                let (update, new) = (sigmoid(x[i] + h[i]), tanh(x[2 * n + i] + candidate[i]));
                next[b * n + i] = (1.0 - update) * new + update * old[i];
            }
        }
        all.extend_from_slice(&next);
        layer.hidden = next;
    }
    arrays(all, vec![layer.hidden], layer.sizes)
}

pub fn lstm(call: &Call<'_>) -> Done {
    if call.optional(7).is_some() {
        return Err("peepholes are not supported".to_owned());
    }
    let mut layer = Layer::of(call, 4)?;
    let [steps, batch, _, n] = layer.sizes;
    let mut cell = start(call, 6, batch * n)?;
    let mut all = Vec::new();
    for step in 0..steps {
        let [x, h] = layer.products(step, 4);
        for b in 0..batch {
            let gate = |g: usize, i: usize| x[(b * 4 + g) * n + i] + h[(b * 4 + g) * n + i];
            for i in 0..n {
                // Gates in ONNX's order: input, output, forget, cell.
                let (input, output, forget, new) =
                    (sigmoid(gate(0, i)), sigmoid(gate(1, i)), sigmoid(gate(2, i)), tanh(gate(3, i)));
                let c = &mut cell[b * n + i];
                *c = forget * *c + input * new;
                layer.hidden[b * n + i] = output * tanh(*c);
            }
        }
        all.extend_from_slice(&layer.hidden);
    }
    arrays(all, vec![layer.hidden, cell], layer.sizes)
}
