"""Compares our paths of exported trees with MuJoCo's own.

usage: judge.py CASE.json...

Every case is written by `cargo xtask judge`: a model, and what our simulator makes of it. MuJoCo starts from q = 0 and
finds rest, pull and release by itself; nothing of our state is put into it. The method and the tolerances are
explained in docs/computation/judge.md. The exit status is 1 if anything disagrees.
"""

import json
import pathlib
import sys

import mujoco
import numpy as np

EQUILIBRIUM_TOLERANCE = 1e-4  # [m], the issue's
PATH_TOLERANCE = 0.01  # of the peak deflection, the issue's
LEAST_DEFLECTION = 1e-3  # [m]; flatter paths would compare nothing
SETTLING_TIME = 4.0  # [s]; joints relax at k / d = 10 1/s or faster, so that e^-40 is left
SUBSTEPS = 20  # MuJoCo steps in one of ours: its own error is made small against the tolerance


class Tree:
    """An exported tree in MuJoCo."""

    def __init__(self, case_path, case):
        self.model = mujoco.MjModel.from_xml_path(str(case_path.with_name(case["mjcf"])))
        self.data = mujoco.MjData(self.model)
        self.h = case["h"]
        self.lengths = np.array(case["lengths"])
        self.links = np.array([self.model.body(f"link{i}").id for i in range(len(self.lengths))])
        self.fruit = np.array(
            [self.model.body(f"point{i}").id for i in range(len(case["rest"]["fruit"]))], dtype=int
        )

    def pull(self, segment, force_world):
        """Sets the force at a segment's centre of mass."""
        self.data.xfrc_applied[self.links[segment], :3] = force_world

    def step(self, dt):
        self.model.opt.timestep = dt
        mujoco.mj_step(self.model, self.data)

    def settle(self):
        for _ in range(round(SETTLING_TIME / self.h)):
            self.step(self.h)
        mujoco.mj_forward(self.model, self.data)

    def tips(self):
        heading = self.data.xmat[self.links].reshape(-1, 3, 3)[:, :, 2]
        return self.data.xpos[self.links] + self.lengths[:, None] * heading

    def watch(self, segment, seconds):
        """Path of a tip, a point after every one of our steps."""
        path = []
        for _ in range(round(seconds / self.h)):
            for _ in range(SUBSTEPS):
                self.step(self.h / SUBSTEPS)
            mujoco.mj_kinematics(self.model, self.data)
            path.append(self.tips()[segment])
        return np.array(path)


class Verdicts:
    """Comparisons as a table on the terminal."""

    def __init__(self):
        self.failures = 0

    def equilibrium(self, what, tree, ours):
        gaps = [np.linalg.norm(tree.tips() - np.array(ours["tips"]), axis=1)]
        if len(tree.fruit):
            gaps.append(np.linalg.norm(tree.data.xpos[tree.fruit] - np.array(ours["fruit"]), axis=1))
        gap = np.concatenate(gaps).max()
        self._line(what, gap <= EQUILIBRIUM_TOLERANCE, f"largest gap {1e3 * gap:.6f} mm")

    def path(self, what, ours, theirs, start):
        ours = np.array(ours)
        peak = np.linalg.norm(theirs - start, axis=1).max()
        gap = np.linalg.norm(ours - theirs, axis=1).max()
        agrees = peak >= LEAST_DEFLECTION and gap <= PATH_TOLERANCE * peak
        self._line(what, agrees, f"gap {100 * gap / peak:.3f} % of the peak deflection {1e3 * peak:.1f} mm")

    def _line(self, what, agrees, measured):
        self.failures += not agrees
        print(f"{'pass' if agrees else 'FAIL'}  {what}: {measured}", flush=True)


def judge(case_path, verdicts):
    """Compares one tree; stores both sides' paths beside the case, for plots."""
    case = json.loads(case_path.read_text())
    paths = {}
    for pull in case["pulls"]:
        what = f"{case['name']} {pull['name']}"
        tree = Tree(case_path, case)
        segment = pull["segment"]

        tree.settle()
        verdicts.equilibrium(f"{what} rest", tree, case["rest"])
        rest = tree.tips()[segment]

        tree.pull(segment, pull["force"])
        pulled = tree.watch(segment, case["phase"])
        verdicts.path(f"{what} pull", pull["pull_path"], pulled, rest)
        tree.settle()
        verdicts.equilibrium(f"{what} pulled", tree, pull["pulled"])

        start = tree.tips()[segment]
        tree.pull(segment, [0.0, 0.0, 0.0])
        released = tree.watch(segment, case["phase"])
        verdicts.path(f"{what} release", pull["release_path"], released, start)
        paths |= {f"{pull['name']}_pull": pulled, f"{pull['name']}_release": released}
    np.savez(case_path.with_suffix(".npz"), **paths)


def main():
    cases = [pathlib.Path(name) for name in sys.argv[1:]]
    if not cases:
        sys.exit(__doc__)
    verdicts = Verdicts()
    for case in cases:
        judge(case, verdicts)
    if verdicts.failures:
        sys.exit(f"{verdicts.failures} comparisons with MuJoCo {mujoco.__version__} failed")
    print(f"all comparisons with MuJoCo {mujoco.__version__} agree")


if __name__ == "__main__":
    main()
