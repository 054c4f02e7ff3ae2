"""Steps exported trees in MuJoCo for `cargo xtask perf physics`: a request a line on stdin, an answer a line on stdout.

Requests and answers are JSON objects. {"do": "load", "name", "files", "threads"} loads models, each with its start as
the first keyframe; more than one thread means `mujoco.rollout`. {"do": "time", "name", "lead", "steps", "repeats"}
steps `lead` steps from the start, then times `steps` steps, `repeats` times over, and answers with the processor time
of this process. {"do": "watch", ...} goes the same way once, untimed, and answers with the contacts on it. What is
timed is one call into MuJoCo's own loop; nothing of Python is in it.
"""

import json
import sys
import time

import mujoco
import numpy as np
from mujoco import rollout

FULL_STATE = mujoco.mjtState.mjSTATE_INTEGRATION  # with the warm start of the contact solver
ROLLOUT_STEPS = 60  # states that rollout may write before it starts over: 512 worlds of 391 degrees of freedom are 200 MB


class OneTree:
    """One model on one thread."""

    def __init__(self, files, _threads):
        self.model = mujoco.MjModel.from_xml_path(files[0])
        self.data = mujoco.MjData(self.model)

    def reach(self, lead):
        """State after the lead, from the start."""
        mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        if lead:
            mujoco.mj_step(self.model, self.data, lead)
        state = np.empty(mujoco.mj_stateSize(self.model, FULL_STATE))
        mujoco.mj_getState(self.model, self.data, state, FULL_STATE)
        return state

    def time(self, lead, steps, repeats):
        state = self.reach(lead)
        spent = 0.0
        for _ in range(repeats):
            mujoco.mj_setState(self.model, self.data, state, FULL_STATE)
            start = time.process_time()
            mujoco.mj_step(self.model, self.data, steps)
            spent += time.process_time() - start
        return {"seconds": spent, "fastest": float(np.abs(self.data.qvel).max())}

    def watch(self, lead, steps):
        self.reach(lead)
        contacts = []
        for _ in range(steps):
            mujoco.mj_step(self.model, self.data)
            contacts.append(int(self.data.ncon))
        return {"contacts": sum(contacts) / steps, "fewest": min(contacts), "finite": bool(np.isfinite(self.data.qpos).all())}


class ManyTrees:
    """Models of equal topology on several threads."""

    def __init__(self, files, threads):
        self.models = [mujoco.MjModel.from_xml_path(name) for name in files]
        self.data = [mujoco.MjData(self.models[0]) for _ in range(threads)]
        self.rollout = rollout.Rollout(nthread=threads)
        physics = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self.start = np.empty((len(files), mujoco.mj_stateSize(self.models[0], physics)))
        for model, state in zip(self.models, self.start):
            mujoco.mj_resetDataKeyframe(model, self.data[0], 0)
            mujoco.mj_getState(model, self.data[0], state, physics)
        self.states = None

    def time(self, lead, steps, repeats):
        spent = 0.0
        for _ in range(repeats):
            state, done = self.start, 0
            while done < steps:
                chunk = min(ROLLOUT_STEPS, steps - done)
                if self.states is None or self.states.shape[1] != chunk:
                    # Filled, so that the pages are there before the clock runs.
                    self.states = np.zeros((len(self.models), chunk, self.start.shape[1]))
                start = time.process_time()
                self.rollout.rollout(self.models, self.data, state, nstep=chunk, state=self.states)
                spent += time.process_time() - start
                state, done = self.states[:, -1].copy(), done + chunk
        velocities = state[:, -self.models[0].nv :]
        return {"seconds": spent, "fastest": float(np.abs(velocities).max(axis=1).min())}


def main():
    print(json.dumps({"version": mujoco.__version__}), flush=True)
    subjects = {}
    for line in sys.stdin:
        request = json.loads(line)
        what, name = request.pop("do"), request.pop("name")
        if what == "load":
            kind = ManyTrees if request["threads"] > 1 else OneTree
            subjects[name] = kind(request["files"], request["threads"])
            first = subjects[name].models[0] if kind is ManyTrees else subjects[name].model
            answer = {"dofs": int(first.nv)}
        else:
            answer = getattr(subjects[name], what)(**request)
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
