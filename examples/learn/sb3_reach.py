"""`Reach-v1` through Stable-Baselines3: the same task, features, teaching and network as `ppo_reach.py`, with the PPO of that library.

    pip install 'orchardbench[torch,rl]'
    python sb3_reach.py --seed 1 --out runs/sb3-1
    python sb3_reach.py --seed 1 --out runs/sb3-1 --evaluate 512

First the rule teaches the network in the states that the network itself comes to, then PPO goes on. DIR/model.zip is the model of the library, DIR/policy.onnx
and DIR/policy.json the policy for `--controller onnx:DIR/policy.onnx`.
"""

import argparse
import json
import pathlib
import sys

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.logger import configure
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

from orchardbench.sb3 import OrchardSB3

from ppo_reach import ENVIRONMENT, KEYS, TRAINING_SEED, VALIDATION_SEED, Features, evaluate
from reach_rule import rule


class Extractor(BaseFeaturesExtractor):
    """The features of `ppo_reach.py` as the library asks for them."""

    def __init__(self, observation_space):
        size = Features()(*(torch.zeros(1, *observation_space[key].shape) for key in KEYS)).shape[-1]
        super().__init__(observation_space, size)
        self.features = Features()

    def forward(self, observations):
        return self.features(*(observations[key] for key in KEYS))


class Actor(nn.Module):
    """The mean action of a model, clipped as the library clips it."""

    def __init__(self, policy):
        super().__init__()
        self.policy = policy

    def forward(self, agent_pos, agent_vel, forces, tool_pose, target):
        features = self.policy.features_extractor(dict(zip(KEYS, (agent_pos, agent_vel, forces, tool_pose, target))))
        return torch.clamp(self.policy.action_net(self.policy.mlp_extractor.forward_actor(features)), -1.0, 1.0)


def teach(model, steps, horizon, fits):
    """DAgger: the rule says what it would have done in the states that the network comes to."""
    envs, device = model.env, model.policy.device
    actor, seen, labels = Actor(model.policy), [], []
    optimiser = torch.optim.AdamW(model.policy.parameters(), lr=1e-3, weight_decay=1e-4)
    rng = np.random.default_rng(model.seed)
    observation = envs.reset()
    for taught in range(0, steps, horizon * envs.num_envs):
        leads = rng.random(envs.num_envs) < max(0.1, 1.0 - 3.0 * taught / steps)
        for _ in range(horizon):
            label = rule(observation)
            arrays = [torch.as_tensor(observation[key], device=device) for key in KEYS]
            seen.append(model.policy.features_extractor(dict(zip(KEYS, arrays))).detach())
            labels.append(torch.as_tensor(label, device=device))
            with torch.no_grad():
                own = actor(*arrays).cpu().numpy()
            observation, *_ = envs.step(np.where(leads[:, None], label, own))
        x, y = torch.cat(seen), torch.cat(labels)
        last = taught + horizon * envs.num_envs >= steps
        for _ in range(fits * (30 if last else 1)):
            at = torch.randint(len(x), (min(16384, len(x)),), device=device)
            mean = model.policy.action_net(model.policy.mlp_extractor.forward_actor(x[at]))
            loss = nn.functional.smooth_l1_loss(mean, y[at], beta=0.1)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
        print({"taught": taught + horizon * envs.num_envs, "loss": loss.item()}, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--envs", type=int, default=512)
    parser.add_argument("--threads", type=int, default=0, help="0: all cores")
    parser.add_argument("--teach-steps", type=int, default=900_000, help="steps in which the rule teaches; 0: PPO alone")
    parser.add_argument("--fits", type=int, default=60, help="batches that are fitted after every 50 steps of it")
    parser.add_argument("--steps", type=int, default=1_500_000, help="steps of PPO")
    parser.add_argument("--horizon", type=int, default=64)
    parser.add_argument("--evaluate", type=int, default=0, metavar="WORLDS", help="tests the trained model instead of training")
    parser.add_argument("--test-seed", type=int, default=VALIDATION_SEED)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    if args.evaluate:
        model = PPO.load(args.out / "model.zip", device="cpu")
        result = evaluate(lambda observation: model.predict(observation, deterministic=True)[0], args.evaluate, args.test_seed, args.threads)
        (args.out / f"result-{args.test_seed}.json").write_text(json.dumps(result, indent=1))
        print(json.dumps(result))
        return
    envs = OrchardSB3("Reach-v1", num_envs=args.envs, threads=args.threads, **ENVIRONMENT)
    envs.seed(TRAINING_SEED + 1000 * args.seed)
    network = {"features_extractor_class": Extractor, "net_arch": [512, 512, 512], "activation_fn": nn.SiLU, "log_std_init": -3.0}
    model = PPO("MultiInputPolicy", envs, learning_rate=1e-4, n_steps=args.horizon, batch_size=max(args.envs * args.horizon // 8, 2), n_epochs=4,
                gamma=0.99, target_kl=0.05, policy_kwargs=network, seed=args.seed)
    model.set_logger(configure(str(args.out), ["csv", "stdout"]))
    teach(model, args.teach_steps, 50, args.fits)
    envs.seed(TRAINING_SEED + 1000 * args.seed + 1)
    model.learn(args.steps, reset_num_timesteps=True)
    model.save(args.out / "model.zip")
    space, interface = envs.observation_space, envs.envs.interface
    arrays = tuple(torch.zeros(1, *space[key].shape) for key in KEYS)
    actor = Actor(model.policy.cpu().eval())
    torch.onnx.export(actor, arrays, args.out / "policy.onnx", input_names=list(KEYS), output_names=["action"], dynamo=False)
    (args.out / "policy.json").write_text(json.dumps(interface, indent=1))


if __name__ == "__main__":
    sys.exit(main())
