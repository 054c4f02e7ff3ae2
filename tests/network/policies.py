"""Writes the two tiny policies of random weights that the tests of learned controllers run: harvest.onnx and reach.onnx, into this folder.

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

SHAPES = {
    "harvest": {"C1": (4, 1, 8, 8), "D1": (4,), "W1": (8, 88), "B1": (8,), "W2": (22, 8), "B2": (22,)},
    "reach": {"W1": (16, 17), "B1": (16,), "W2": (11, 16), "B2": (11,)},
}
WHOLE = {"harvest": {"ONE": [1], "CHUNK": [1, 2, 11]}, "reach": {}}

for name, text in (("harvest", HARVEST), ("reach", REACH)):
    random = np.random.default_rng(24)
    model = onnx.parser.parse_model(text)
    for array, shape in SHAPES[name].items():
        values = random.normal(0, 0.3, shape).astype(np.float32)
        model.graph.initializer.append(numpy_helper.from_array(values, array))
    for array, values in WHOLE[name].items():
        model.graph.initializer.append(numpy_helper.from_array(np.array(values, dtype=np.int64), array))
    onnx.checker.check_model(model, full_check=True)
    (pathlib.Path(__file__).parent / f"{name}.onnx").write_bytes(model.SerializeToString())
