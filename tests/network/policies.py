"""Writes the tiny policies that the tests of learned controllers run, into this folder: harvest.onnx, reach.onnx and pixels.onnx of random weights, and
fault.onnx, whose actions are no numbers after 0.15 s.

They are for the robot ridgeback-fr3 and the camera `paper`. usage: policies.py, with the packages of requirements.txt.
"""

import pathlib

import numpy as np
import onnx
from onnx import numpy_helper

HARVEST = """<ir_version: 9, opset_import: ["" : 17]>
harvest (float[N,13] agent_pos, float[N,10] agent_vel, float[N,9] forces, float[N,144,192] depth, float[1,8] state_in_h)
    => (float[N,2,11] action, float[1,8] state_out_h) {
    d0 = Unsqueeze(depth, ONE)
    d1 = Conv<strides: ints = [8,8]>(d0, C1, D1)
    d2 = Relu(d1)
    d3 = AveragePool<kernel_shape: ints = [6,6], strides: ints = [6,6]>(d2)
    d4 = Flatten(d3)
    seen = Concat<axis: int = 1>(agent_pos, agent_vel, forces, d4, state_in_h)
    h0 = Gemm<transB: int = 1>(seen, W1, B1)
    state_out_h = Tanh(h0)
    a0 = Gemm<transB: int = 1>(state_out_h, W2, B2)
    a1 = Tanh(a0)
    action = Reshape(a1, CHUNK)
}"""

REACH = """<ir_version: 9, opset_import: ["" : 17]>
reach (float[1,13] agent_pos, float[1,4] target) => (float[1,11] action) {
    seen = Concat<axis: int = 1>(agent_pos, target)
    h0 = Gemm<transB: int = 1>(seen, W1, B1)
    h1 = Elu(h0)
    a0 = Gemm<transB: int = 1>(h1, W2, B2)
    action = Tanh(a0)
}"""

PIXELS = """<ir_version: 9, opset_import: ["" : 17]>
pixels (float[1,13] agent_pos, uint8[1,24,32,3] pixels_wrist, float[1,24,32,3] pixels_base) => (float[1,11] action) {
    w0 = Cast<to: int = 1>(pixels_wrist)
    both = Concat<axis: int = 3>(w0, pixels_base)
    first = Transpose<perm: ints = [0,3,1,2]>(both)
    scaled = Div(first, BRIGHT)
    c0 = Conv<strides: ints = [4,4]>(scaled, C1, D1)
    c1 = Relu(c0)
    c2 = Flatten(c1)
    seen = Concat<axis: int = 1>(agent_pos, c2)
    a0 = Gemm<transB: int = 1>(seen, W1, B1)
    action = Tanh(a0)
}"""

FAULT = """<ir_version: 9, opset_import: ["" : 17]>
fault (float[1,2] depth_time) => (float[1,11] action) {
    left = Gemm<transB: int = 1>(depth_time, W1, B1)
    action = Sqrt(left)
}"""

SHAPES = {
    "harvest": {"C1": (4, 1, 8, 8), "D1": (4,), "W1": (8, 88), "B1": (8,), "W2": (22, 8), "B2": (22,)},
    "reach": {"W1": (16, 17), "B1": (16,), "W2": (11, 16), "B2": (11,)},
    "pixels": {"C1": (2, 6, 4, 4), "D1": (2,), "W1": (11, 109), "B1": (11,)},
    "fault": {},
}
WHOLE = {"harvest": {"ONE": [1], "CHUNK": [1, 2, 11]}}
# 0.15 less the time now, for each number of the action.
GIVEN = {"pixels": {"BRIGHT": [255.0]}, "fault": {"W1": [[0.0, -1.0]] * 11, "B1": [0.15] * 11}}

for name, text in (("harvest", HARVEST), ("reach", REACH), ("pixels", PIXELS), ("fault", FAULT)):
    random = np.random.default_rng(24)
    model = onnx.parser.parse_model(text)
    for array, shape in SHAPES[name].items():
        values = random.normal(0, 0.3, shape).astype(np.float32)
        model.graph.initializer.append(numpy_helper.from_array(values, array))
    for given, dtype in ((WHOLE, np.int64), (GIVEN, np.float32)):
        for array, values in given.get(name, {}).items():
            model.graph.initializer.append(numpy_helper.from_array(np.array(values, dtype=dtype), array))
    onnx.checker.check_model(model, full_check=True)
    (pathlib.Path(__file__).parent / f"{name}.onnx").write_bytes(model.SerializeToString())
