"""Checks the adapters of the Python package `orchardbench` with the packages that they are for, each at a tiny size.

Runs every function named test_*, or those whose names are given. ORCHARD names the program `orchard`.
"""

import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))

import gymnasium
import numpy as np
import torch
from checks import main, raises

import orchardbench
from orchardbench._vector import OrchardVectorEnv

SEED = 7
REACH = "orchardbench/Reach-v1"
SMALL = {"pixels_size": (24, 32)}
INTEGRATION = pathlib.Path(__file__).parents[2] / "integrations" / "lerobot_env_orchardbench"


def actions(step, envs, size):
    """Actions that depend on step and environment alone."""
    rows = [np.random.default_rng([step, k]).uniform(-1, 1, size) for k in range(envs)]
    return np.array(rows, dtype=np.float32)


LEARN = pathlib.Path(__file__).parents[2] / "examples" / "learn"


def test_the_example_of_ppo_trains_goes_on_and_is_tested():
    script = LEARN / "ppo_reach.py"
    with tempfile.TemporaryDirectory() as folder:
        run = [sys.executable, script, "--seed", "1", "--out", folder, "--envs", "4", "--threads", "2"]
        tiny = ["--teach-steps", "200", "--fits", "2", "--horizon", "16", "--warm-up", "64"]
        subprocess.run([*run, *tiny, "--steps", "128"], check=True)
        subprocess.run([*run, *tiny, "--steps", "192"], check=True)
        rounds = [json.loads(line) for line in (pathlib.Path(folder) / "curve.jsonl").read_text().splitlines()]
        assert [row["steps"] for row in rounds if row["stage"] == "ppo"] == [64, 128, 192], rounds
        subprocess.run([*run, "--evaluate", "2", "--test-seed", "5"], check=True)
        result = json.loads((pathlib.Path(folder) / "result-5.json").read_text())
        assert result["policy"]["worlds"] == result["rule"]["worlds"] == 2
        orchard = [os.environ["ORCHARD"], "demos", "--task", "reach", "--episodes", "1", "--controller", f"onnx:{folder}/policy.onnx"]
        subprocess.run([*orchard, "--obs", "state", "--out", f"{folder}/demos"], check=True)


def test_the_example_of_sb3_trains_and_is_tested():
    with tempfile.TemporaryDirectory() as folder:
        run = [sys.executable, LEARN / "sb3_reach.py", "--seed", "1", "--out", folder, "--envs", "4", "--threads", "2"]
        subprocess.run([*run, "--teach-steps", "400", "--fits", "2", "--horizon", "16", "--steps", "128"], check=True)
        assert (pathlib.Path(folder) / "progress.csv").read_text().count("\n") >= 2
        subprocess.run([*run, "--evaluate", "2", "--test-seed", "5"], check=True)
        assert json.loads((pathlib.Path(folder) / "result-5.json").read_text())["worlds"] == 2
        orchard = [os.environ["ORCHARD"], "demos", "--task", "reach", "--episodes", "1", "--controller", f"onnx:{folder}/policy.onnx"]
        subprocess.run([*orchard, "--obs", "state", "--out", f"{folder}/demos"], check=True)


def test_the_example_of_cloning_trains_goes_on_and_is_tested():
    with tempfile.TemporaryDirectory() as folder:
        run = [sys.executable, LEARN / "clone_harvest.py", "--seed", "1", "--out", folder, "--envs", "4", "--threads", "2"]
        tiny = ["--horizon", "25", "--fits", "1", "--batch", "64", "--image-batch", "4", "--states", "400", "--images", "100", "--note", "100"]
        subprocess.run([*run, *tiny, "--steps", "200"], check=True)
        subprocess.run([*run, *tiny, "--steps", "300"], check=True)
        rounds = [json.loads(line) for line in (pathlib.Path(folder) / "curve.jsonl").read_text().splitlines()]
        assert [row["steps"] for row in rounds] == [100, 200, 200, 300, 300], rounds
        subprocess.run([*run, "--evaluate", "2", "--test-seed", "5"], check=True)
        result = json.loads((pathlib.Path(folder) / "result-5.json").read_text())
        assert [row["worlds"] for row in result] == [2, 2], result
        orchard = [os.environ["ORCHARD"], "bench-v1", "--tasks", "harvest", "--conditions", "nominal", "--trees", "1", "--horizon", "2"]
        subprocess.run([*orchard, "--controller", f"onnx:{folder}/policy.onnx", "--out", f"{folder}/run"], check=True)


def test_sb3_accepts_and_learns():
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_checker import check_env

    from orchardbench.sb3 import OrchardSB3

    check_env(gymnasium.make(REACH, disable_env_checker=True).unwrapped)
    check_env(gymnasium.make(REACH, disable_env_checker=True, obs=("state", "depth", "pixels"), **SMALL).unwrapped)
    env = OrchardSB3("Reach-v1", num_envs=2, threads=2)
    model = PPO("MultiInputPolicy", env, n_steps=8, batch_size=8, n_epochs=1, device="cpu")
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(16)
    changed = [not torch.equal(a, b) for a, b in zip(before, model.policy.parameters())]
    assert any(changed), "nothing was learned"
    env.close()


def test_sb3_gives_what_the_environments_give():
    from orchardbench.sb3 import OrchardSB3

    # A robot at rest stalls after 15 s, in the 15th step at 1 Hz.
    settings = {"control_hz": 1}
    env, many = OrchardSB3("Harvest-v1", num_envs=2, **settings), OrchardVectorEnv("Harvest-v1", 2, **settings)
    assert env.render_mode is None
    assert env.seed(SEED) == [SEED, SEED + 1]
    observations, expected = env.reset(), many.reset(seed=[SEED, SEED + 1])[0]
    assert [info["seed"] for info in env.reset_infos] == [SEED, SEED + 1]
    still = np.zeros((2, len(many.interface["action"])), dtype=np.float32)
    for step in range(15):
        for key, values in expected.items():
            assert np.array_equal(observations[key], values), (step, key)
        observations, reward, dones, infos = env.step(still)
        expected, wanted, terminated, truncated, info = many.step(still)
        assert np.array_equal(reward, wanted.astype(np.float32)) and np.array_equal(dones, terminated | truncated)
        assert dones.all() == (step == 14), step
    for k, one in enumerate(infos):
        assert one["TimeLimit.truncated"] and one["outcome"] == "stalled" and not one["is_success"]
        assert one["episode"]["l"] == 15 and abs(one["episode"]["t"] - 15.0) < 1e-9
        assert abs(one["episode"]["r"] - info["final_info"]["statistics"]["return"][k]) < 1e-12
        for key, values in one["terminal_observation"].items():
            assert np.array_equal(values, info["final_obs"][k][key])
            assert key == "forces" or not np.array_equal(values, observations[key][k]) or key == "agent_vel"
    raises(NotImplementedError, "call it on `envs`", lambda: env.env_method("reset"))
    raises(RuntimeError, "step_wait without step_async", env.step_wait)
    env.close()
    many.close()


def rsl_rl_config():
    model = {"class_name": "MLPModel", "hidden_dims": [16], "activation": "elu"}
    actor = {**model, "distribution_cfg": {"class_name": "GaussianDistribution", "init_std": 0.5, "std_type": "scalar"}}
    return {
        "algorithm": {
            "class_name": "PPO",
            "num_learning_epochs": 1,
            "num_mini_batches": 1,
            "learning_rate": 1e-3,
            "schedule": "fixed",
            "gamma": 0.99,
            "lam": 0.95,
            "value_loss_coef": 1.0,
            "entropy_coef": 0.0,
            "clip_param": 0.2,
            "use_clipped_value_loss": True,
            "max_grad_norm": 1.0,
            "desired_kl": 0.01,
        },
        "actor": actor,
        "critic": model,
        "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
        "num_steps_per_env": 8,
        "save_interval": 100,
    }


def test_tensors_of_the_environments_are_their_arrays():
    settings = {"control_hz": 1, "obs": ("state", "depth")}
    given, many = (OrchardVectorEnv("Harvest-v1", 2, **kind, **settings) for kind in ({"tensors": "torch"}, {}))
    (seen, _), (expected, _) = given.reset(seed=SEED), many.reset(seed=SEED)
    still = np.zeros(many.action_space.shape, dtype=np.float32)
    for _ in range(15):
        assert all(np.array_equal(seen[key].numpy(), expected[key]) for key in expected)
        seen, *ends, info = given.step(torch.from_numpy(still).double())
        expected, *wanted, about = many.step(still)
        assert [end.dtype for end in ends] == [torch.float32, torch.bool, torch.bool]
        assert all(np.array_equal(end.numpy(), array.astype(end.numpy().dtype)) for end, array in zip(ends, wanted))
    for last, array in zip(info["final_obs"], about["final_obs"]):
        assert all(np.array_equal(last[key].numpy(), array[key]) for key in array)
    for env in (given, many):
        env.close()


def test_rsl_rl_learns():
    from rsl_rl.runners import OnPolicyRunner

    from orchardbench.rsl_rl import OrchardRslRl

    env = OrchardRslRl("Reach-v1", num_envs=2, threads=2, seed=SEED)
    runner = OnPolicyRunner(env, rsl_rl_config(), log_dir=None, device="cpu")
    before = [p.detach().clone() for p in runner.alg.actor.parameters()]
    runner.learn(2)
    assert any(not torch.equal(a, b) for a, b in zip(before, runner.alg.actor.parameters())), "nothing was learned"
    env.envs.close()


def test_rsl_rl_gives_what_the_environments_give():
    from orchardbench.rsl_rl import OrchardRslRl

    settings = {"control_hz": 1, "obs": ("state", "depth", "pixels"), **SMALL}
    env, many = OrchardRslRl("Harvest-v1", num_envs=2, seed=SEED, **settings), OrchardVectorEnv("Harvest-v1", 2, **settings)
    expected = many.reset(seed=SEED)[0]
    size = len(many.interface["action"])
    assert (env.num_actions, env.max_episode_length) == (size, 75)
    groups = env.get_observations()
    for step in range(15):
        keys = [f["key"] for f in many.interface["observation"] if expected[f["key"]].ndim == 2]
        policy = np.concatenate([expected[key] for key in keys], axis=1)
        assert np.array_equal(groups["policy"].numpy(), policy), step
        assert np.array_equal(groups["depth"].numpy()[:, 0], expected["depth"])
        assert groups["pixels_wrist"].shape == (2, 3, 24, 32)
        assert np.array_equal(np.rint(255 * groups["pixels_wrist"].numpy()).astype(np.uint8), np.moveaxis(expected["pixels_wrist"], 3, 1))
        groups, reward, dones, extras = env.step(torch.zeros(2, size))
        expected, wanted, terminated, truncated, _ = many.step(np.zeros((2, size), dtype=np.float32))
        assert np.array_equal(reward.numpy(), wanted.astype(np.float32))
        assert dones.bool().all() == (step == 14) and torch.equal(dones.bool(), extras["time_outs"])
        assert list(env.episode_length_buf) == ([0, 0] if step == 14 else [step + 1] * 2)
    assert extras["log"]["/episode/success"] == 0.0
    env.envs.close()
    many.close()


def test_skrl_learns_without_an_adapter():
    from skrl.agents.torch.ppo import PPO, PPO_CFG
    from skrl.envs.wrappers.torch import wrap_env
    from skrl.memories.torch import RandomMemory
    from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
    from skrl.trainers.torch import SequentialTrainer, SequentialTrainerCfg

    envs = wrap_env(gymnasium.make_vec(REACH, num_envs=2, vectorization_mode="vector_entry_point"), verbose=False)
    assert envs.num_envs == 2 and type(envs).__name__ == "GymnasiumWrapper"

    class Actor(GaussianMixin, Model):
        def __init__(self, **spaces):
            Model.__init__(self, **spaces)
            GaussianMixin.__init__(self)
            self.net = torch.nn.Linear(self.num_observations, self.num_actions)
            self.log_std = torch.nn.Parameter(torch.zeros(self.num_actions))

        def compute(self, inputs, role=""):
            return self.net(inputs["observations"]), {"log_std": self.log_std}

    class Critic(DeterministicMixin, Model):
        def __init__(self, **spaces):
            Model.__init__(self, **spaces)
            DeterministicMixin.__init__(self)
            self.net = torch.nn.Linear(self.num_observations, 1)

        def compute(self, inputs, role=""):
            return self.net(inputs["observations"]), {}

    spaces = {"observation_space": envs.observation_space, "action_space": envs.action_space, "device": envs.device}
    models = {"policy": Actor(**spaces), "value": Critic(**spaces)}
    before = [p.detach().clone() for p in models["policy"].parameters()]
    config = PPO_CFG(rollouts=8, learning_epochs=1, mini_batches=1)
    config.experiment.write_interval = config.experiment.checkpoint_interval = 0
    memory = RandomMemory(memory_size=8, num_envs=2, device=envs.device)
    agent = PPO(models=models, memory=memory, cfg=config, **spaces)
    trainer = SequentialTrainer(env=envs, agents=agent, cfg=SequentialTrainerCfg(timesteps=8, headless=True, disable_progressbar=True))
    trainer.train()
    assert any(not torch.equal(a, b) for a, b in zip(before, models["policy"].parameters())), "nothing was learned"


def test_torchrl_accepts_and_learns():
    from tensordict.nn import TensorDictModule
    from torchrl.envs import GymWrapper, check_env_specs

    one = GymWrapper(gymnasium.make(REACH, disable_env_checker=True).unwrapped)
    check_env_specs(one)
    # TorchRL resets what has ended itself.
    envs = GymWrapper(gymnasium.make_vec(REACH, num_envs=2, vectorization_mode="vector_entry_point", autoreset_mode="Disabled", control_hz=1))
    check_env_specs(envs)
    envs.set_seed(SEED)
    size = envs.action_spec.shape[-1]
    net = torch.nn.Linear(envs.observation_spec["target"].shape[-1], size)
    policy = TensorDictModule(net, in_keys=["target"], out_keys=["action"])
    # Episodes end after 30 s at the latest.
    steps = envs.rollout(40, policy, break_when_any_done=False)
    ended = steps["next", "done"][0, :, 0]
    assert steps.batch_size == (2, 40) and ended[:-1].any() and not ended[:10].any(), ended
    for step in range(39):
        goes_on = torch.equal(steps["next", "target"][0, step], steps["target"][0, step + 1])
        assert goes_on != bool(ended[step]), step
    before = net.weight.detach().clone()
    loss = -(net(steps["target"]).tanh() * steps["next", "reward"]).mean() - net(steps["target"]).square().mean()
    loss.backward()
    torch.optim.SGD(net.parameters(), lr=0.1).step()
    assert not torch.equal(before, net.weight), "nothing was learned"
    envs.close()
    one.close()


def test_pufferlib_writes_what_the_environments_give():
    import pufferlib.vector

    from orchardbench.pufferlib import OrchardPuffer

    # A robot at rest stalls after 15 s, in the 15th step at 1 Hz.
    settings = {"control_hz": 1, "obs": ("state", "depth")}
    made = {"task": "Harvest-v1", "num_envs": 2, **settings}
    envs = pufferlib.vector.make(OrchardPuffer, env_kwargs=made, num_envs=2, backend=pufferlib.vector.Serial, seed=SEED)
    many = [OrchardVectorEnv("Harvest-v1", 2, **settings) for _ in range(2)]
    observations, _ = envs.reset(seed=SEED)
    expected = [env.reset(seed=SEED + k)[0] for k, env in enumerate(many)]
    columns = envs.driver_env.columns
    assert envs.num_agents == 4 and list(columns) == [field["key"] for field in many[0].interface["observation"]]
    still = np.zeros((4, len(many[0].interface["action"])), dtype=np.float32)
    for step in range(15):
        for key, where in columns.items():
            rows = np.concatenate([seen[key].reshape(2, -1) for seen in expected])
            assert np.array_equal(observations[:, where], rows), (step, key)
        observations, reward, terminals, truncations, infos = envs.step(still)
        stepped = [env.step(still[:2]) for env in many]
        expected = [one[0] for one in stepped]
        assert np.array_equal(reward, np.concatenate([one[1] for one in stepped]).astype(np.float32))
        assert truncations.all() == (step == 14) and not terminals.any()
    assert [info["length"] for info in infos] == [15.0] * 4 and not any(info["success"] for info in infos), infos
    raises(ValueError, "PufferLib's observations are numbers", lambda: OrchardPuffer(obs=("task_description",)))
    envs.close()


def test_vla_eval_runs_a_model_server():
    from vla_eval import api
    from vla_eval.model_servers.predict import PredictModelServer

    seen = []

    class Still(PredictModelServer):
        """Keeps still, so that the robot stalls after 15 s."""

        def predict(self, obs, ctx):
            seen.append(obs)
            return {"actions": np.zeros(SIZE, dtype=np.float32)}

        def get_action_spec(self):
            return {}

        def get_observation_spec(self):
            return {}

    params = {"task": "Harvest-v1", "seeds": [SEED], "control_hz": 1, "pixels_size": 32}
    env = orchardbench.OrchardEnv("Harvest-v1", obs=("state", "pixels"), control_hz=1, pixels_size=32, world=1)
    SIZE = len(env.interface["action"])
    config = {"benchmarks": [{"benchmark": "orchardbench.vla_eval:OrchardBenchmark", "episodes_per_task": 2, "params": params}]}
    with tempfile.TemporaryDirectory() as folder, api.serve_background(Still()) as server:
        results = api.run(config, server_url=server.url, output_dir=folder, no_save=True, docker=False)
    (result,) = results
    (task,) = result["tasks"]
    episodes = task["episodes"]
    assert [episode["steps"] for episode in episodes] == [15, 15], episodes
    assert [episode["metrics"]["success"] for episode in episodes] == [False, False]
    # The second episode has world 1, and comes over the socket with every bit.
    second, expected = seen[15], env.reset(seed=SEED)[0]
    assert second["task_description"] == env.interface["task_description"]
    assert np.array_equal(second["images"]["wrist"], expected["pixels_wrist"]) and np.array_equal(second["images"]["base"], expected["pixels_base"])
    assert np.array_equal(second["states"], np.concatenate([expected[key] for key in ("agent_pos", "agent_vel", "forces")]))


def demonstrations(folder, *options):
    program = os.environ["ORCHARD"]
    line = [program, "demos", "--episodes", "2", "--task", "reach", "--seeds", "3", "--obs", "state,depth,pixels", "--pixels-size", "32", "--out", str(folder)]
    done = subprocess.run([*line, *options], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "meta.json").read_text())


def test_lerobot_reads_demonstrations():
    import pyarrow.parquet as parquet
    from lerobot.datasets.lerobot_dataset import LeRobotDataset
    from PIL import Image

    from orchardbench.lerobot import convert

    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder) / "neutral"
        meta = demonstrations(root, "--policy-actions")
        out = pathlib.Path(folder) / "lerobot"
        convert(root, out, "local/test")
        dataset = LeRobotDataset("local/test", root=out)
        assert dataset.fps == meta["control_hz"] and dataset.num_episodes == 2
        assert dataset.meta.robot_type == "ridgeback-fr3"
        records = [json.loads(path.read_text())["demonstration"] for path in sorted((root / "episodes").glob("*.json"))]
        order = [d for split in ("train", "validation", "test") for d in records if d["split"] == split]
        tables = [parquet.read_table(root / d["steps"]["path"]).to_pylist() for d in order]
        rows = [row for table in tables for row in table]
        assert dataset.num_frames == len(rows)
        for index in (0, len(rows) // 2, len(rows) - 1):
            item, row = dataset[index], rows[index]
            assert np.array_equal(item["action"].numpy(), np.float32(row["action"]))
            state = np.float32(row["agent_pos"] + row["agent_vel"] + row["forces"])
            assert np.array_equal(item["observation.state"].numpy(), state)
            assert np.array_equal(item["observation.environment_state"].numpy(), np.float32(row["target"]))
            assert item["task"] == meta["task_description"]
            # Depth and colour without loss.
            depth = np.asarray(Image.open(root / row["depth"])) if row["depth"] else np.zeros((144, 192))
            assert np.array_equal(np.rint(item["observation.images.depth"].numpy().squeeze()), depth)
            wrist = np.asarray(Image.open(root / row["pixels_wrist"]))
            assert np.array_equal(np.rint(255 * item["observation.images.wrist"].numpy()).astype(np.uint8), np.moveaxis(wrist, 2, 0))
        last = dataset[len(rows) - 1]
        assert bool(last["next.done"]) and bool(last["next.success"]) == order[-1]["success"]
        raises(SystemExit, "no summary.json", lambda: convert(out, root / "x", "local/test"))


def test_lerobot_finds_the_plugin():
    sys.path.insert(0, str(INTEGRATION))
    import lerobot_env_orchardbench
    from lerobot.envs.factory import make_env, make_env_config
    from lerobot.envs.utils import env_to_policy_features, preprocess_observation

    config = make_env_config("orchardbench", task="Reach-v1", pixels_size=32)
    envs = make_env(config, n_envs=2)["orchardbench"][0]
    observations, _ = envs.reset(seed=[SEED, SEED])
    batch = preprocess_observation(observations)
    features = env_to_policy_features(config)
    for name, feature in features.items():
        if name != "action":
            assert tuple(batch[name].shape[1:]) == tuple(feature.shape), (name, batch[name].shape, feature.shape)
    one = orchardbench.OrchardEnv("Reach-v1", obs=("state", "pixels"), pixels_size=32, world=1)
    expected = one.reset(seed=SEED)[0]
    assert np.array_equal(observations["pixels"]["wrist"][1], expected["pixels_wrist"])
    assert np.array_equal(batch["observation.environment_state"][1].numpy(), expected["target"])
    stepped = envs.step(np.zeros((2, features["action"].shape[0]), dtype=np.float32))
    assert len(stepped[1]) == 2 and "is_success" in stepped[4]
    envs.close()
    # The file for the Hub makes the same.
    spec = importlib.util.spec_from_file_location("env", INTEGRATION / "env.py")
    hub = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hub)
    made = hub.make_env(n_envs=1, cfg=config)["orchardbench"][0]
    assert np.array_equal(made.reset(seed=[SEED])[0]["agent_pos"][0], observations["agent_pos"][0])
    made.close()
    assert lerobot_env_orchardbench.OrchardBenchEnv is type(config)


def test_lerobot_evaluates_a_policy():
    small = {"dim_model": 32, "n_heads": 2, "dim_feedforward": 32, "n_encoder_layers": 1, "n_vae_encoder_layers": 1, "latent_dim": 4}
    small |= {"type": "act", "device": "cpu", "push_to_hub": "false", "pretrained_backbone_weights": "null"}
    with tempfile.TemporaryDirectory() as folder:
        # LeRobot finds its plugins by the names of installed packages.
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--target", folder]
        source = pathlib.Path(shutil.copytree(INTEGRATION, pathlib.Path(folder, "source")))
        subprocess.run([*pip, str(source)], check=True)
        path = os.pathsep.join([folder, os.environ["PYTHONPATH"]])
        line = [str(pathlib.Path(sys.executable).with_name("lerobot-eval")), *(f"--policy.{key}={value}" for key, value in small.items())]
        line += ["--env.type=orchardbench", "--env.task=Reach-v1", "--env.fps=1", "--env.pixels_size=32", f"--output_dir={folder}/out"]
        line += ["--eval.n_episodes=2", "--eval.batch_size=2", "--eval.use_async_envs=false", f"--seed={SEED}"]
        done = subprocess.run(line, env={**os.environ, "PYTHONPATH": path, "HF_HUB_OFFLINE": "1"}, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        result = json.loads(pathlib.Path(folder, "out", "eval_info.json").read_text())
        (told,) = result["per_task"]
        assert len(told["metrics"]["successes"]) == 2 and result["overall"]["n_episodes"] == 2, result


def test_types():
    package = pathlib.Path(orchardbench.__file__).parent
    files = [str(package / f"{name}.py") for name in ("_rows", "lerobot", "pufferlib", "rsl_rl", "sb3", "vla_eval")]
    done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", "--ignore-missing-imports", "--allow-subclassing-any", *files], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def skipped(name):
    """The reason why a test is left out."""
    if "lerobot" in name and sys.version_info < (3, 12):
        return "LeRobot needs Python 3.12"
    if "pufferlib" in name and importlib.util.find_spec("pufferlib") is None:
        return "PufferLib is not installed: building it downloads graphics libraries that are on no package index"
    return None


if __name__ == "__main__":
    main([sys.modules["__main__"]], skipped)
