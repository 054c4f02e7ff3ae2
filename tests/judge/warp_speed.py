"""Steps an exported tree in MuJoCo-Warp for `cargo xtask perf gpu`, many worlds at once.

usage: warp_speed.py MODEL.xml [--worlds N,N...] [--variants NAME,NAME...] [--device cuda|cpu] [--rounds N] [--seconds S]

Writes a JSON object a line to stdout: what runs on what first, then a cell for every number of worlds and variant. All
worlds start from the first keyframe, if there is one, and every hinge of every world is kicked with a rate of its own.
What is timed are launches of a captured graph of one step; nothing of Python is in it but the launches. A cell whose
state is not finite, or whose first world goes another way than in MuJoCo itself, says so: its rate counts for nothing.
"""

import argparse
import ctypes
import gc
import json
import os
import sys
import time

# Before Warp is imported: it greets on stdout, which is for answers.
ANSWERS = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)

import mujoco  # noqa: E402
import mujoco_warp as mjw  # noqa: E402
import numpy as np  # noqa: E402
import warp as wp  # noqa: E402

SEED = 1
KICK = 1.0  # largest rate of a hinge at the start [rad/s]
LEAD_STEPS = 30  # before the clock runs: memory is there, and the first world has gone far enough to be compared
WAY_TOLERANCE = 0.01  # of the first world's way in the lead, single against double precision
LEAST_STEPS, MOST_STEPS = 9, 180  # of a round; ours are 180

CG, NEWTON = mujoco.mjtSolver.mjSOL_CG, mujoco.mjtSolver.mjSOL_NEWTON
EULER, DISCRETE = mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtIntegrator.mjINT_DISCRETE


class Variant:
    """A way to run the model. What is not given stays as the model says."""

    def __init__(self, about, solver=None, integrator=None, iterations=None, sizes=None):
        self.about = about
        self.solver, self.integrator, self.iterations = solver, integrator, iterations
        self.sizes = sizes or {}

    def model(self, path):
        model = mujoco.MjModel.from_xml_path(path)
        if self.solver is not None:
            model.opt.solver = self.solver
        if self.integrator is not None:
            model.opt.integrator = self.integrator
        if self.iterations is not None:
            # Of the solver of constraints, of which there are none.
            model.opt.iterations = self.iterations
            model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        return model


# One row of constraints is as few as is right: without any the solver is left out, and with it the right-hand side that
# the integrators Euler and implicitfast solve for. Discrete has none.
ONE_ROW = {"nconmax": 0, "njmax": 1, "njmax_nnz": 1}
VARIANTS = {
    "cg": Variant("stock: CG, integrator and sizes as they come", CG),
    "newton": Variant("stock: Newton, integrator and sizes as they come", NEWTON),
    "lean": Variant("no contacts, room for none, CG of no iteration", CG, None, 0, ONE_ROW),
    "lean_euler": Variant("the same, Euler with implicit damping", CG, EULER, 0, ONE_ROW),
    "lean_discrete": Variant("the same, discrete", CG, DISCRETE, 0, {"nconmax": 0, "njmax": 0}),
}


def start(model):
    """The start of every world but for its kick."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    return data


def kicked(model, data, worlds):
    """Velocities of all worlds. A world's do not depend on how many there are."""
    hinges = model.jnt_dofadr[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]
    qvel = np.tile(data.qvel, (worlds, 1))
    qvel[:, hinges] = np.random.default_rng(SEED).uniform(-KICK, KICK, (worlds, len(hinges)))
    return qvel


def way_of_first(model, qvel):
    """Where MuJoCo itself brings the first world, and how far a coordinate goes at most."""
    data = start(model)
    data.qvel[:] = qvel[0]
    before = data.qpos.copy()
    mujoco.mj_step(model, data, LEAD_STEPS)
    return data.qpos, np.abs(data.qpos - before).max()


def free_memory(device):
    """What is free on the device, after everything that nobody holds is given back [bytes]."""
    gc.collect()
    wp.synchronize()
    if device.is_mempool_enabled:
        wp.set_mempool_release_threshold(device, 0)
        wp.synchronize()
    try:
        # The temporaries of graphs are in a pool of their own, which Warp has no word for.
        ctypes.CDLL("libcuda.so.1").cuDeviceGraphMemTrim(device.ordinal)
    except OSError:
        pass  # then a cell's memory may seem smaller than it is
    return device.free_memory


def cell(path, variant, worlds, device, rounds, seconds):
    """Rate, memory and outcome of a variant."""
    host = variant.model(path)
    host_data = start(host)
    qvel = kicked(host, host_data, worlds)
    before = free_memory(device) if device.is_cuda else None
    began = time.perf_counter()
    model = mjw.put_model(host)
    model.opt.warn_overflow = 0  # printing from kernels takes time
    data = mjw.put_data(host, host_data, nworld=worlds, **variant.sizes)
    data.qvel.assign(qvel)
    # Compiles what is not in Warp's cache of kernels.
    mjw.step(model, data)
    if device.is_cuda:
        with wp.ScopedCapture() as capture:
            mjw.step(model, data)

        def step():
            wp.capture_launch(capture.graph)
    else:

        def step():
            mjw.step(model, data)

    def run(steps):
        wp.synchronize()
        begin = time.perf_counter()
        for _ in range(steps):
            step()
        wp.synchronize()
        return time.perf_counter() - begin

    prepared = time.perf_counter() - began
    lead = run(LEAD_STEPS - 1)
    end, way = way_of_first(host, qvel)
    gap = float(np.abs(data.qpos.numpy()[0] - end).max() / way)
    steps = int(np.clip(seconds * (LEAD_STEPS - 1) / lead, LEAST_STEPS, MOST_STEPS))
    rates = sorted(worlds * steps / run(steps) for _ in range(rounds))
    used = before - device.free_memory if device.is_cuda else None
    qpos = data.qpos.numpy()
    rows = int(data.nefc.numpy().max()) if data.njmax else 0
    return {
        "rate": float(np.median(rates)),
        "spread": [rates[0], rates[-1]],
        "steps": steps,
        "bytes": used,
        "prepared_s": prepared,
        "solver": mujoco.mjtSolver(host.opt.solver).name.removeprefix("mjSOL_"),
        "integrator": mujoco.mjtIntegrator(host.opt.integrator).name.removeprefix("mjINT_"),
        "iterations": int(host.opt.iterations),
        "njmax": int(data.njmax),
        "naconmax": int(data.naconmax),
        "constraints": rows,
        "finite": bool(np.isfinite(qpos).all()),
        "way": float(way),
        "gap": gap if np.isfinite(gap) else None,
        "agrees": gap < WAY_TOLERANCE,
    }


def answer(**what):
    print(json.dumps(what), file=ANSWERS, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", metavar="MODEL.xml")
    parser.add_argument("--worlds", default="512,4096", help="numbers of worlds")
    parser.add_argument("--variants", default=",".join(VARIANTS), help="some of " + ", ".join(VARIANTS))
    parser.add_argument("--device", default="cuda", help="cuda, or cpu to see that it works")
    parser.add_argument("--rounds", type=int, default=5, help="the rate is their median")
    parser.add_argument("--seconds", type=float, default=1.0, help="what a round takes, about")
    args = parser.parse_args()

    wp.config.log_level = wp.LOG_WARNING
    wp.init()
    if args.device != "cpu" and not wp.is_cuda_available():
        answer(error="Warp finds no CUDA device")
        return
    device = wp.get_device(args.device)
    wp.set_device(device)
    model = mujoco.MjModel.from_xml_path(args.model)
    answer(
        mujoco_warp=mjw.__version__,
        warp=wp.__version__,
        mujoco=mujoco.__version__,
        device=device.name,
        links_and_fruit=model.nbody - 1,
        nv=model.nv,
        timestep_s=model.opt.timestep,
        kick_rad_s=KICK,
        seed=SEED,
    )
    for worlds in (int(n) for n in args.worlds.split(",")):
        for name in args.variants.split(","):
            variant = VARIANTS[name]
            print(f"MuJoCo-Warp: {worlds} worlds, {name}", file=sys.stderr, flush=True)
            try:
                found = cell(args.model, variant, worlds, device, args.rounds, args.seconds)
            except Exception as e:  # a variant too large for the device, say, leaves the others
                found = {"error": f"{type(e).__name__}: {e}".splitlines()[0]}
            answer(worlds=worlds, variant=name, about=variant.about, **found)


if __name__ == "__main__":
    main()
