"""Compares our paths of exported trees with MuJoCo's own.

usage: judge.py CASE.json...

Every case is written by `cargo xtask judge`: a model, and what our simulator makes of it. MuJoCo starts from q = 0 and
finds rest, pull and release by itself; nothing of our state is put into it. The method and the tolerances are
explained in docs/computation/judge.md. The exit status is 1 if anything disagrees.
"""

import copy
import json
import pathlib
import sys

import mujoco
import numpy as np

EQUILIBRIUM_TOLERANCE = 1e-4  # [m]
LEAST_DEFLECTION = 1e-3  # [m]; flatter paths would compare nothing
SETTLING_TIME = 8.0  # [s]; joints relax at k / d = 10 1/s, more slowly where gravity softens them
SETTLING_STEP = 5e-3  # [s]; an equilibrium does not depend on the step

# How MuJoCo steps a path: name, integrator, its steps in one of ours, tolerance in parts of the peak deflection. At our
# own step it takes springs and dampers implicitly, as we do: what differs is how far it had settled, and round-off.
# `refined` is another scheme at a finer step and stands for the equations themselves.
SAME_STEP = ("same step", mujoco.mjtIntegrator.mjINT_DISCRETE, 1, 1e-6)
REFINED = ("refined", mujoco.mjtIntegrator.mjINT_EULER, 5, 0.01)


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

    def settle(self):
        """Steps until everything is at rest."""
        self.model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        self.model.opt.timestep = SETTLING_STEP
        mujoco.mj_step(self.model, self.data, round(SETTLING_TIME / SETTLING_STEP))
        self.data.qvel[:] = 0.0
        mujoco.mj_forward(self.model, self.data)

    def tips(self):
        heading = self.data.xmat[self.links].reshape(-1, 3, 3)[:, :, 2]
        return self.data.xpos[self.links] + self.lengths[:, None] * heading

    def watch(self, segment, seconds, integrator, substeps):
        """Path of a tip, a point after every one of our steps; the state is as before afterwards."""
        before = copy.copy(self.data)
        self.model.opt.integrator = integrator
        self.model.opt.timestep = self.h / substeps
        path = []
        for _ in range(round(seconds / self.h)):
            mujoco.mj_step(self.model, self.data, substeps)
            mujoco.mj_kinematics(self.model, self.data)
            path.append(self.tips()[segment])
        self.data = before
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
        self._line(what, gap <= EQUILIBRIUM_TOLERANCE, f"largest gap {1e3 * gap:.2g} mm")

    def path(self, what, ours, theirs, start, tolerance):
        ours = np.array(ours)
        peak = np.linalg.norm(theirs - start, axis=1).max()
        gap = np.linalg.norm(ours - theirs, axis=1).max()
        agrees = peak >= LEAST_DEFLECTION and gap <= tolerance * peak
        self._line(what, agrees, f"gap {100 * gap / peak:.2g} % of the peak deflection {1e3 * peak:.1f} mm")

    def _line(self, what, agrees, measured):
        self.failures += not agrees
        print(f"{'pass' if agrees else 'FAIL'}  {what}: {measured}", flush=True)


def judge(case_path, schemes, verdicts):
    """Compares one tree; stores both sides' paths beside the case, for plots."""
    case = json.loads(case_path.read_text())
    tree = Tree(case_path, case)
    tree.settle()
    verdicts.equilibrium(f"{case['name']} rest", tree, case["rest"])
    at_rest = tree.data
    stored = {}
    for pull in case["pulls"]:
        tree.data = copy.copy(at_rest)

        def compare(phase, ours):
            start = tree.tips()[pull["segment"]]
            for name, integrator, substeps, tolerance in schemes:
                theirs = tree.watch(pull["segment"], case["phase"], integrator, substeps)
                what = f"{case['name']} {pull['name']} {phase}, {name}"
                verdicts.path(what, ours, theirs, start, tolerance)
                stored[f"{pull['name']} {phase} {name}"] = theirs
            stored[f"{pull['name']} {phase} ours"] = np.array(ours)

        tree.pull(pull["segment"], pull["force"])
        compare("pull", pull["pull_path"])
        tree.settle()
        verdicts.equilibrium(f"{case['name']} {pull['name']} pulled", tree, pull["pulled"])
        tree.pull(pull["segment"], [0.0, 0.0, 0.0])
        compare("release", pull["release_path"])
    np.savez(case_path.with_suffix(".npz"), **stored)


def main():
    cases = [pathlib.Path(name) for name in sys.argv[1:]]
    if not cases:
        sys.exit(__doc__)
    verdicts = Verdicts()
    # The error of our step is a matter of the method: one tree shows it.
    for case in cases:
        judge(case, [SAME_STEP, REFINED] if case == cases[0] else [SAME_STEP], verdicts)
    if verdicts.failures:
        sys.exit(f"{verdicts.failures} comparisons with MuJoCo {mujoco.__version__} failed")
    print(f"all comparisons with MuJoCo {mujoco.__version__} agree")


if __name__ == "__main__":
    main()
