"""Writes small networks with inputs and with the outputs that ONNX Runtime and ONNX's reference implementation give.

usage: models.py FOLDER

For each case it writes NAME.onnx, NAME.in (the numbers of the inputs) and NAME.npz (the outputs of both). `cargo xtask check-network` runs it.
"""

import pathlib
import sys

import numpy as np
import onnx
import onnxruntime
from onnx import helper, numpy_helper
from onnx.reference import ReferenceEvaluator

TYPES = {"float": np.float32, "int64": np.int64, "uint8": np.uint8, "bool": np.bool_}

# Name, inputs, nodes; upper-case names are stored arrays, filled by seeded random numbers unless CONSTANTS has them.
CASES = [
    ("unary", "float[2,3,5] x", """
        a = Relu(x)
        b = LeakyRelu<alpha: float = 0.2>(x)
        c = Elu<alpha: float = 1.3>(a_)
        d = Sigmoid(x)
        e = Tanh(x)
        f = Softplus(x)
        g = Erf(x)
        h = Exp(x)
        i = HardSigmoid<alpha: float = 0.3, beta: float = 0.4>(x)
        j = HardSwish(x)
        k = Selu(x)
        l = Neg(x)
        m = Floor(x)
        n = Round(x)
        o = Sign(x)
        p = Sin(x)
        q = Cos(x)
        r = Ceil(x)
        s = Reciprocal(x)
        y = Concat<axis: int = 0>(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s)""".replace("a_", "x")),
    ("roots", "float[7] x", "a = Abs(x)\n b = Sqrt(a)\n c = Log(a)\n d = Pow(a, SCALAR)\n y = Concat<axis: int = 0>(a, b, c, d)"),
    ("gelu", "float[3,40] x", "a = Gelu(x)\n b = Gelu<approximate: string = \"tanh\">(x)\n c = Mish(x)\n y = Add(a, b)\n z = Mul(y, c)"),
    ("arithmetic", "float[4,1,3] a, float[5,1] b, float[3] c", """
        d = Add(a, b)
        e = Sub(d, c)
        f = Mul(e, b)
        g = Div(f, SCALAR)
        h = Min(g, a, c)
        i = Max(h, b)
        y = Pow(i, TWO)"""),
    ("compare", "float[3,4] a, float[4] b", """
        c = Greater(a, b)
        d = Less(a, b)
        e = Or(c, d)
        f = Not(e)
        g = GreaterOrEqual(a, b)
        h = And(e, g)
        i = Equal(h, f)
        j = LessOrEqual(b, a)
        k = Xor(i, j)
        y = Where(k, a, b)"""),
    ("whole", "int64[4,3] a", """
        b = Add(a, ONE_I)
        c = Mul(b, b)
        d = Div(c, THREE_I)
        e = Mod(a, THREE_I)
        f = Cast<to: int = 1>(d)
        g = Cast<to: int = 1>(e)
        y = Sub(f, g)"""),
    ("clip", "float[9] x", "a = Clip(x, LOW, HIGH)\n b = Clip(x, LOW)\n y = Add(a, b)"),
    ("prelu", "float[2,3,4] x", "y = PRelu(x, SLOPE)"),
    ("gemm", "float[3,17] x", "a = Gemm(x, W, B)\n b = Relu(a)\n y = Gemm<transB: int = 1, alpha: float = 0.5, beta: float = 2.0>(b, V, C)"),
    ("gemm_turned", "float[17,3] x", "y = Gemm<transA: int = 1>(x, W)"),
    ("matmul", "float[2,3,5,7] x", "a = MatMul(x, A)\n y = MatMul(STACK, a)"),
    ("matmul_vector", "float[7] x", "a = MatMul(x, A)\n y = MatMul(a, V)"),
    ("mlp", "float[1,32] agent", """
        a = Gemm<transB: int = 1>(agent, W1, B1)
        b = Tanh(a)
        c = Gemm<transB: int = 1>(b, W2, B2)
        d = Elu(c)
        y = Gemm<transB: int = 1>(d, W3, B3)"""),
    ("conv", "float[2,3,9,11] x", "y = Conv<pads: ints = [1,2,0,1], strides: ints = [2,1]>(x, CW, CB)"),
    ("conv_dilated", "float[1,4,12,9] x", "y = Conv<group: int = 2, dilations: ints = [2,1], pads: ints = [2,1,2,1], strides: ints = [2,2]>(x, GW, GB)"),
    ("conv_same", "float[1,4,12,9] x", """
        a = Conv<group: int = 2, auto_pad: string = "SAME_UPPER", strides: ints = [2,2]>(x, GW, GB)
        b = Conv<group: int = 2, auto_pad: string = "SAME_LOWER">(x, GE)
        c = Flatten(a)
        d = Flatten(b)
        y = Concat<axis: int = 1>(c, d)"""),
    ("conv_depthwise", "float[1,6,20,20] x", "a = Conv<group: int = 6, pads: ints = [1,1,1,1]>(x, DW)\n y = Conv(a, PW)"),
    ("conv_1d", "float[2,3,20] x", "y = Conv<pads: ints = [2,2], dilations: ints = [2]>(x, LW, LB)"),
    ("conv_transpose", "float[2,3,5,6] x", "y = ConvTranspose<strides: ints = [2,2], pads: ints = [1,1,0,1], output_padding: ints = [1,0], group: int = 1>(x, TW, TB)"),
    ("conv_transpose_1d", "float[1,4,7] x", "y = ConvTranspose<strides: ints = [3], group: int = 2, dilations: ints = [2]>(x, TL)"),
    ("pools", "float[1,3,11,10] x", """
        a = MaxPool<kernel_shape: ints = [3,2], strides: ints = [2,2], pads: ints = [1,0,1,1]>(x)
        b = AveragePool<kernel_shape: ints = [3,2], strides: ints = [2,2], pads: ints = [1,0,1,1]>(x)
        c = AveragePool<kernel_shape: ints = [3,2], strides: ints = [2,2], pads: ints = [1,0,1,1], count_include_pad: int = 1>(x)
        d = MaxPool<kernel_shape: ints = [3,3], strides: ints = [2,2], ceil_mode: int = 1>(x)
        e = Concat<axis: int = 1>(a, b, c)
        f = Flatten(d)
        g = GlobalAveragePool(e)
        h = GlobalMaxPool(e)
        i = Flatten(e)
        j = Flatten(g)
        k = Flatten(h)
        y = Concat<axis: int = 1>(f, i, j, k)"""),
    ("batch_norm", "float[2,4,3,3] x", "y = BatchNormalization<epsilon: float = 0.001>(x, S4, B4, M4, V4)"),
    ("norms", "float[2,4,6] x", """
        a = LayerNormalization(x, S6, B6)
        b = InstanceNormalization(a, S4, B4)
        y = Softmax<axis: int = 1>(b)"""),
    ("group_norm", "float[2,4,3,2] x", "y = GroupNormalization<num_groups: int = 2>(x, S4, B4)"),
    ("softmax", "float[3,4,5] x", "a = Softmax(x)\n b = LogSoftmax<axis: int = 0>(x)\n y = Add(a, b)"),
    ("attention", "float[1,6,8] x", """
        q0 = MatMul(x, WQ)
        k0 = MatMul(x, WK)
        v0 = MatMul(x, WV)
        q1 = Reshape(q0, HEADS)
        k1 = Reshape(k0, HEADS)
        v1 = Reshape(v0, HEADS)
        q = Transpose<perm: ints = [0,2,1,3]>(q1)
        k = Transpose<perm: ints = [0,2,3,1]>(k1)
        v = Transpose<perm: ints = [0,2,1,3]>(v1)
        s0 = MatMul(q, k)
        s = Div(s0, TWO)
        p = Softmax<axis: int = -1>(s)
        o0 = MatMul(p, v)
        o1 = Transpose<perm: ints = [0,2,1,3]>(o0)
        o = Reshape(o1, JOINED)
        r = Add(o, x)
        y = LayerNormalization(r, S8, B8)"""),
    ("reduce", "float[3,4,5] x", """
        a = ReduceMean<keepdims: int = 0>(x, AXIS1)
        b = ReduceSum<keepdims: int = 0>(x, AXIS1)
        c = ReduceMax<keepdims: int = 0>(x, AXIS1)
        d = ReduceMin<keepdims: int = 0>(x, AXIS1)
        e = ReduceL2<keepdims: int = 0>(x, AXIS1)
        f = ReduceL1<keepdims: int = 0>(x, AXIS1)
        g = ReduceProd<keepdims: int = 0>(x, AXIS1)
        h = ReduceSumSquare<keepdims: int = 0>(x, AXIS1)
        i = Sum(a, b, c)
        j = ReduceMean(x)
        k = Concat<axis: int = 0>(d, e, f, g, h, i)
        y = Add(k, j)"""),
    ("extremes", "float[4,6] x", "a = ArgMax<axis: int = 1>(x)\n b = ArgMin<axis: int = 0, keepdims: int = 0>(x)\n c = Add(a, b)\n y = Cast<to: int = 1>(c)"),
    ("shapes", "float[2,3,4] x", """
        a = Transpose(x)
        b = Unsqueeze(a, AXES02)
        c = Squeeze(b, AXIS0)
        d = Expand(c, WIDE)
        e = Tile(d, REPEATS)
        f = Shape(e)
        g = Reshape(e, MINUS_ONE)
        h = Cast<to: int = 1>(f)
        y = Concat<axis: int = 0>(g, h)"""),
    ("slices", "float[5,6,4] x", """
        a = Slice(x, STARTS, ENDS, SLICE_AXES, STEPS)
        b, c = Split<axis: int = 1, num_outputs: int = 2>(x)
        d = Flatten<axis: int = 0>(a)
        e = Flatten<axis: int = 0>(b)
        f = Flatten<axis: int = 0>(c)
        y = Concat<axis: int = 1>(d, e, f)"""),
    ("gathers", "float[5,4] x, int64[2,3] i", """
        a = Gather(x, i)
        b = Gather<axis: int = 1>(x, ROWS)
        c = GatherElements<axis: int = 1>(x, ELEMENTS)
        d = Flatten<axis: int = 0>(a)
        e = Flatten<axis: int = 0>(b)
        f = Flatten<axis: int = 0>(c)
        y = Concat<axis: int = 1>(d, e, f)"""),
    ("made", "float[3] x", """
        s = Shape(x)
        n = Size(x)
        a = ConstantOfShape<value: tensor = float[1] {1.5}>(s)
        r = Range(ZERO_I, n, ONE_S)
        b = Cast<to: int = 1>(r)
        c = Add(a, b)
        y = Mul(c, x)"""),
    ("pads", "float[2,3,4] x", """
        a = Pad(x, PADS, SCALAR)
        b = Pad<mode: string = "edge">(x, PADS)
        c = Pad<mode: string = "reflect">(x, PADS)
        y = Sum(a, b, c)"""),
    ("resize", "float[1,2,5,4] x", """
        a = Resize<mode: string = "nearest", coordinate_transformation_mode: string = "asymmetric", nearest_mode: string = "floor">(x, , SCALES)
        b = Resize<mode: string = "linear", coordinate_transformation_mode: string = "half_pixel">(x, , , SIZES)
        c = Resize<mode: string = "linear", coordinate_transformation_mode: string = "align_corners">(x, , , SIZES)
        d = Flatten(a)
        e = Sum(b, c)
        f = Flatten(e)
        y = Concat<axis: int = 1>(d, f)"""),
    ("depth_to_space", "float[1,12,2,3] x", "a = DepthToSpace<blocksize: int = 2>(x)\n b = DepthToSpace<blocksize: int = 2, mode: string = \"CRD\">(x)\n y = Sub(a, b)"),
    ("bytes", "uint8[2,4,4,3] p", """
        a = Cast<to: int = 1>(p)
        b = Div(a, BYTE)
        c = Transpose<perm: ints = [0,3,1,2]>(b)
        y = Conv(c, C3)"""),
    ("gru", "float[4,2,3] x", "a, b = GRU<hidden_size: int = 5, linear_before_reset: int = 1>(x, GRU_W, GRU_R, GRU_B)\n c = Squeeze(a, AXIS1)\n y = Add(c, b)"),
    ("gru_before", "float[4,2,3] x, float[1,2,5] state_in", "a, b = GRU<hidden_size: int = 5>(x, GRU_W, GRU_R, GRU_B, , state_in)\n c = Squeeze(a, AXIS1)\n y = Add(c, b)"),
    ("lstm", "float[4,2,3] x, float[1,2,5] h, float[1,2,5] c", "a, b, d = LSTM<hidden_size: int = 5>(x, LSTM_W, LSTM_R, LSTM_B, , h, c)\n e = Squeeze(a, AXIS1)\n f = Add(e, b)\n y = Add(f, d)"),
    ("others", "float[4] x", "a = Constant<value_float: float = 2.5>()\n b = Identity(x)\n c = Dropout(b)\n y = Add(c, a)"),
    ("detector", "float[1,3,32,32] image", """
        a0 = Conv<strides: ints = [2,2], pads: ints = [1,1,1,1]>(image, Y1, Z1)
        a1 = Sigmoid(a0)
        a2 = Mul(a0, a1)
        b0, b1 = Split<axis: int = 1, num_outputs: int = 2>(a2)
        b2 = Conv<pads: ints = [1,1,1,1]>(b1, Y2, Z2)
        b3 = Add(b1, b2)
        b4 = MaxPool<kernel_shape: ints = [5,5], pads: ints = [2,2,2,2]>(b3)
        c0 = MaxPool<kernel_shape: ints = [2,2], strides: ints = [2,2]>(b4)
        c1 = Resize<mode: string = "nearest", coordinate_transformation_mode: string = "asymmetric", nearest_mode: string = "floor">(c0, , DOUBLE)
        d = Concat<axis: int = 1>(b0, b4, c1)
        e = Conv(d, Y3, Z3)
        f = Reshape(e, BOXES)
        g = Transpose<perm: ints = [0,2,1,3]>(f)
        h = Softmax<axis: int = 1>(g)
        i = Conv(h, BINS)
        y = Reshape(i, CORNERS)"""),
    ("policy_cnn", "float[1,64,64] depth, float[1,13] agent_pos", """
        d = Unsqueeze(depth, AXIS1)
        a1 = Conv<strides: ints = [4,4]>(d, N1, NB1)
        a2 = Relu(a1)
        a3 = Conv<strides: ints = [2,2]>(a2, N2, NB2)
        a4 = Relu(a3)
        a5 = Conv(a4, N3, NB3)
        a6 = Relu(a5)
        a7 = Flatten(a6)
        a8 = Gemm<transB: int = 1>(a7, N4, NB4)
        a9 = Relu(a8)
        b = Concat<axis: int = 1>(a9, agent_pos)
        c1 = Gemm<transB: int = 1>(b, N5, NB5)
        c2 = Relu(c1)
        action = Gemm<transB: int = 1>(c2, N6, NB6)"""),
]

# Shapes of stored arrays that are filled at random, by case and name, or by name alone.
SHAPES = {
    "SLOPE": (3, 1), "A": (7, 6), "V": (6,), "STACK": (3, 2, 5),
    "W": (17, 9), "B": (9,), "C": (5,),
    "W1": (24, 32), "B1": (24,), "W2": (16, 24), "B2": (16,), "W3": (11, 16), "B3": (11,),
    "CW": (5, 3, 3, 4), "CB": (5,), "GW": (6, 2, 3, 3), "GB": (6,), "GE": (6, 2, 2, 3), "DW": (6, 1, 3, 3), "PW": (7, 6, 1, 1),
    "LW": (4, 3, 5), "LB": (4,), "TW": (3, 4, 3, 3), "TB": (4,), "TL": (4, 3, 3), "C3": (4, 3, 2, 2),
    "S4": (4,), "B4": (4,), "M4": (4,), "S6": (6,), "B6": (6,), "S8": (8,), "B8": (8,),
    "WQ": (8, 8), "WK": (8, 8), "WV": (8, 8),
    "GRU_W": (1, 15, 3), "GRU_R": (1, 15, 5), "GRU_B": (1, 30), "LSTM_W": (1, 20, 3), "LSTM_R": (1, 20, 5), "LSTM_B": (1, 40),
    "Y1": (8, 3, 3, 3), "Z1": (8,), "Y2": (4, 4, 3, 3), "Z2": (4,), "Y3": (32, 12, 1, 1), "Z3": (32,), "BINS": (1, 8, 1, 1),
    "N1": (32, 1, 8, 8), "NB1": (32,), "N2": (64, 32, 4, 4), "NB2": (64,), "N3": (64, 64, 3, 3), "NB3": (64,),
    "N4": (512, 1024), "NB4": (512,), "N5": (256, 525), "NB5": (256,), "N6": (11, 256), "NB6": (11,),
}
SHAPES_OF = {("gemm", "V"): (5, 9)}

# Cases that ONNX's reference implementation of this version does not compute: groups in transposed convolutions.
REFERENCE_LACKS = ["conv_transpose_1d"]


def whole(*values):
    return np.array(values, dtype=np.int64)


CONSTANTS = {
    "SCALAR": np.float32(1.7), "TWO": np.float32(2.0), "LOW": np.float32(-0.3), "HIGH": np.float32(0.5), "BYTE": np.float32(255),
    "ONE_I": whole(1), "THREE_I": whole(3), "ZERO_I": np.int64(0), "ONE_S": np.int64(1),
    "V4": np.array([0.5, 1.0, 2.0, 0.1], dtype=np.float32),
    "HEADS": whole(1, 6, 2, 4), "JOINED": whole(1, 6, -1), "AXIS0": whole(0), "AXIS1": whole(1), "AXES02": whole(0, 2),
    "WIDE": whole(4, 5, 3, 2), "REPEATS": whole(1, 2, 1, 3), "MINUS_ONE": whole(-1),
    "STARTS": whole(-1, 1), "ENDS": whole(-6, 100), "SLICE_AXES": whole(0, 2), "STEPS": whole(-2, 2),
    "ROWS": whole(-1, 0), "ELEMENTS": np.array([[0, -1], [2, 1], [1, 1], [3, 0], [-2, 2]], dtype=np.int64),
    "DOUBLE": np.array([1, 1, 2, 2], dtype=np.float32), "BOXES": whole(1, 4, 8, 256), "CORNERS": whole(1, 4, -1),
    "PADS": whole(0, 1, 2, 1, 1, 1), "SCALES": np.array([1, 1, 2, 3], dtype=np.float32), "SIZES": whole(1, 2, 7, 3),
}


def model(name, inputs, nodes, random):
    """The model of a case; stored arrays are those whose names are in upper case."""
    body = "\n".join(line for line in nodes.splitlines() if line.strip())
    last = body.splitlines()[-1].split("=")[0].split(",")[0].strip()
    text = f'<ir_version: 9, opset_import: ["" : 21]> {name} ({inputs}) => (float {last}) {{ {body} }}'
    made = onnx.parser.parse_model(text)
    used = {i for node in made.graph.node for i in node.input if i and i.upper() == i and i[0].isalpha()}
    for constant in sorted(used):
        shape = SHAPES_OF.get((name, constant), SHAPES.get(constant))
        # Weights as networks have them: the more numbers are summed, the smaller each.
        most = 1 / np.sqrt(np.prod(shape[1:])) if shape else 1
        values = CONSTANTS[constant] if shape is None else random.uniform(-most, most, shape).astype(np.float32)
        made.graph.initializer.append(numpy_helper.from_array(np.asarray(values), constant))
    return made


def main(folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.*"):
        old.unlink()
    for name, inputs, nodes in CASES:
        random = np.random.default_rng(list(name.encode()))
        made = model(name, inputs, nodes, random)
        feeds = {}
        for info in made.graph.input:
            shape = [d.dim_value for d in info.type.tensor_type.shape.dim]
            kind = helper.tensor_dtype_to_np_dtype(info.type.tensor_type.elem_type)
            values = random.uniform(-2, 2, shape) if kind == np.float32 else random.integers(0, 4, shape)
            feeds[info.name] = np.asarray(values).astype(kind)
        made.graph.output[0].type.tensor_type.ClearField("shape")
        session = onnxruntime.InferenceSession(made.SerializeToString(), providers=["CPUExecutionProvider"])
        runtime = session.run(None, feeds)[0]
        output = made.graph.output[0]
        kind = helper.np_dtype_to_tensor_dtype(runtime.dtype)
        output.CopyFrom(helper.make_tensor_value_info(output.name, kind, runtime.shape))
        onnx.checker.check_model(made, full_check=True)
        reference = runtime if name in REFERENCE_LACKS else ReferenceEvaluator(made).run(None, feeds)[0]
        (folder / f"{name}.onnx").write_bytes(made.SerializeToString())
        (folder / f"{name}.in").write_bytes(b"".join(v.tobytes() for v in feeds.values()))
        np.savez(folder / f"{name}.npz", reference=reference.astype(np.float32), runtime=runtime.astype(np.float32))
    print(f"{len(CASES)} networks in {folder}")


if __name__ == "__main__":
    main(sys.argv[1])
