//! The operators: what each computes, and the attributes that it takes.

mod conv;
mod elementwise;
mod matmul;
mod normalise;
mod pool;
mod product;
mod recurrent;
mod reduce;
mod resize;
mod shape;
mod window;

use crate::call::{Call, Done};
use crate::proto::Attribute;

/// An operator of ONNX.
pub(crate) struct Operator {
    pub name: &'static str,
    pub run: fn(&Call<'_>) -> Done,
    /// Attributes that are read.
    attributes: &'static [&'static str],
}

/// Attributes that change nothing here.
const WITHOUT_EFFECT: [&str; 4] = ["stash_type", "momentum", "saturate", "seed"];

impl Operator {
    pub fn named(name: &str) -> Option<&'static Self> {
        OPERATORS.iter().find(|operator| operator.name == name)
    }

    /// Checks that all attributes are known, so that none is passed over.
    pub fn check(&self, attributes: &[Attribute]) -> Result<(), String> {
        let known = |name: &str| self.attributes.contains(&name) || WITHOUT_EFFECT.contains(&name);
        match attributes.iter().find(|a| !known(&a.name)) {
            Some(a) => Err(format!("attribute `{}` is not supported", a.name)),
            None => Ok(()),
        }
    }
}

/// Names of the operators, in the order of the alphabet.
pub fn operators() -> Vec<&'static str> {
    let mut names: Vec<&str> = OPERATORS.iter().map(|operator| operator.name).collect();
    names.sort_unstable();
    names
}

const fn op(name: &'static str, run: fn(&Call<'_>) -> Done, attributes: &'static [&'static str]) -> Operator {
    Operator { name, run, attributes }
}

const WINDOW: &[&str] = &["auto_pad", "dilations", "group", "kernel_shape", "pads", "strides"];
const POOL: &[&str] = &[
    "auto_pad",
    "ceil_mode",
    "count_include_pad",
    "dilations",
    "kernel_shape",
    "pads",
    "storage_order",
    "strides",
];
const REDUCE: &[&str] = &["axes", "keepdims", "noop_with_empty_axes"];
const EXTREME: &[&str] = &["axis", "keepdims", "select_last_index"];

static OPERATORS: &[Operator] = &[
    op("Abs", elementwise::abs, &[]),
    op("Add", elementwise::add, &[]),
    op("And", elementwise::and, &[]),
    op("ArgMax", reduce::arg_max, EXTREME),
    op("ArgMin", reduce::arg_min, EXTREME),
    op("AveragePool", pool::average_pool, POOL),
    op("BatchNormalization", normalise::batch, &["epsilon", "training_mode"]),
    op("Cast", elementwise::cast, &["to"]),
    op("Ceil", elementwise::ceil, &[]),
    op("Clip", elementwise::clip, &[]),
    op("Concat", shape::concat, &["axis"]),
    op("Constant", shape::constant, &["value", "value_float", "value_floats", "value_int", "value_ints"]),
    op("ConstantOfShape", shape::filled, &["value"]),
    op("Conv", conv::conv, WINDOW),
    op(
        "ConvTranspose",
        conv::conv_transpose,
        &[
            "auto_pad",
            "dilations",
            "group",
            "kernel_shape",
            "output_padding",
            "output_shape",
            "pads",
            "strides",
        ],
    ),
    op("Cos", elementwise::cos, &[]),
    op("DepthToSpace", shape::depth_to_space, &["blocksize", "mode"]),
    op("Div", elementwise::div, &[]),
    op("Dropout", elementwise::dropout, &[]),
    op("Elu", elementwise::elu, &["alpha"]),
    op("Equal", elementwise::equal, &[]),
    op("Erf", elementwise::erf, &[]),
    op("Exp", elementwise::exp, &[]),
    op("Expand", shape::expand, &[]),
    op("Flatten", shape::flatten, &["axis"]),
    op("Floor", elementwise::floor, &[]),
    op("GRU", recurrent::gru, &["direction", "hidden_size", "layout", "linear_before_reset"]),
    op("Gather", shape::gather, &["axis"]),
    op("GatherElements", shape::gather_elements, &["axis"]),
    op("Gelu", elementwise::gelu, &["approximate"]),
    op("Gemm", matmul::gemm, &["alpha", "beta", "transA", "transB"]),
    op("GlobalAveragePool", reduce::global_average, &[]),
    op("GlobalMaxPool", reduce::global_max, &[]),
    op("Greater", elementwise::greater, &[]),
    op("GreaterOrEqual", elementwise::greater_or_equal, &[]),
    op("GroupNormalization", normalise::group, &["epsilon", "num_groups"]),
    op("HardSigmoid", elementwise::hard_sigmoid, &["alpha", "beta"]),
    op("HardSwish", elementwise::hard_swish, &[]),
    op("Identity", elementwise::identity, &[]),
    op("InstanceNormalization", normalise::instance, &["epsilon"]),
    op("LSTM", recurrent::lstm, &["direction", "hidden_size", "layout"]),
    op("LayerNormalization", normalise::layer, &["axis", "epsilon"]),
    op("LeakyRelu", elementwise::leaky_relu, &["alpha"]),
    op("Less", elementwise::less, &[]),
    op("LessOrEqual", elementwise::less_or_equal, &[]),
    op("Log", elementwise::log, &[]),
    op("LogSoftmax", normalise::log_softmax, &["axis"]),
    op("MatMul", matmul::matmul, &[]),
    op("Max", elementwise::max, &[]),
    op("MaxPool", pool::max_pool, POOL),
    op("Min", elementwise::min, &[]),
    op("Mish", elementwise::mish, &[]),
    op("Mod", elementwise::modulo, &["fmod"]),
    op("Mul", elementwise::mul, &[]),
    op("Neg", elementwise::neg, &[]),
    op("Not", elementwise::not, &[]),
    op("Or", elementwise::or, &[]),
    op("PRelu", elementwise::prelu, &[]),
    op("Pad", shape::pad, &["mode"]),
    op("Pow", elementwise::pow, &[]),
    op("Range", shape::range, &[]),
    op("Reciprocal", elementwise::reciprocal, &[]),
    op("ReduceL1", reduce::l1, REDUCE),
    op("ReduceL2", reduce::l2, REDUCE),
    op("ReduceMax", reduce::max, REDUCE),
    op("ReduceMean", reduce::mean, REDUCE),
    op("ReduceMin", reduce::min, REDUCE),
    op("ReduceProd", reduce::product, REDUCE),
    op("ReduceSum", reduce::sum, REDUCE),
    op("ReduceSumSquare", reduce::sum_square, REDUCE),
    op("Relu", elementwise::relu, &[]),
    op("Reshape", shape::reshape, &["allowzero"]),
    op(
        "Resize",
        resize::resize,
        &[
            "antialias",
            "axes",
            "coordinate_transformation_mode",
            "cubic_coeff_a",
            "exclude_outside",
            "extrapolation_value",
            "keep_aspect_ratio_policy",
            "mode",
            "nearest_mode",
        ],
    ),
    op("Round", elementwise::round, &[]),
    op("Selu", elementwise::selu, &["alpha", "gamma"]),
    op("Shape", shape::shape, &["end", "start"]),
    op("Sigmoid", elementwise::sigmoid, &[]),
    op("Sign", elementwise::sign, &[]),
    op("Sin", elementwise::sin, &[]),
    op("Size", shape::size, &[]),
    op("Slice", shape::slice, &[]),
    op("Softmax", normalise::softmax, &["axis"]),
    op("Softplus", elementwise::softplus, &[]),
    op("Split", shape::split, &["axis", "num_outputs"]),
    op("Sqrt", elementwise::sqrt, &[]),
    op("Squeeze", shape::squeeze, &[]),
    op("Sub", elementwise::sub, &[]),
    op("Sum", elementwise::add, &[]),
    op("Tanh", elementwise::tanh, &[]),
    op("Tile", shape::tile, &[]),
    op("Transpose", shape::transpose, &["perm"]),
    op("Unsqueeze", shape::unsqueeze, &[]),
    op("Where", elementwise::choose, &[]),
    op("Xor", elementwise::xor, &[]),
];

#[cfg(test)]
#[path = "ops_tests.rs"]
mod tests;
