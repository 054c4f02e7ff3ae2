//! Operators that compute each number of an output from one number of each input.

use std::borrow::Cow;

use orchard_geometry::math;

use crate::call::{Call, Done, one};
use crate::ops::product::positive;
use crate::tensor::{Kind, Tensor, Values, count, each, rows, spread, spread_strides};

/// Computes a function of every number.
fn map(call: &Call<'_>, f: impl Fn(f32) -> f32) -> Done {
    let v = call.numbers(0)?;
    let mut out = call.take(v.len());
    write(&mut out, v.iter().map(|&x| f(x)));
    one(Tensor::of(call.input(0)?.shape().to_vec(), Values::F32(out)))
}

/// A function of 64-bit numbers on 32-bit ones.
fn wide(call: &Call<'_>, f: impl Fn(f64) -> f64) -> Done {
    map(call, |x| f(f64::from(x)) as f32)
}

fn sigmoid_of(x: f64) -> f64 {
    1.0 / (1.0 + math::exp(-x))
}

/// ln(1 + e^x), without overflow.
fn softplus_of(x: f64) -> f64 {
    (if x > 0.0 { x } else { 0.0 }) + math::ln_1p(math::exp(-x.abs()))
}

pub fn relu(call: &Call<'_>) -> Done {
    map(call, positive)
}

pub fn leaky_relu(call: &Call<'_>) -> Done {
    let alpha = call.float("alpha", 0.01);
    map(call, |x| if x < 0.0 { alpha * x } else { x })
}

pub fn elu(call: &Call<'_>) -> Done {
    let alpha = f64::from(call.float("alpha", 1.0));
    wide(call, |x| if x < 0.0 { alpha * math::expm1(x) } else { x })
}

pub fn selu(call: &Call<'_>) -> Done {
    let alpha = f64::from(call.float("alpha", 1.673_263_2));
    let gamma = f64::from(call.float("gamma", 1.050_701));
    wide(call, |x| gamma * if x > 0.0 { x } else { alpha * math::expm1(x) })
}

pub fn sigmoid(call: &Call<'_>) -> Done {
    wide(call, sigmoid_of)
}

pub fn hard_sigmoid(call: &Call<'_>) -> Done {
    let (alpha, beta) = (call.float("alpha", 0.2), call.float("beta", 0.5));
    map(call, |x| lesser(positive(alpha * x + beta), 1.0))
}

pub fn hard_swish(call: &Call<'_>) -> Done {
    map(call, |x| x * lesser(positive(x / 6.0 + 0.5), 1.0))
}

pub fn tanh(call: &Call<'_>) -> Done {
    wide(call, math::tanh)
}

pub fn softplus(call: &Call<'_>) -> Done {
    wide(call, softplus_of)
}

pub fn mish(call: &Call<'_>) -> Done {
    wide(call, |x| x * math::tanh(softplus_of(x)))
}

pub fn gelu(call: &Call<'_>) -> Done {
    match call.text("approximate", "none")? {
        "none" => wide(call, |x| 0.5 * x * (1.0 + math::erf(x * std::f64::consts::FRAC_1_SQRT_2))),
        "tanh" => {
            // Hendrycks and Gimpel 2016, as in the definition of the operator.
            let scale = (2.0 / std::f64::consts::PI).sqrt();
            wide(call, |x| 0.5 * x * (1.0 + math::tanh(scale * (x + 0.044715 * x * x * x))))
        }
        other => Err(format!("approximate is `{other}`, not `none` or `tanh`")),
    }
}

pub fn erf(call: &Call<'_>) -> Done {
    wide(call, math::erf)
}

pub fn exp(call: &Call<'_>) -> Done {
    wide(call, math::exp)
}

pub fn log(call: &Call<'_>) -> Done {
    wide(call, math::ln)
}

pub fn sin(call: &Call<'_>) -> Done {
    wide(call, math::sin)
}

pub fn cos(call: &Call<'_>) -> Done {
    wide(call, math::cos)
}

pub fn sqrt(call: &Call<'_>) -> Done {
    map(call, f32::sqrt)
}

pub fn reciprocal(call: &Call<'_>) -> Done {
    map(call, |x| 1.0 / x)
}

pub fn floor(call: &Call<'_>) -> Done {
    map(call, f32::floor)
}

pub fn ceil(call: &Call<'_>) -> Done {
    map(call, f32::ceil)
}

pub fn round(call: &Call<'_>) -> Done {
    map(call, f32::round_ties_even)
}

pub fn sign(call: &Call<'_>) -> Done {
    signed(call, |x| f32::from(x > 0.0) - f32::from(x < 0.0), i64::signum)
}

pub fn neg(call: &Call<'_>) -> Done {
    signed(call, |x| -x, i64::wrapping_neg)
}

pub fn abs(call: &Call<'_>) -> Done {
    signed(call, f32::abs, i64::wrapping_abs)
}

fn signed(call: &Call<'_>, f: impl Fn(f32) -> f32, g: impl Fn(i64) -> i64) -> Done {
    match call.input(0)?.values() {
        Values::I64(v) => {
            let v = v.iter().map(|&x| g(x)).collect();
            one(Tensor::of(call.input(0)?.shape().to_vec(), Values::I64(v)))
        }
        _ => map(call, f),
    }
}

pub fn not(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let Values::Bool(v) = tensor.values() else { return Err(wrong_kind(tensor)) };
    one(Tensor::of(tensor.shape().to_vec(), Values::Bool(v.iter().map(|x| !x).collect())))
}

/// Writes the numbers of two arrays, spread to one shape, through a function.
fn zip<A: Copy, B: Copy, C>(
    (a, a_shape): (&[A], &[usize]),
    (b, b_shape): (&[B], &[usize]),
    (mut out, shape): (&mut [C], &[usize]),
    f: impl Fn(A, B) -> C,
) {
    if a_shape == shape && b_shape == shape {
        return write(out, a.iter().zip(b).map(|(&x, &y)| f(x, y)));
    }
    let steps = [spread_strides(a_shape, shape), spread_strides(b_shape, shape)];
    rows(shape, [&steps[0], &steps[1]], |at, n, step| {
        let [i, j] = at.map(|at| at as usize);
        let Some(line) = out.split_off_mut(..n) else { return };
        match step {
            [1, 1] => write(line, a[i..i + n].iter().zip(&b[j..j + n]).map(|(&x, &y)| f(x, y))),
            [0, 1] => write(line, b[j..j + n].iter().map(|&y| f(a[i], y))),
            [1, 0] => write(line, a[i..i + n].iter().map(|&x| f(x, b[j]))),
            _ => line.iter_mut().for_each(|to| *to = f(a[i], b[j])),
        }
    });
}

fn write<T>(out: &mut [T], numbers: impl Iterator<Item = T>) {
    out.iter_mut().zip(numbers).for_each(|(to, x)| *to = x);
}

/// A function of two arrays of the same type, by type.
fn arithmetic(call: &Call<'_>, f: impl Fn(f32, f32) -> f32, g: impl Fn(i64, i64) -> i64) -> Done {
    let mut total = Cow::Borrowed(call.input(0)?);
    for i in 1..call.inputs.len().max(1) {
        total = Cow::Owned(pair(call, &total, call.input(i)?, &f, &g)?);
    }
    Ok(vec![total.into_owned()])
}

fn pair(
    call: &Call<'_>,
    a: &Tensor,
    b: &Tensor,
    f: &impl Fn(f32, f32) -> f32,
    g: &impl Fn(i64, i64) -> i64,
) -> Result<Tensor, String> {
    let shape = spread(a.shape(), b.shape())?;
    let n = count(&shape)?;
    let values = match (a.values(), b.values()) {
        (Values::F32(x), Values::F32(y)) => {
            let mut out = call.take(n);
            zip((x, a.shape()), (y, b.shape()), (&mut out, &shape), f);
            Values::F32(out)
        }
        (Values::I64(x), Values::I64(y)) => {
            let mut out = vec![0; n];
            zip((x, a.shape()), (y, b.shape()), (&mut out, &shape), g);
            Values::I64(out)
        }
        _ => return Err(wrong_kinds(a, b)),
    };
    Tensor::of(shape, values)
}

fn wrong_kind(tensor: &Tensor) -> String {
    format!("numbers of type {} are not supported here", tensor.values().kind().name())
}

fn wrong_kinds(a: &Tensor, b: &Tensor) -> String {
    let [a, b] = [a, b].map(|tensor| tensor.values().kind().name());
    format!("numbers of types {a} and {b} are not supported here")
}

/// The lesser of two numbers; which of two equal ones, and of NaN, is fixed.
fn lesser(a: f32, b: f32) -> f32 {
    if b < a || b.is_nan() { b } else { a }
}

fn greater_of(a: f32, b: f32) -> f32 {
    if b > a || b.is_nan() { b } else { a }
}

pub fn add(call: &Call<'_>) -> Done {
    arithmetic(call, |a, b| a + b, i64::wrapping_add)
}

pub fn sub(call: &Call<'_>) -> Done {
    arithmetic(call, |a, b| a - b, i64::wrapping_sub)
}

pub fn mul(call: &Call<'_>) -> Done {
    arithmetic(call, |a, b| a * b, i64::wrapping_mul)
}

/// Quotients; a whole number over zero is zero.
pub fn div(call: &Call<'_>) -> Done {
    arithmetic(call, |a, b| a / b, |a, b| if b == 0 { 0 } else { a.wrapping_div(b) })
}

/// Remainders: with the sign of the divisor, or with `fmod` of the dividend. A whole number modulo zero is zero.
pub fn modulo(call: &Call<'_>) -> Done {
    let fmod = call.flag("fmod", false);
    let with_sign_of_divisor = |r: f32, b: f32| if r != 0.0 && (r < 0.0) != (b < 0.0) { r + b } else { r };
    let whole = |a: i64, b: i64| match b {
        0 => 0,
        _ if fmod => a.wrapping_rem(b),
        _ => {
            let r = a.wrapping_rem(b);
            if r != 0 && (r < 0) != (b < 0) { r + b } else { r }
        }
    };
    arithmetic(call, |a, b| if fmod { a % b } else { with_sign_of_divisor(a % b, b) }, whole)
}

pub fn min(call: &Call<'_>) -> Done {
    arithmetic(call, lesser, i64::min)
}

pub fn max(call: &Call<'_>) -> Done {
    arithmetic(call, greater_of, i64::max)
}

pub fn pow(call: &Call<'_>) -> Done {
    let (base, exponent) = (call.input(0)?, call.input(1)?);
    let exponent = match exponent.values() {
        Values::I64(v) => {
            let v = v.iter().map(|&x| x as f32).collect();
            &Tensor::of(exponent.shape().to_vec(), Values::F32(v))?
        }
        _ => exponent,
    };
    let power = |a: f32, b: f32| match b {
        2.0 => a * a,
        _ => math::pow(f64::from(a), f64::from(b)) as f32,
    };
    let (Values::F32(a), Values::F32(b)) = (base.values(), exponent.values()) else {
        return Err(wrong_kinds(base, exponent));
    };
    let shape = spread(base.shape(), exponent.shape())?;
    let mut out = call.take(count(&shape)?);
    zip((a, base.shape()), (b, exponent.shape()), (&mut out, &shape), power);
    one(Tensor::of(shape, Values::F32(out)))
}

pub fn prelu(call: &Call<'_>) -> Done {
    one(pair(
        call,
        call.input(0)?,
        call.input(1)?,
        &|x, slope| if x < 0.0 { slope * x } else { x },
        &i64::wrapping_mul,
    ))
}

fn compare(call: &Call<'_>, f: impl Fn(f32, f32) -> bool, g: impl Fn(i64, i64) -> bool) -> Done {
    let (a, b) = (call.input(0)?, call.input(1)?);
    let shape = spread(a.shape(), b.shape())?;
    let mut out = vec![false; count(&shape)?];
    let to = (out.as_mut_slice(), shape.as_slice());
    match (a.values(), b.values()) {
        (Values::F32(x), Values::F32(y)) => zip((x, a.shape()), (y, b.shape()), to, f),
        (Values::I64(x), Values::I64(y)) => zip((x, a.shape()), (y, b.shape()), to, g),
        (Values::Bool(x), Values::Bool(y)) => {
            zip((x, a.shape()), (y, b.shape()), to, |x, y| g(i64::from(x), i64::from(y)));
        }
        _ => return Err(wrong_kinds(a, b)),
    }
    one(Tensor::of(shape, Values::Bool(out)))
}

pub fn equal(call: &Call<'_>) -> Done {
    compare(call, |a, b| a == b, |a, b| a == b)
}

pub fn greater(call: &Call<'_>) -> Done {
    compare(call, |a, b| a > b, |a, b| a > b)
}

pub fn greater_or_equal(call: &Call<'_>) -> Done {
    compare(call, |a, b| a >= b, |a, b| a >= b)
}

pub fn less(call: &Call<'_>) -> Done {
    compare(call, |a, b| a < b, |a, b| a < b)
}

pub fn less_or_equal(call: &Call<'_>) -> Done {
    compare(call, |a, b| a <= b, |a, b| a <= b)
}

fn logic(call: &Call<'_>, f: impl Fn(bool, bool) -> bool) -> Done {
    let (a, b) = (call.input(0)?, call.input(1)?);
    let (Values::Bool(x), Values::Bool(y)) = (a.values(), b.values()) else { return Err(wrong_kinds(a, b)) };
    let shape = spread(a.shape(), b.shape())?;
    let mut out = vec![false; count(&shape)?];
    zip((x, a.shape()), (y, b.shape()), (&mut out, &shape), f);
    one(Tensor::of(shape, Values::Bool(out)))
}

pub fn and(call: &Call<'_>) -> Done {
    logic(call, |a, b| a && b)
}

pub fn or(call: &Call<'_>) -> Done {
    logic(call, |a, b| a || b)
}

pub fn xor(call: &Call<'_>) -> Done {
    logic(call, |a, b| a != b)
}

/// Numbers of one array where a condition holds, of another elsewhere.
pub fn choose(call: &Call<'_>) -> Done {
    let [condition, yes, no] = [call.input(0)?, call.input(1)?, call.input(2)?];
    let shape = spread(&spread(condition.shape(), yes.shape())?, no.shape())?;
    let whole = |tensor: &Tensor| tensor.strided(shape.clone(), 0, &spread_strides(tensor.shape(), &shape));
    let (yes, no) = (whole(yes)?, whole(no)?);
    let c = condition.strided(shape.clone(), 0, &spread_strides(condition.shape(), &shape))?;
    let Values::Bool(c) = c.values() else { return Err(wrong_kind(condition)) };
    let values = match (yes.values(), no.values()) {
        (Values::F32(x), Values::F32(y)) => Values::F32(pick(c, x, y)),
        (Values::I64(x), Values::I64(y)) => Values::I64(pick(c, x, y)),
        (Values::U8(x), Values::U8(y)) => Values::U8(pick(c, x, y)),
        (Values::Bool(x), Values::Bool(y)) => Values::Bool(pick(c, x, y)),
        _ => return Err(wrong_kinds(&yes, &no)),
    };
    one(Tensor::of(shape, values))
}

fn pick<T: Copy>(condition: &[bool], yes: &[T], no: &[T]) -> Vec<T> {
    condition.iter().zip(yes.iter().zip(no)).map(|(&c, (&x, &y))| if c { x } else { y }).collect()
}

/// Numbers within two ends.
pub fn clip(call: &Call<'_>) -> Done {
    if let Values::I64(v) = call.input(0)?.values() {
        let end = |i: usize, default: i64| {
            call.whole(i).map(|v| v.and_then(|v| v.first().copied()).unwrap_or(default))
        };
        let (low, high) = (end(1, i64::MIN)?, end(2, i64::MAX)?);
        let v = v.iter().map(|&x| x.max(low).min(high)).collect();
        return one(Tensor::of(call.input(0)?.shape().to_vec(), Values::I64(v)));
    }
    let (low, high) = (call.number_or(1, f32::NEG_INFINITY)?, call.number_or(2, f32::INFINITY)?);
    map(call, |x| lesser(greater_of(x, low), high))
}

pub fn identity(call: &Call<'_>) -> Done {
    Ok(vec![call.input(0)?.clone()])
}

/// Numbers as those of another type, as Rust's `as` turns them.
pub fn cast(call: &Call<'_>) -> Done {
    let tensor = call.input(0)?;
    let to = i32::try_from(call.int("to", 0)).unwrap_or_default();
    let values = match (Kind::of(to)?, tensor.values()) {
        (Kind::F32, Values::I64(v)) => Values::F32(v.iter().map(|&x| x as f32).collect()),
        (Kind::F32, Values::U8(v)) => Values::F32(v.iter().map(|&x| f32::from(x)).collect()),
        (Kind::F32, Values::Bool(v)) => Values::F32(v.iter().map(|&x| f32::from(x)).collect()),
        (Kind::I64, Values::F32(v)) => Values::I64(v.iter().map(|&x| x as i64).collect()),
        (Kind::I64, Values::U8(v)) => Values::I64(v.iter().map(|&x| i64::from(x)).collect()),
        (Kind::I64, Values::Bool(v)) => Values::I64(v.iter().map(|&x| i64::from(x)).collect()),
        (Kind::U8, Values::F32(v)) => Values::U8(v.iter().map(|&x| x as u8).collect()),
        (Kind::U8, Values::I64(v)) => Values::U8(v.iter().map(|&x| x as u8).collect()),
        (Kind::U8, Values::Bool(v)) => Values::U8(v.iter().map(|&x| u8::from(x)).collect()),
        (Kind::Bool, Values::F32(v)) => Values::Bool(v.iter().map(|&x| x != 0.0).collect()),
        (Kind::Bool, Values::I64(v)) => Values::Bool(v.iter().map(|&x| x != 0).collect()),
        (Kind::Bool, Values::U8(v)) => Values::Bool(v.iter().map(|&x| x != 0).collect()),
        (_, same) => each!(same, v => v.clone()),
    };
    one(Tensor::of(tensor.shape().to_vec(), values))
}

/// Inference drops nothing: the numbers, and a mask that is true everywhere.
pub fn dropout(call: &Call<'_>) -> Done {
    if let Some(training) = call.optional(2)
        && *training.values() == Values::Bool(vec![true])
    {
        return Err("training_mode is true; export the model for inference".to_owned());
    }
    let tensor = call.input(0)?;
    let mask = Values::Bool(vec![true; tensor.values().len()]);
    Ok(vec![tensor.clone(), Tensor::of(tensor.shape().to_vec(), mask)?])
}
