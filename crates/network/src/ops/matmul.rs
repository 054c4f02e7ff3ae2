//! Products of matrices.

use std::borrow::Cow;

use crate::call::{Call, Done, one};
use crate::ops::product::{Sizes, multiply};
use crate::tensor::{Tensor, Values, count, rows, spread, spread_strides};

/// Products of the last two dimensions, for every index of the others. A vector is one row on the left, one column on the right.
pub fn matmul(call: &Call<'_>) -> Done {
    let (a, b) = (call.input(0)?.shape(), call.input(1)?.shape());
    let (x, y) = (call.numbers(0)?, call.numbers(1)?);
    let (a_outer, height, depth) = match a {
        [outer @ .., rows, depth] => (outer, *rows, *depth),
        [depth] => (a.split_at(0).0, 1, *depth),
        [] => return Err("a single number has no rows".to_owned()),
    };
    let (b_outer, first, columns) = match b {
        [outer @ .., depth, columns] => (outer, *depth, *columns),
        [depth] => (b.split_at(0).0, *depth, 1),
        [] => return Err("a single number has no columns".to_owned()),
    };
    if depth != first {
        return Err(format!("shapes {a:?} and {b:?} do not fit together"));
    }
    let outer = spread(a_outer, b_outer)?;
    let mut shape = outer.clone();
    shape.extend((a.len() > 1).then_some(height));
    shape.extend((b.len() > 1).then_some(columns));
    let n = count(&shape)?;
    call.spend(&[n, depth])?;
    let mut product = vec![0.0; n];
    let sizes = |rows: usize| Sizes { rows, depth, columns };
    if y.len() == depth * columns {
        // One matrix on the right serves all rows on the left.
        multiply(x, y, &mut product, sizes(n.checked_div(columns).unwrap_or(0)));
        return one(Tensor::of(shape, Values::F32(product)));
    }
    let each = |own: &[usize], size: usize| -> Vec<isize> {
        spread_strides(own, &outer).into_iter().map(|step| step * size as isize).collect()
    };
    let (a_size, b_size) = (height * depth, depth * columns);
    let mut parts = product.chunks_exact_mut((height * columns).max(1));
    rows(&outer, [&each(a_outer, a_size), &each(b_outer, b_size)], |at, n, step| {
        for (i, part) in (0..n as isize).zip(&mut parts) {
            let [p, q] = [0, 1].map(|k| (at[k] + i * step[k]) as usize);
            multiply(&x[p..p + a_size], &y[q..q + b_size], part, sizes(height));
        }
    });
    one(Tensor::of(shape, Values::F32(product)))
}

/// alpha A B + beta C; A and B may be turned.
pub fn gemm(call: &Call<'_>) -> Done {
    let [a, b] = [matrix(call, 0, "transA")?, matrix(call, 1, "transB")?];
    let (&[rows, depth], &[first, columns]) = (a.shape(), b.shape()) else { unreachable!("matrices") };
    if depth != first {
        return Err(format!("shapes {:?} and {:?} do not fit together", a.shape(), b.shape()));
    }
    call.spend(&[rows, depth, columns])?;
    let (alpha, beta) = (call.float("alpha", 1.0), call.float("beta", 1.0));
    let mut product = vec![0.0; count(&[rows, columns])?];
    let sizes = Sizes { rows, depth, columns };
    multiply(a.as_f32().unwrap_or_default(), b.as_f32().unwrap_or_default(), &mut product, sizes);
    if alpha != 1.0 {
        product.iter_mut().for_each(|x| *x *= alpha);
    }
    if let Some(c) = call.optional(2) {
        let shape = [rows, columns];
        if spread(c.shape(), &shape)? != shape {
            return Err(format!("shape {:?} does not fit the product's {shape:?}", c.shape()));
        }
        let c = c.strided(shape.to_vec(), 0, &spread_strides(c.shape(), &shape))?;
        let c = crate::call::numbers(&c, 2)?;
        product.iter_mut().zip(c).for_each(|(x, &c)| *x += beta * c);
    }
    one(Tensor::of(vec![rows, columns], Values::F32(product)))
}

/// A matrix, turned if an attribute says so.
fn matrix<'a>(call: &Call<'a>, i: usize, turned: &str) -> Result<Cow<'a, Tensor>, String> {
    call.numbers(i)?;
    let tensor = call.input(i)?;
    let &[rows, columns] = tensor.shape() else {
        return Err(format!("input {i} has shape {:?}, which is no matrix", tensor.shape()));
    };
    match call.flag(turned, false) {
        true => tensor.strided(vec![columns, rows], 0, &[1, columns as isize]).map(Cow::Owned),
        false => Ok(Cow::Borrowed(tensor)),
    }
}
