//! Arrays of numbers, and walks over them.

/// Largest number of elements of an array. Our own choice: 256 times a picture of 256 x 256 pixels.
pub const ELEMENTS_MAX: usize = 1 << 24;
/// Largest number of dimensions of an array. Our own choice.
pub const RANK_MAX: usize = 8;

/// The numbers of an array, row by row.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// 32-bit floating-point numbers.
    F32(Vec<f32>),
    /// Whole numbers: ONNX's INT64 and INT32.
    I64(Vec<i64>),
    /// Bytes.
    U8(Vec<u8>),
    /// Truth values.
    Bool(Vec<bool>),
}

/// Calls a generic expression on the numbers of whatever type, and wraps what it gives in the same type.
macro_rules! each {
    ($values:expr, $v:ident => $body:expr) => {
        match $values {
            Values::F32($v) => Values::F32($body),
            Values::I64($v) => Values::I64($body),
            Values::U8($v) => Values::U8($body),
            Values::Bool($v) => Values::Bool($body),
        }
    };
}
pub(crate) use each;

impl Values {
    /// Number of elements.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::I64(v) => v.len(),
            Self::U8(v) => v.len(),
            Self::Bool(v) => v.len(),
        }
    }

    /// True without elements.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The type of the elements, by ONNX's name.
    pub fn kind(&self) -> Kind {
        match self {
            Self::F32(_) => Kind::F32,
            Self::I64(_) => Kind::I64,
            Self::U8(_) => Kind::U8,
            Self::Bool(_) => Kind::Bool,
        }
    }
}

/// Type of the elements of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// FLOAT.
    F32,
    /// INT64, and INT32, which is kept as INT64.
    I64,
    /// UINT8.
    U8,
    /// BOOL.
    Bool,
}

impl Kind {
    /// The type of a number of ONNX's `TensorProto.DataType`; the error names one that is not supported.
    pub(crate) fn of(data_type: i32) -> Result<Self, String> {
        const NAMES: [&str; 24] = [
            "UNDEFINED",
            "FLOAT",
            "UINT8",
            "INT8",
            "UINT16",
            "INT16",
            "INT32",
            "INT64",
            "STRING",
            "BOOL",
            "FLOAT16",
            "DOUBLE",
            "UINT32",
            "UINT64",
            "COMPLEX64",
            "COMPLEX128",
            "BFLOAT16",
            "FLOAT8E4M3FN",
            "FLOAT8E4M3FNUZ",
            "FLOAT8E5M2",
            "FLOAT8E5M2FNUZ",
            "UINT4",
            "INT4",
            "FLOAT4E2M1",
        ];
        match data_type {
            1 => Ok(Self::F32),
            2 => Ok(Self::U8),
            6 | 7 => Ok(Self::I64),
            9 => Ok(Self::Bool),
            other => {
                let name = usize::try_from(other).ok().and_then(|i| NAMES.get(i)).unwrap_or(&"unknown");
                Err(format!(
                    "numbers of type {name} are not supported; use FLOAT, INT64, INT32, UINT8 or BOOL"
                ))
            }
        }
    }

    /// ONNX's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "FLOAT",
            Self::I64 => "INT64",
            Self::U8 => "UINT8",
            Self::Bool => "BOOL",
        }
    }
}

/// An array of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    shape: Vec<usize>,
    values: Values,
}

impl Tensor {
    /// Makes an array; `None` if the number of values is not that of the shape.
    pub fn new(shape: Vec<usize>, values: Values) -> Option<Self> {
        (count(&shape) == Ok(values.len())).then_some(Self { shape, values })
    }

    /// Makes an array of 32-bit numbers; `None` if their number is not that of the shape.
    pub fn f32(shape: &[usize], values: Vec<f32>) -> Option<Self> {
        Self::new(shape.to_vec(), Values::F32(values))
    }

    /// An array of zeros (or false).
    pub(crate) fn zeros(shape: Vec<usize>, kind: Kind) -> Result<Self, String> {
        let n = count(&shape)?;
        let values = match kind {
            Kind::F32 => Values::F32(vec![0.0; n]),
            Kind::I64 => Values::I64(vec![0; n]),
            Kind::U8 => Values::U8(vec![0; n]),
            Kind::Bool => Values::Bool(vec![false; n]),
        };
        Ok(Self { shape, values })
    }

    /// Makes an array; for operators, whose numbers of values are right.
    pub(crate) fn of(shape: Vec<usize>, values: Values) -> Result<Self, String> {
        let n = values.len();
        Self::new(shape, values).ok_or_else(|| format!("{n} numbers do not fill the shape"))
    }

    /// Lengths of its dimensions.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// The numbers, row by row.
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// The numbers without the shape.
    pub(crate) fn into_values(self) -> Values {
        self.values
    }

    /// The numbers, if they are 32-bit floating-point numbers.
    pub fn as_f32(&self) -> Option<&[f32]> {
        match &self.values {
            Values::F32(v) => Some(v),
            _ => None,
        }
    }

    /// Returns the numbers in another shape of the same size.
    pub(crate) fn reshaped(&self, shape: Vec<usize>) -> Result<Self, String> {
        if count(&shape)? != self.values.len() {
            return Err(format!("shape {:?} cannot become {shape:?}", self.shape));
        }
        Ok(Self { shape, values: self.values.clone() })
    }

    /// Writes an array of the same type into this one: in blocks of `own` numbers, from place `at` of each block of `whole` numbers on.
    pub(crate) fn write(&mut self, part: &Self, own: usize, whole: usize, at: usize) {
        fn copy<T: Copy>(to: &mut [T], from: &[T], own: usize, whole: usize, at: usize) {
            for (to, from) in to.chunks_exact_mut(whole.max(1)).zip(from.chunks_exact(own.max(1))) {
                to[at..at + own].copy_from_slice(from);
            }
        }
        match (&mut self.values, &part.values) {
            (Values::F32(to), Values::F32(from)) => copy(to, from, own, whole, at),
            (Values::I64(to), Values::I64(from)) => copy(to, from, own, whole, at),
            (Values::U8(to), Values::U8(from)) => copy(to, from, own, whole, at),
            (Values::Bool(to), Values::Bool(from)) => copy(to, from, own, whole, at),
            _ => {}
        }
    }

    /// The elements at `base + sum of index * stride` for every index of a shape, in the order of the indices.
    ///
    /// All places must be within the array.
    pub(crate) fn strided(&self, shape: Vec<usize>, base: usize, strides: &[isize]) -> Result<Self, String> {
        count(&shape)?;
        let values = each!(&self.values, v => gather(v, &shape, base, strides));
        Ok(Self { shape, values })
    }
}

/// Number of elements of a shape; the error says that it is too large.
pub(crate) fn count(shape: &[usize]) -> Result<usize, String> {
    let product = shape.iter().try_fold(1_usize, |n, &d| n.checked_mul(d)).filter(|&n| n <= ELEMENTS_MAX);
    if shape.len() > RANK_MAX {
        return Err(format!("shape {shape:?} has more than {RANK_MAX} dimensions"));
    }
    product.ok_or_else(|| format!("an array of shape {shape:?} is larger than {ELEMENTS_MAX} numbers"))
}

/// Steps from element to element along each dimension of a dense array.
pub(crate) fn strides(shape: &[usize]) -> Vec<isize> {
    let mut steps = vec![1_isize; shape.len()];
    for i in (1..shape.len()).rev() {
        steps[i - 1] = steps[i] * shape[i] as isize;
    }
    steps
}

fn gather<T: Copy>(v: &[T], shape: &[usize], base: usize, strides: &[isize]) -> Vec<T> {
    let mut out = Vec::with_capacity(shape.iter().product());
    rows(shape, [strides], |[start], n, [step]| {
        let at = |k: usize| (base as isize + start + step * k as isize) as usize;
        if step == 1 && n > 0 {
            out.extend_from_slice(&v[at(0)..at(0) + n]);
        } else {
            out.extend((0..n).map(|k| v[at(k)]));
        }
    });
    out
}

/// Walks over all indices of a shape but those of the last dimension: calls a function with the offset in each of several arrays, the length of
/// the last dimension and the steps along it.
pub(crate) fn rows<const N: usize>(
    shape: &[usize],
    strides: [&[isize]; N],
    mut row: impl FnMut([isize; N], usize, [isize; N]),
) {
    let Some((&length, outer)) = shape.split_last() else {
        row([0; N], 1, [1; N]);
        return;
    };
    if shape.contains(&0) {
        return;
    }
    let steps = strides.map(|s| s[outer.len()]);
    let (mut index, mut at) = (vec![0; outer.len()], [0; N]);
    loop {
        row(at, length, steps);
        let mut d = outer.len();
        loop {
            if d == 0 {
                return;
            }
            d -= 1;
            index[d] += 1;
            for (at, strides) in at.iter_mut().zip(&strides) {
                *at += strides[d];
            }
            if index[d] < outer[d] {
                break;
            }
            for (at, strides) in at.iter_mut().zip(&strides) {
                *at -= strides[d] * index[d] as isize;
            }
            index[d] = 0;
        }
    }
}

/// The shape to which two shapes are spread together, by numpy's rule.
pub(crate) fn spread(a: &[usize], b: &[usize]) -> Result<Vec<usize>, String> {
    let rank = a.len().max(b.len());
    let at = |s: &[usize], i: usize| (i + s.len()).checked_sub(rank).map_or(1, |i| s[i]);
    let shape = (0..rank).map(|i| match (at(a, i), at(b, i)) {
        (x, y) if x == y || y == 1 => Ok(x),
        (1, y) => Ok(y),
        _ => Err(format!("shapes {a:?} and {b:?} do not fit together")),
    });
    let shape = shape.collect::<Result<Vec<_>, _>>()?;
    count(&shape)?;
    Ok(shape)
}

/// Steps of an array that is spread to a shape: 0 along its dimensions of length 1.
pub(crate) fn spread_strides(own: &[usize], shape: &[usize]) -> Vec<isize> {
    let missing = shape.len() - own.len();
    let steps = strides(own);
    let of = |i: usize| if own[i] == 1 { 0 } else { steps[i] };
    (0..shape.len()).map(|i| i.checked_sub(missing).map_or(0, of)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walks_visit_every_element_once() {
        let v = Tensor::f32(&[2, 3, 2], (0..12).map(|x| x as f32).collect()).unwrap();
        let t = v.strided(vec![2, 2, 3], 0, &[6, 1, 2]).unwrap();
        assert_eq!(t.as_f32().unwrap(), [0., 2., 4., 1., 3., 5., 6., 8., 10., 7., 9., 11.]);
        let reversed = v.strided(vec![3], 4, &[-2]).unwrap();
        assert_eq!(reversed.as_f32().unwrap(), [4., 2., 0.]);
        assert_eq!(v.strided(vec![], 7, &[]).unwrap().as_f32().unwrap(), [7.0]);
        assert_eq!(v.strided(vec![2, 0], 0, &[1, 1]).unwrap().as_f32().unwrap(), [0.0_f32; 0]);
    }

    #[test]
    fn shapes_spread_as_in_numpy() {
        assert_eq!(spread(&[4, 1, 3], &[5, 1]).unwrap(), [4, 5, 3]);
        assert_eq!(spread(&[], &[2]).unwrap(), [2]);
        assert!(spread(&[2], &[3]).unwrap_err().contains("do not fit"));
        assert_eq!(spread_strides(&[5, 1], &[4, 5, 3]), [0, 1, 0]);
        assert!(count(&[1 << 20, 1 << 20]).unwrap_err().contains("larger than"));
        assert_eq!(count(&[0, usize::MAX]), Ok(0));
    }
}
