"""Compares the outputs of our networks with those of ONNX Runtime and of ONNX's reference implementation.

usage: compare.py FOLDER OUTPUTS

OUTPUTS is what `cargo run -p orchard-network --example outputs -- FOLDER` prints.
"""

import pathlib
import sys

import numpy as np

# Sums of 32-bit numbers in another order differ by a few units in the last place for each number.
RELATIVE, ABSOLUTE = 2e-6, 2e-6


def main(folder, outputs):
    folder, wrong, worst = pathlib.Path(folder), [], 0.0
    lines = [line.split() for line in pathlib.Path(outputs).read_text().splitlines()]
    got = {line[0]: line[1:] for line in lines}
    for case in sorted(folder.glob("*.npz")):
        name, found = case.stem, got.get(case.stem)
        if found is None or found[0] == "error:":
            wrong.append(f"{name}: {' '.join(found or ['no output'])}")
            continue
        shape = tuple(int(n) for n in found[0].split("x"))
        ours = np.array([int(x, 16) for x in found[1].split(",")], dtype=np.uint32).view(np.float32)
        expected = np.load(case)
        for judge in ("runtime", "reference"):
            theirs = expected[judge]
            if (theirs.shape or (1,)) != shape:
                wrong.append(f"{name}: shape {shape}, {judge} {theirs.shape}")
                continue
            off = np.abs(ours - theirs.ravel()) / (ABSOLUTE + RELATIVE * np.abs(theirs.ravel()))
            worst = max(worst, float(off.max()))
            if not off.max() <= 1.0:
                at = int(np.nanargmax(off))
                wrong.append(f"{name}: number {at} is {ours[at]}, {judge} {theirs.ravel()[at]}")
    for line in wrong:
        print(line)
    if wrong or not lines:
        sys.exit(f"{len(wrong)} differences in {len(lines)} networks")
    print(f"{len(lines)} networks agree; the largest difference is {100 * worst:.0f} % of what is allowed")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
