"""The official benchmark under a policy in Python."""

import json
import pathlib
import tempfile

import numpy as np

from checks import raises, same
from environments import SEED, actions, orchard, single

import orchardbench


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
        settings = {"obs": ("state", "depth", "pixels"), "control": "ee_delta", "pixels_size": (24, 32), "pixels_hz": 5}
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
        raises(ValueError, "pixels_hz 7", run(obs=("pixels",), pixels_hz=7))
        raises(TypeError, "pixels_size must be a whole number", run(obs=("pixels",), pixels_size="big"))
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
