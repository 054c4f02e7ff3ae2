"""Checks the Python package `orchardbench` with Gymnasium's own checkers, against itself, and with bad input.

Runs every function named test_*, or those whose names are given.
"""

import json
import multiprocessing
import pathlib
import subprocess
import sys
import tempfile
import time
import traceback
import warnings

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import orchardbench

SEED = 20250704
NOTEBOOK = pathlib.Path(__file__).parents[2] / "docs" / "notebooks" / "first-steps.ipynb"
HARVEST, REACH, GENTLE = "orchardbench/Harvest-v1", "orchardbench/Reach-v1", "orchardbench/Gentle-v1"


def vector(num_envs, task=HARVEST, **settings):
    return gymnasium.make_vec(task, num_envs=num_envs, vectorization_mode="vector_entry_point", **settings)


def single(task=HARVEST, **settings):
    return gymnasium.make(task, disable_env_checker=True, **settings)


def actions(env, step, first=0):
    """Actions that differ by environment and step, and depend on nothing else."""
    size = len(env.interface["action"])
    rows = [np.random.default_rng([step, first + k]).uniform(-1, 1, size) for k in range(getattr(env, "num_envs", 1))]
    return np.array(rows, dtype=np.float32)


def same(a, b, where=""):
    assert type(a) is type(b), (where, a, b)
    if isinstance(a, dict):
        assert a.keys() == b.keys(), (where, a.keys(), b.keys())
        for key in a:
            same(a[key], b[key], f"{where}.{key}")
    elif isinstance(a, np.ndarray) and a.dtype != object:
        assert a.dtype == b.dtype and a.tobytes() == b.tobytes(), (where, a, b)
    elif isinstance(a, np.ndarray):
        assert len(a) == len(b)
        for i in range(len(a)):
            same(a[i], b[i], f"{where}[{i}]")
    else:
        assert a == b, (where, a, b)


def row(values, k):
    """Environment k of the results of many: as its own results."""
    if isinstance(values, dict):
        return {key: row(value, k) for key, value in values.items() if not key.startswith("_")}
    value = values[k]
    return value.item() if isinstance(value, np.generic) else value


def raises(kind, text, call):
    try:
        call()
    except kind as e:
        assert text in str(e), f"{text!r} is not in {e}"
        return
    raise AssertionError(f"nothing was raised; expected {kind.__name__}: {text}")


def test_gymnasium_accepts_every_task():
    for task, settings in ((HARVEST, {}), (HARVEST, {"obs": ("state", "depth", "pixels")}), (REACH, {"obs": "task_description"}), (REACH, {"control": "joint_absolute"}), (GENTLE, {"control": "ee_delta"})):
        env = gymnasium.make(task, **settings)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            check_env(env.unwrapped, skip_render_check=True)
        # Forces and velocities have no limits.
        left = [str(w.message) for w in caught if "infinity" not in str(w.message)]
        assert not left, left


def test_spaces_are_those_of_the_interface():
    env = vector(2, obs=("state", "depth"), robot="fr3-fixed")
    names = [channel["name"] for channel in env.interface["action"]]
    assert env.single_action_space.shape == (len(names),) and names[-1] == "gripper", names
    assert list(env.single_observation_space) == ["agent_pos", "agent_vel", "depth", "depth_time", "depth_valid", "forces", "tool_pose"]
    assert env.single_observation_space["depth"].shape == (144, 192)
    observations, _ = env.reset(seed=SEED)
    assert observations in env.observation_space
    gripper = env.interface["action"][-1]
    assert gripper["at_minus_one"] == 0.0 and gripper["at_plus_one"] > 0.0 and gripper["unit"] == "m"
    assert env.interface["task"] == "Harvest-v1" and env.interface["frames"] == 6


def test_pictures_show_fruit_and_robot():
    settings = {"obs": ("pixels",), "pixels_size": (96, 128), "pixels_hz": 5}
    env = single(**settings).unwrapped
    seen, _ = env.reset(seed=SEED)
    assert list(env.observation_space) == ["pixels_base", "pixels_time", "pixels_wrist"]
    assert seen in env.observation_space and list(seen["pixels_time"]) == [0.0, 0.0]
    for key in ("pixels_wrist", "pixels_base"):
        assert seen[key].shape == (96, 128, 3) and seen[key].dtype == np.uint8
        # The sky above is brighter and bluer than the grass below.
        red, green, blue = seen[key].reshape(-1, 3).mean(axis=0)
        assert 40 < green < 220 and seen[key].std() > 20, (key, red, green, blue)
    red, green, blue = np.moveaxis(seen["pixels_wrist"].astype(int), 2, 0)
    assert ((red > 120) & (green < 80) & (blue < 80)).sum() > 3, "no red fruit in the picture"
    still = np.zeros(env.action_space.shape, dtype=np.float32)
    moving = still.copy()
    moving[0] = 1.0
    taken = []
    before = seen["pixels_base"]
    for _ in range(4):
        seen = env.step(moving)[0]
        taken.append(float(seen["pixels_time"][0]))
    # A picture in every other step, and the arm moves in it.
    assert np.allclose(taken, [0.0, 0.2, 0.2, 0.4]) and abs(seen["pixels_time"][1] - 0.4) < 1e-6, taken
    changed = (np.abs(seen["pixels_base"].astype(int) - before).max(axis=2) > 30).mean()
    assert 0.005 < changed < 0.5, changed
    state = env.snapshot()
    other = single(**settings).unwrapped
    other.reset(seed=SEED + 1)
    same(other.restore(state)[0], seen)
    same(other.step(still)[0], env.step(still)[0])
    for k, key in enumerate(("pixels_wrist", "pixels_base")):
        many = vector(2, **settings).reset(seed=SEED)[0][key]
        one = single(**settings, world=k).reset(seed=SEED)[0][key]
        same(many[k], one)
    raises(ValueError, "pixels_hz 7: it must divide the frame rate, 60 Hz", lambda: single(obs="pixels", pixels_hz=7))
    raises(ValueError, "pixels_size (0, 0): rows and columns must be 1 to 1024", lambda: single(obs="pixels", pixels_size=0))
    raises(TypeError, "pixels_size must be a whole number", lambda: single(obs="pixels", pixels_size="big"))


def test_the_gripper_opens_at_plus_one_and_closes_at_minus_one():
    env = single().unwrapped
    env.reset(seed=SEED)
    fingers = [e["name"] for e in env.interface["observation"][0]["elements"]].index("finger_left")
    stroke = env.interface["action"][-1]["at_plus_one"]
    for sign, opening in ((1.0, stroke), (-1.0, 0.0)):
        action = np.zeros(env.action_space.shape, dtype=np.float32)
        action[-1] = sign
        for _ in range(15):
            seen = env.step(action)[0]["agent_pos"][fingers]
        assert abs(seen - opening) < 1e-3, (sign, seen, opening)


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


def run(env, steps):
    """Steps at rest; the results of each step."""
    still = np.zeros(env.action_space.shape, dtype=np.float32)
    return [env.step(still) for _ in range(steps)]


# A robot at rest stalls after 15 s: at 1 Hz in the 15th step.
END = 15


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


def test_truth_is_observed_only_when_asked_for():
    for task in (HARVEST, REACH, GENTLE):
        assert "privileged" not in single(task).observation_space.spaces
        env = single(task, privileged=True).unwrapped
        seen, _ = env.reset(seed=SEED)
        assert env.interface["privileged"] and seen in env.observation_space
        names = [e["name"] for e in env.interface["observation"][-1]["elements"]]
        truth = dict(zip(names, seen["privileged"].tolist()))
        assert 0.2 < truth["goal_z"] < 2.5 and truth["held"] == 0 and truth["wood_impulse"] == 0, truth
        if task != HARVEST:
            assert np.abs(seen["target"][:3] - seen["privileged"][:3]).max() < 0.02, (seen, truth)


def test_tasks_are_told_in_words():
    for task, words in ((HARVEST, "into the bucket"), (GENTLE, "break nothing")):
        seen, _ = single(task, obs=("state", "task_description")).reset(seed=SEED)
        assert words in seen["task_description"], seen["task_description"]
    many = vector(3, REACH, obs=("state", "task_description"))
    seen, _ = many.reset(seed=SEED)
    assert seen in many.observation_space
    told = seen["task_description"]
    assert isinstance(told, tuple) and len(set(told)) > 1 and all(" apple" in words for words in told), told
    assert many.step(actions(many, 0))[0]["task_description"] == told
    one, other = (single(REACH, obs="task_description", world=2).unwrapped for _ in range(2))
    assert one.reset(seed=SEED)[0]["task_description"] == told[2]
    other.reset(seed=SEED + 1)
    assert other.restore(one.snapshot())[0]["task_description"] == told[2]


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


def test_the_spec_states_every_convention():
    with tempfile.TemporaryDirectory() as folder:
        for robot, control in (("ridgeback-fr3", "ee_delta"), ("rail-xarm6-suction", "joint_delta")):
            env, file = single(robot=robot, control=control).unwrapped, pathlib.Path(folder, "spec.json")
            env.write_spec(file)
            spec = json.loads(file.read_text())
            assert spec == env.interface
            assert all(channel["unit"] and channel["meaning"] for channel in spec["action"])
            for field in spec["observation"]:
                assert field["meaning"] and all(element["unit"] for element in field["elements"]), field
            said = spec["conventions"]
            assert said["gripper"].startswith("-1 closes") and "exp(r) R" in said["rotations"]
            assert set(said["frames"]) == {"odom", "base", "tool"}
        raises(OSError, "spec.json", lambda: env.write_spec(pathlib.Path(folder, "none", "spec.json")))
    env = vector(1, control="ee_delta")
    channels = {channel["name"]: channel for channel in env.interface["action"]}
    assert list(channels)[:6] == ["ee_x", "ee_y", "ee_z", "ee_rx", "ee_ry", "ee_rz"]
    assert all(channels[name]["frame"] == "base" for name in list(channels)[:-1]) and channels["gripper"]["frame"] is None
    assert (channels["ee_x"]["unit"], channels["ee_rx"]["unit"]) == ("m", "rad")


def test_the_tool_moves_towards_the_target():
    # At the start odom is the base frame, whose axes the actions have.
    env = single(REACH, control="ee_delta").unwrapped
    seen, _ = env.reset(seed=SEED)
    action = np.zeros(env.action_space.shape, dtype=np.float32)
    # The target is far ahead, so the tool comes nearer along x.
    action[0] = np.sign(seen["target"][0])
    forth = sum(env.step(action)[4]["reward_terms"]["approach"] for _ in range(5))
    back = sum(env.step(-action)[4]["reward_terms"]["approach"] for _ in range(5))
    assert forth > 0.05 and back < -0.02, (forth, back)


def orchard(*line):
    code = "import sys; from orchardbench._program import main; sys.argv = ['orchard', *sys.argv[1:]]; main()"
    return subprocess.run([sys.executable, "-c", code, *line], capture_output=True, text=True)


class Playback:
    """Answers with the commands and events of logs, one an episode."""

    def __init__(self, logs, fails_at=None):
        self.logs, self.fails_at, self.frames = list(logs), fails_at, 0

    def reset(self, interface):
        self.current, self.frame = self.logs.pop(0), -1

    def act(self, observation):
        self.frame, self.frames = self.frame + 1, self.frames + 1
        if self.frames == self.fails_at:
            raise ArithmeticError("the policy has had enough")
        return self.current["commands"][self.frame]

    def log(self):
        return [event for frame, event in self.current["events"] if frame == self.frame]


def test_the_commands_of_a_controller_give_its_episodes_byte_for_byte():
    with tempfile.TemporaryDirectory() as folder:
        own, here = pathlib.Path(folder, "own"), pathlib.Path(folder, "here")
        size = ["--conditions=nominal", f"--seeds={SEED}", "--trees=2", "--horizon=12"]
        done = orchard("bench-v1", "--tasks=harvest", "--controller=expert", *size, f"--out={own}")
        assert done.returncode == 0, done.stderr
        (stored,) = json.loads((own / "plan.json").read_text())["scenarios"].values()
        episodes = sorted(file.stem for file in (own / "episodes").iterdir())
        logs = [orchardbench.command_log(own, episode) for episode in episodes]
        assert any("AttemptStarted" in event for log in logs for _, event in log["events"])

        def again(policy):
            configs = dict(stored["controller_configs"])
            size = {"conditions": ["nominal"], "seeds": [SEED], "trees": 2, "horizon": 12}
            return orchardbench.run_benchmark(
                policy, out=here, name="expert", configs=configs, control="command", **size
            )

        # A failure in the second episode keeps the first, and the same call goes on.
        frames = len(logs[0]["commands"])
        raises(ArithmeticError, "had enough", lambda: again(Playback(logs, fails_at=frames + 5)))
        assert [file.stem for file in (here / "episodes").iterdir()] == episodes[:1]
        assert not (here / "summary.json").exists()
        summaries = again(Playback(logs[1:]))
        for file in ("plan.json", "summary.json"):
            assert (own / file).read_bytes() == (here / file).read_bytes(), file
        for kind in ("episodes", "commands"):
            names = sorted(file.name for file in (own / kind).iterdir())
            assert len(names) == 2 and names == sorted(file.name for file in (here / kind).iterdir())
            for name in names:
                assert (own / kind / name).read_bytes() == (here / kind / name).read_bytes(), name
        assert summaries == {"harvest": json.loads((own / "summary.json").read_text())}


class Wanderer:
    """Small moves that depend on the number of the action, as :func:`actions` makes them."""

    def reset(self, interface):
        self.size, self.step, self.seen = len(interface["action"]), 0, []

    def act(self, observation):
        self.seen.append(observation)
        self.step += 1
        return 0.3 * np.random.default_rng([self.step, 0]).uniform(-1, 1, self.size).astype(np.float32)


def test_a_policy_sees_in_the_benchmark_what_it_sees_in_the_environment():
    with tempfile.TemporaryDirectory() as folder:
        policy = Wanderer()
        size = {"conditions": ["nominal"], "seeds": [SEED], "trees": 1, "horizon": 2}
        settings = {"obs": ("state", "depth"), "control": "ee_delta"}
        orchardbench.run_benchmark(policy, out=pathlib.Path(folder, "out"), name="wanderer", **size, **settings)
        env, again = single(**settings).unwrapped, Wanderer()
        again.reset(env.interface)
        seen = env.reset(seed=SEED)[0]
        assert len(policy.seen) == 20
        for step in range(20):
            same(policy.seen[step], seen)
            seen = env.step(again.act(seen))[0]
        # The other tasks tell their targets, and a class serves several threads.
        obs = ("state", "task_description")
        size = {"seeds": [SEED], "trees": 1, "threads": 2, "obs": obs, "control_hz": 1}
        tasks = ("reach-and-grasp", "gentle")
        told = orchardbench.run_benchmark(Still, out=pathlib.Path(folder, "still"), name="still", tasks=tasks, **size)
        assert list(told) == list(tasks) and all(len(target) == 4 for target, _ in Still.told)
        assert {words.split()[0] for _, words in Still.told} == {"grasp", "push"}, Still.told


class Still:
    told = []

    def reset(self, interface):
        self.size = len(interface["action"])

    def act(self, observation):
        Still.told.append((observation.get("target"), observation.get("task_description", "")))
        return np.zeros(self.size, dtype=np.float32)


def test_the_benchmark_refuses_what_it_cannot_run():
    with tempfile.TemporaryDirectory() as folder:
        size = {"conditions": ["nominal"], "seeds": [SEED], "trees": 1, "horizon": 1}

        def run(policy=Still, **settings):
            out = pathlib.Path(folder, "out")
            return lambda: orchardbench.run_benchmark(policy, **{"out": out, "name": "x", **size, **settings})

        def answering(answer):
            return type("Answers", (), {"reset": lambda self, _: None, "act": lambda self, _: answer})

        raises(ValueError, "name '../x'", run(name="../x"))
        raises(TypeError, "unknown option colour", run(colour="red"))
        raises(ValueError, "tasks sleep: unknown", run(tasks=("sleep",)))
        raises(TypeError, "methods reset and act", run(policy=3))
        raises(ValueError, "threads 2: one policy object", run(policy=Still(), threads=2))
        raises(ValueError, "obs pixels", run(obs=("pixels",)))
        raises(ValueError, "control torque: unknown", run(control="torque"))
        raises(ValueError, "control_hz 7", run(control_hz=7))
        raises(ValueError, "--conditions: nowhere", run(conditions=["nowhere"]))
        raises(ValueError, "--preset: no preset 'nowhere'", run(preset="nowhere"))
        raises(ValueError, "/no/such.toml", run(scenario="/no/such.toml"))
        raises(ValueError, "--horizon", run(horizon=-1))
        raises(ValueError, "have the shape (2,)", run(policy=answering(np.zeros(2))))
        raises(TypeError, "not object", run(policy=answering(None)))
        raises(ValueError, "is NaN, which", run(policy=answering(np.full(11, np.nan, dtype=np.float32))))
        raises(TypeError, "with the keys", run(policy=answering({"arm_q": []}), control="command"))
        command = {"arm_q": [0.0] * 6, "arm_v": [0.0] * 7, "base_velocity": [0.0] * 3}
        command |= {"finger_q": 0.0, "finger_force": 0.0, "vacuum": 0.0}
        raises(ValueError, "arm_q has 6 numbers for 7 joints", run(policy=answering(command), control="command"))
        command |= {"arm_q": [np.inf] * 7}
        raises(ValueError, "not finite", run(policy=answering(command), control="command"))
        raises(ValueError, "base_velocity has the shape", run(policy=answering(command | {"base_velocity": 1}), control="command"))
        logging = type("Logs", (Still,), {"log": lambda self: [{"Slept": {}}]})
        logging.act = lambda self, _: np.zeros(self.size, dtype=np.float32)
        raises(ValueError, "log: unknown variant", run(policy=logging))
        missing = type("Missing", (), {"act": lambda self, _: None})
        raises(AttributeError, "reset", run(policy=missing))
        raises(ValueError, "none.json", lambda: orchardbench.command_log(folder, "none"))


def test_bad_input_is_refused():
    env = vector(2)
    size = len(env.interface["action"])
    good = np.zeros((2, size), dtype=np.float32)
    raises(ResetNeeded, "call reset first", lambda: env.step(good))
    raises(ResetNeeded, "call reset first", env.snapshot)
    env.reset(seed=SEED)
    nan = good.copy()
    nan[1, 0] = np.nan
    raises(ValueError, "action of environment 1", lambda: env.step(nan))
    raises(ValueError, "have the shape (1, ", lambda: env.step(good[:1]))
    raises(ValueError, "have the shape", lambda: env.step(good[:, :-1]))
    raises(TypeError, "not int64", lambda: env.step(good.astype(np.int64)))
    raises(TypeError, "not object", lambda: env.step([[None] * size] * 2))
    raises(ValueError, "3 seeds for 2", lambda: env.reset(seed=[1, 2, 3]))
    raises(ValueError, "at least 0", lambda: env.reset(seed=-1))
    raises(TypeError, "whole number", lambda: env.reset(seed=[1.5, 2]))
    raises(TypeError, "numpy array of bool", lambda: env.reset(options={"reset_mask": [True, False]}))
    raises(ValueError, "has the shape", lambda: env.reset(options={"reset_mask": np.ones(3, dtype=bool)}))
    raises(ValueError, "names no environment", lambda: env.reset(options={"reset_mask": np.zeros(2, dtype=bool)}))
    raises(ValueError, "unknown option", lambda: env.reset(options={"mask": 1}))
    env.close()
    raises(ClosedEnvironmentError, "closed", lambda: env.step(good))
    raises(ClosedEnvironmentError, "closed", lambda: env.reset())
    raises(ClosedEnvironmentError, "closed", lambda: env.step_into(good, {}))
    raises(ClosedEnvironmentError, "closed", lambda: env.write_spec("spec.json"))
    one = single().unwrapped
    one.close()
    raises(ClosedEnvironmentError, "closed", lambda: one.reset())
    raises(ValueError, "--preset: no preset 'nowhere'", lambda: single(preset="nowhere"))
    raises(ValueError, "/no/such.toml", lambda: single(scenario="/no/such.toml"))
    raises(ValueError, "--camera", lambda: single(camera="eye"))
    raises(ValueError, "obs smell: unknown; it is one of state, depth, pixels, task_description", lambda: single(obs=("smell",)))
    raises(ValueError, "control_hz 7: it must divide the frame rate, 60 Hz", lambda: single(control_hz=7))
    raises(ValueError, "control torque: unknown", lambda: single(control="torque"))
    raises(ValueError, "worlds 0..0", lambda: vector(0))
    raises(TypeError, "unknown setting colour", lambda: orchardbench.OrchardEnv(colour=1))
    raises(ValueError, "task Sleep-v1: unknown", lambda: orchardbench.OrchardEnv("Sleep-v1"))
    raises(ValueError, "render_mode human", lambda: orchardbench.OrchardEnv(render_mode="human"))


def in_fork(env, queue):
    try:
        env.reset(seed=SEED)
        queue.put("no error")
    except RuntimeError as e:
        queue.put(str(e))


def test_a_forked_process_is_told_so():
    if "fork" not in multiprocessing.get_all_start_methods():
        return
    env = vector(1)
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        process = context.Process(target=in_fork, args=(env, queue))
        process.start()
    said = queue.get(timeout=60)
    process.join()
    assert "cannot be used in its fork" in said, said


def test_the_program_runs():
    presets = orchard("presets")
    assert presets.returncode == 0 and "paper" in presets.stdout.split()
    bad = orchard("scenario", "show", "--preset", "nowhere")
    assert bad.returncode == 2 and "nowhere" in bad.stderr, (bad.returncode, bad.stderr)


def test_the_notebook_runs():
    import nbclient
    import nbformat

    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    outputs = [cell["outputs"] for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(outputs[:4]) and "'depth': (4, 144, 192)" in str(outputs[0]), outputs[0]


def test_types():
    package = pathlib.Path(orchardbench.__file__).parent
    # The adapters need packages that are not installed here; tests/learning checks them.
    own = ["mypy", "--strict", "--exclude", "/(lerobot|rsl_rl|sb3|vla_eval)[.]py$", str(package)]
    for command in (own, ["mypy.stubtest", "orchardbench._native"]):
        done = subprocess.run([sys.executable, "-m", *command], capture_output=True, text=True, cwd=package.parent)
        assert done.returncode == 0, done.stdout + done.stderr


def main():
    chosen = sys.argv[1:]
    tests = [f for name, f in globals().items() if name.startswith("test_") and (not chosen or name in chosen)]
    failed = 0
    for test in tests:
        start = time.monotonic()
        try:
            test()
            said = "ok"
        except Exception:
            failed += 1
            said = f"FAILED\n{traceback.format_exc()}"
        print(f"{test.__name__} ({time.monotonic() - start:.1f} s): {said}", flush=True)
    sys.exit(f"{failed} of {len(tests)} tests failed" if failed else 0)


if __name__ == "__main__":
    main()
