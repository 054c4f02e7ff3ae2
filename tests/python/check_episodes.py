"""Worlds, seeds, resets, ends, snapshots, rewards and buffers."""

import os
import sys

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from checks import raises, row, same
from environments import GENTLE, HARVEST, REACH, SEED, actions, single, vector

# A robot at rest stalls after 15 s: at 1 Hz in the 15th step.
END = 15


def test_one_world_alone_has_the_bits_of_the_same_among_many():
    settings = {"obs": ("state", "depth")}
    many, one = vector(3, **settings), single(world=2, **settings).unwrapped
    few = vector(2, threads=1, world=1, **settings)
    results = [env.reset(seed=SEED) for env in (many, few, one)]
    for step in range(4):
        same(row(results[0][0], 2), results[2][0])
        same(row(results[0][1], 2), results[2][1])
        same(row(results[0][0], 1), row(results[1][0], 0))
        acts = actions(many, step)
        results = [many.step(acts), few.step(acts[1:]), one.step(acts[2])]
        assert results[0][1][2] == results[2][1] and results[0][1][1] == results[1][1][0]
        results = [(r[0], r[4]) for r in results]
    assert results[0][0]["depth_valid"].any(), "the camera delivered no image"
    worlds = [row(results[0][1], k)["world"] for k in range(3)]
    assert worlds == [0, 1, 2], worlds


def test_seeds_and_reset_masks():
    env = vector(2)
    first, info = env.reset(seed=[SEED, SEED + 1])
    assert list(info["seed"]) == [SEED, SEED + 1] and list(info["world"]) == [0, 1]
    env.step(actions(env, 0))
    before, _, _, _, _ = env.step(actions(env, 1))
    after, info = env.reset(options={"reset_mask": np.array([False, True])})
    same(row(before, 0), row(after, 0))
    assert list(info["_world"]) == [False, True] and info["world"][1] == 1 + 65536
    again, _ = env.reset(seed=[None, SEED + 1], options={"reset_mask": np.array([False, True])})
    same(row(first, 1), row(again, 1))
    # Without a seed the next world; with it the first again.
    assert list(env.reset()[1]["world"]) == [65536, 1 + 65536]
    same(env.reset(seed=[SEED, SEED + 1])[0], first)


def test_trees_that_are_kept():
    fresh, kept = vector(2, REACH), vector(3, REACH, trees=2, trees_seed=SEED)
    assert kept.unwrapped.interface["pool"] == {"trees": 2, "seed": SEED} and "pool" not in fresh.unwrapped.interface
    for _ in range(2):
        # An even seed begins with the pool's first world.
        (own, _), (first, info) = fresh.reset(seed=SEED), kept.reset(seed=4)
        assert list(info["seed"]) == [SEED] * 3 and list(info["world"]) == [0, 1, 0], info
        for k, of in enumerate([0, 1, 0]):
            same(row(first, k), row(own, of))
        assert list(kept.reset()[1]["world"]) == [1, 0, 1]
        kept.step(actions(kept, 0))


def run(env, steps):
    """Steps at rest; the results of each step."""
    still = np.zeros(env.action_space.shape, dtype=np.float32)
    return [env.step(still) for _ in range(steps)]


def test_autoreset_modes():
    modes = AutoresetMode
    same_step, next_step, disabled = (
        vector(2, control_hz=1, threads=2, autoreset_mode=mode) for mode in (modes.SAME_STEP, modes.NEXT_STEP, "Disabled")
    )
    assert same_step.metadata["autoreset_mode"] == modes.SAME_STEP
    for env in (same_step, next_step, disabled):
        env.reset(seed=SEED)
    # One environment is a step ahead.
    ahead = np.array([False, True])
    a, b, c = run(same_step, END), run(next_step, END), run(disabled, END)
    for results in (a, b, c):
        assert not any(r[2].any() or r[3].any() for r in results[:-1])
        assert results[-1][3].all() and not results[-1][2].any()
    end = c[-1]
    assert list(end[4]["outcome"]) == ["stalled"] * 2 and not end[4]["is_success"].any()
    # Same step: the new episode's observation, with the last one beside it.
    observations, _, _, _, info = a[-1]
    assert info["_final_obs"].all() and list(info["world"]) == [65536, 65537]
    for k in range(2):
        same(info["final_obs"][k], row(end[0], k))
    same({k: v for k, v in info["final_info"].items() if not k.startswith("_")}, {k: v for k, v in end[4].items() if not k.startswith("_")})
    # Next step: the last observation, then a step that only resets.
    same(b[-1][0], end[0])
    assert "final_obs" not in b[-1][4]
    (reset,) = run(next_step, 1)
    same(reset[0], observations)
    assert not reset[1].any() and not reset[3].any()
    # Disabled: a step is refused until the caller resets.
    raises(ResetNeeded, "has ended", lambda: run(disabled, 1))
    begun, _ = disabled.reset(options={"reset_mask": ahead})
    same(row(begun, 1), row(observations, 1))
    raises(ResetNeeded, "environment 0 has ended", lambda: run(disabled, 1))


def test_a_snapshot_continues_with_the_same_bits():
    for task in (HARVEST, REACH, GENTLE):
        env, other = vector(2, task, obs=("state", "depth")), vector(2, task, obs=("state", "depth"))
        env.reset(seed=SEED)
        for step in range(2):
            env.step(actions(env, step))
        states = env.snapshot()
        onward = [env.step(actions(env, step)) for step in range(2, 4)]
        other.restore(states)
        for step, expected in zip(range(2, 4), onward):
            got = other.step(actions(env, step))
            for a, b in zip(got, expected):
                same(a, b)
    raises(ValueError, "belongs to another scenario", lambda: vector(2, REACH).restore(states))
    raises(ValueError, "not a state", lambda: other.restore([b"x", states[1]]))
    raises(ValueError, "1 states for 2 environments", lambda: other.restore(states[:1]))


def test_info_has_the_form_of_gymnasium():
    env = vector(2)
    env.reset(seed=SEED)
    _, info = env.reset(options={"reset_mask": np.array([False, True])})

    def shown(info, mask):
        """Types by key; beside each value is the mask."""
        for key, value in info.items():
            if not key.startswith("_"):
                assert info[f"_{key}"].dtype == np.bool_ and list(info[f"_{key}"]) == mask, key
        values = {key: value for key, value in info.items() if not key.startswith("_")}
        return {key: shown(value, mask) if isinstance(value, dict) else (value.dtype.kind, value.shape) for key, value in values.items()}

    kinds = shown(info, [False, True])
    number, count = ("f", (2,)), ("i", (2,))
    assert set(kinds.pop("reward_terms").values()) == {number}
    statistics = kinds.pop("statistics")
    assert {key for key, kind in statistics.items() if kind == number} == {"return", "cost", "time", "completeness"}
    assert {key for key, kind in statistics.items() if kind == count} == {"length", "deposited", "branches_snapped", "fruit_dropped", "spurs_torn"}
    assert kinds == {"is_success": ("b", (2,)), "cost": number, "outcome": ("O", (2,)), "seed": ("u", (2,)), "world": count}
    # Later steps do not change the results of a step, and a single environment has plain values.
    seen, _, _, _, first = env.step(actions(env, 0))
    kept = {key: values.copy() for key, values in seen.items()}
    _, _, _, _, second = env.step(actions(env, 1))
    same(seen, kept)
    assert list(first["statistics"]["length"] - second["statistics"]["length"]) == [-1, -1]
    assert shown(second, [True, True])["cost"] == number
    _, info = single().unwrapped.reset(seed=SEED)
    assert (info["is_success"], info["cost"], info["outcome"], info["world"], info["statistics"]["length"]) == (False, 0.0, None, 0, 0)
    assert [type(info[key]) for key in ("is_success", "cost", "world", "seed")] == [bool, float, int, int]
    assert not any(key.startswith("_") for key in info)


def test_rewards_costs_and_statistics_add_up():
    env = single().unwrapped
    env.reset(seed=SEED)
    rewards, costs = [], []
    for step in range(5):
        _, reward, _, _, info = env.step(actions(env, step)[0])
        assert abs(reward - sum(info["reward_terms"].values())) < 1e-12
        rewards.append(reward)
        costs.append(info["cost"])
    assert abs(info["statistics"]["return"] - sum(rewards)) < 1e-12 and info["statistics"]["cost"] == sum(costs)
    assert info["statistics"]["length"] == 5 and abs(info["statistics"]["time"] - 0.5) < 1e-9
    assert set(info["reward_terms"]) == {"deposit", "grip", "detach", "approach", "carry", "damage"}
    assert any(info["reward_terms"].values()), "no term has moved"
    sparse = single(reward="sparse").unwrapped
    sparse.reset(seed=SEED)
    assert sparse.step(actions(env, 0)[0])[1] == 0.0


def test_reach_tells_its_target_as_the_benchmark_does():
    env = single(REACH).unwrapped
    observation, info = env.reset(seed=SEED)
    assert observation["target"].shape == (4,) and 0.02 < observation["target"][3] < 0.06, observation["target"]
    same(env.reset(seed=SEED)[0], observation)
    assert list(info["reward_terms"]) == ["success", "grip", "approach", "damage"]


def test_gentle_names_a_point_and_its_side():
    env = single(GENTLE).unwrapped
    observation, info = env.reset(seed=SEED)
    names = {f["key"]: [(e["name"], e["unit"]) for e in f["elements"]] for f in env.interface["observation"]}
    assert names["target"] == [("x", "m"), ("y", "m"), ("z", "m"), ("heading", "rad")]
    x, y, z, heading = observation["target"]
    # Before the robot, at the height of the canopy, and approached from the robot's side.
    assert x > 0.5 and 0.5 < z < 2.0 and abs(heading) < 2.0, observation["target"]
    same(env.reset(seed=SEED)[0], observation)
    assert list(info["reward_terms"]) == ["success", "approach", "impulse", "damage"]
    info = env.step(actions(env, 0)[0])[4]
    assert info["reward_terms"]["approach"] != 0.0 and info["reward_terms"]["impulse"] <= 0.0


def test_views_stay_as_they_are_for_one_step_and_buffers_are_written():
    settings = {"obs": ("state", "depth"), "control_hz": 1}
    copying, viewing, writing = vector(2, **settings), vector(2, copy=False, **settings), vector(2, **settings)
    first = copying.reset(seed=SEED)[0]
    before = viewing.reset(seed=SEED)[0]
    same(before, first)
    buffers = {key: np.empty_like(value) for key, value in writing.reset(seed=SEED)[0].items()}
    buffers |= {"reward": np.zeros(2, dtype=np.float32), "terminated": np.zeros(2, dtype=bool), "truncated": np.zeros(2, dtype=bool)}
    # At rest the episodes end in the last step, which also begins the next ones.
    still = np.zeros(copying.action_space.shape, dtype=np.float32)
    for step in range(END):
        seen, reward, terminated, truncated, info = copying.step(still)
        now = viewing.step(still)[0]
        same(now, seen)
        same(before, first)
        assert not np.shares_memory(now["depth"], before["depth"])
        before, first = now, seen
        same(writing.step_into(still, buffers), info)
        for key, value in buffers.items():
            if key == "reward":
                assert np.array_equal(value, reward.astype(np.float32))
            else:
                same(value, (seen | {"terminated": terminated, "truncated": truncated})[key])
    assert truncated.all() and list(info["world"]) == [65536, 65537]
    # Two steps later the arrays are the same.
    viewing.step(still)
    assert np.shares_memory(viewing.step(still)[0]["depth"], now["depth"])
    state = writing.snapshot()
    for key, bad, kind, text in (
        ("depth", buffers["depth"][:1], ValueError, "depth has the shape"),
        ("depth", buffers["depth"].astype(np.float64), TypeError, "depth must be a numpy array of float32"),
        ("depth", np.asfortranarray(buffers["depth"]), ValueError, "contiguous"),
        ("reward", np.zeros(2, dtype=int), TypeError, "reward must be"),
        ("truncated", np.zeros(3, dtype=bool), ValueError, "truncated has the shape"),
    ):
        raises(kind, text, lambda: writing.step_into(still, buffers | {key: bad}))
    frozen = buffers["depth"].copy()
    frozen.flags.writeable = False
    raises(ValueError, "cannot be written", lambda: writing.step_into(still, buffers | {"depth": frozen}))
    del buffers["depth"]
    raises(ValueError, "depth is missing", lambda: writing.step_into(still, buffers))
    assert writing.snapshot() == state, "a refused step moved something"


def test_worlds_on_a_graphics_device_are_those_of_the_cpu_but_for_rounding():
    raises(ValueError, "backend tpu: must be one of cpu and gpu", lambda: vector(1, task=REACH, backend="tpu"))
    try:
        there = vector(2, task=REACH, backend="gpu")
    except RuntimeError as problem:
        assert "no graphics adapter" in str(problem).lower() and not os.environ.get("CI"), problem
        print(f"SKIPPED: worlds on a graphics device: {problem}", file=sys.stderr)
        return
    here = vector(2, task=REACH)
    first = [env.reset(seed=SEED)[0] for env in (here, there)]
    same(*first)
    for step in range(2):
        (seen, reward, *_), (expected, due, *_) = (env.step(actions(here, step)) for env in (there, here))
        assert max(np.abs(seen[key] - expected[key]).max() for key in seen) < 1e-3
        assert np.abs(reward - due).max() < 1e-4
    assert set(there.unwrapped.frames_by_place) <= {"device", "large_tree"}, there.unwrapped.frames_by_place
    assert here.unwrapped.frames_by_place is None
    assert here.unwrapped.step_times is None and there.unwrapped.step_times["rounds"] == 0
    there.step(actions(there, 0))
    assert there.unwrapped.step_times["rounds"] > 0 and there.unwrapped.step_times["host.take_back"] > 0
