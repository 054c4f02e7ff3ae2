"""PPO from state on `Reach-v1`: reach the named fruit, grip it, and hold it for one second.

In the style of CleanRL. Training has two stages. First a rule of some forty lines teaches the network in the states that the network itself
comes to (DAgger, Ross, Gordon and Bagnell 2011); then PPO (Schulman et al. 2017) goes on from there with the reward of the task. `--teach-steps 0` leaves
the first stage out. The policy sees numbers that the robot measures and the named place, and no truth.

    pip install 'orchardbench[torch]'
    python ppo_reach.py --seed 1 --out runs/1            # trains; the same command goes on after a break
    python ppo_reach.py --seed 1 --out runs/1 --evaluate 512

DIR/curve.jsonl has the learning curve, DIR/checkpoint.pt all that is needed to go on (but for the states that the rule has labelled, which are
collected anew), DIR/policy.onnx and DIR/policy.json the policy for `--controller onnx:DIR/policy.onnx`.
"""

import argparse
import hashlib
import json
import math
import os
import pathlib
import sys
import time

import gymnasium
import numpy as np
import torch
from torch import nn

import orchardbench  # noqa: F401: registers the environments

from reach_rule import NEAREST, PITCH, STAND, TRUNK, rule

TASK = "orchardbench/Reach-v1"
KEYS = ("agent_pos", "agent_vel", "forces", "tool_pose", "target")
ENVIRONMENT = {"obs": ("state",), "control": "ee_delta", "control_hz": 10}
# Seeds of training; those of the final test are never used before it.
TRAINING_SEED, VALIDATION_SEED, TEST_SEED = 3_000_000, 2_000_000, 1_000_000


class Features(nn.Module):
    """What the network is given: places and directions in the frames in which the task is the same everywhere."""

    def forward(self, agent_pos, agent_vel, forces, tool_pose, target):
        x, y, yaw = agent_pos[..., 9:10], agent_pos[..., 10:11], agent_pos[..., 11:12]
        c, s = torch.cos(yaw), torch.sin(yaw)

        def in_base(vx, vy, vz):
            return [c * vx + s * vy, c * vy - s * vx, vz]

        fruit = in_base(target[..., 0:1] - x, target[..., 1:2] - y, target[..., 2:3])
        tool = in_base(tool_pose[..., 0:1] - x, tool_pose[..., 1:2] - y, tool_pose[..., 2:3])
        qx, qy, qz, qw = (tool_pose[..., k : k + 1] for k in range(3, 7))
        axes = [
            in_base(1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy + qz * qw), 2 * (qx * qz - qy * qw)),
            in_base(2 * (qx * qy - qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz + qx * qw)),
            in_base(2 * (qx * qz + qy * qw), 2 * (qy * qz - qx * qw), 1 - 2 * (qx * qx + qy * qy)),
        ]
        way = [f - t for f, t in zip(fruit, tool)]
        in_tool = [sum(a * w for a, w in zip(axis, way)) for axis in axes]
        # The way along the line of approach and off it tell the phases apart.
        reach = torch.sqrt(fruit[0] * fruit[0] + fruit[1] * fruit[1] + 1e-6)
        ahead = [fruit[0] / reach, fruit[1] / reach]
        line = [ahead[0] * math.cos(PITCH), ahead[1] * math.cos(PITCH), math.sin(PITCH)]
        along = sum(a * w for a, w in zip(line, way))
        off_line = [w - along * a for w, a in zip(way, line)]
        lateral = torch.sqrt(sum(o * o for o in off_line) + 1e-8)
        distance = torch.sqrt(sum(w * w for w in way) + 1e-8)
        near = torch.cat([*way, *in_tool, along, *off_line, lateral, distance], -1)
        # Fruit and base from the trunk, and the place outside of the fruit, in the base's frame.
        fx, fy, bx, by = target[..., 0:1] - float(TRUNK[0]), target[..., 1:2] - float(TRUNK[1]), x - float(TRUNK[0]), y - float(TRUNK[1])
        far = torch.sqrt((fx - 0.1) * (fx - 0.1) + fy * fy + 1e-6)
        away = torch.sqrt(bx * bx + by * by + 1e-6)
        ox, oy = (fx - 0.1) / far, fy / far
        stand = torch.clamp(fx * ox + fy * oy + STAND, min=NEAREST)
        skew = fy * ox - fx * oy
        to_stand = in_base(stand * ox - skew * oy - bx, stand * oy + skew * ox - by, 0.0)[:2]
        round_trunk = [(bx * ox + by * oy) / away, (bx * oy - by * ox) / away]
        around = in_base(-by / away, bx / away, 0.0)[:2]
        left = torch.sqrt(to_stand[0] * to_stand[0] + to_stand[1] * to_stand[1] + 1e-8)
        off = torch.cat([*to_stand, left, fruit[1] / reach], -1)
        fingers, finger_force = agent_pos[..., 7:9], forces[..., 7:9]
        parts = [
            *fruit, *tool, *axes[0], *axes[2], reach, *ahead, *round_trunk, *around, away, stand, torch.tanh(off),
            torch.tanh(off / 0.3), torch.tanh(off / 0.06),
            torch.tanh(near / 0.3), torch.tanh(near / 0.08), torch.tanh(near / 0.02),
            fingers * 25.0, torch.tanh((fingers - 0.036) / 0.002), torch.tanh(finger_force / 10.0), agent_pos[..., :7] / 2.0,
            agent_vel[..., :7], agent_vel[..., 7:10] * 2.0, torch.tanh(forces[..., :7] / 30.0), target[..., 3:4] * 25.0,
        ]
        return torch.cat(parts, -1)


def layer(inputs, outputs, gain=math.sqrt(2)):
    it = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(it.weight, gain)
    nn.init.zeros_(it.bias)
    return it


def net(inputs, outputs, gain, width=512):
    return nn.Sequential(
        layer(inputs, width), nn.LayerNorm(width), nn.SiLU(), layer(width, width), nn.LayerNorm(width), nn.SiLU(),
        layer(width, width), nn.SiLU(), layer(width, outputs, gain),
    )


class Agent(nn.Module):
    """Actor and critic over the features of these observations, made by `net` from numbers of inputs and outputs and a gain."""

    def __init__(self, observation, actions, keys=KEYS, features=Features, net=net):
        super().__init__()
        self.features = features()
        size = self.features(*(torch.zeros(1, *observation[key].shape) for key in keys)).shape[-1]
        self.actor, self.critic = net(size, actions, 0.01), net(size, 1, 1.0)
        self.log_std = nn.Parameter(torch.full((actions,), -3.0))

    def mean(self, features):
        return self.actor(features)

    def forward(self, *observation):
        return torch.clamp(self.actor(self.features(*observation)), -1.0, 1.0)


def make(envs, threads, mode=gymnasium.vector.AutoresetMode.SAME_STEP, environment=ENVIRONMENT):
    return gymnasium.make_vec(TASK, num_envs=envs, vectorization_mode="vector_entry_point", autoreset_mode=mode, threads=threads, **environment)


class Episodes:
    """Success of the episodes that ended."""

    def __init__(self):
        self.done, self.ended = 0, 0

    def count(self, ended, info):
        if ended.any():
            final = info["final_info"]
            self.done += int(np.asarray(final["is_success"])[ended].sum())
            self.ended += int(ended.sum())

    def rate(self):
        return self.done / max(self.ended, 1)


class Trainer:
    keys, environment = KEYS, ENVIRONMENT

    def make_envs(self):
        return make(self.args.envs, self.args.threads, environment=self.environment)

    def make_agent(self, observation, actions):
        return Agent(observation, actions)

    def __init__(self, args):
        self.args, self.device = args, torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.dir = pathlib.Path(args.out)
        self.dir.mkdir(parents=True, exist_ok=True)
        torch.manual_seed(args.seed)
        self.rng = np.random.default_rng(args.seed)
        self.envs = self.make_envs()
        self.agent = self.make_agent(self.envs.single_observation_space, self.envs.single_action_space.shape[0]).to(self.device)
        self.teach = torch.optim.AdamW(self.agent.actor.parameters(), lr=1e-3, weight_decay=1e-4)
        self.ppo = torch.optim.Adam(self.agent.parameters(), lr=args.rate, eps=1e-5)
        self.steps, self.taught, self.resets, self.began = 0, 0, 0, time.time()
        self.data, self.labels = [], []
        self.load()
        # A break begins new episodes, of worlds that no earlier part has seen.
        seed = TRAINING_SEED + 1000 * args.seed + self.resets
        self.observation, _ = self.envs.reset(seed=seed)
        self.resets += 1

    def features(self, observation):
        arrays = (torch.as_tensor(observation[key], device=self.device) for key in self.keys)
        with torch.no_grad():
            return self.agent.features(*arrays)

    def load(self):
        file = self.dir / "checkpoint.pt"
        if not file.exists():
            return
        state = torch.load(file, map_location=self.device, weights_only=True)
        self.agent.load_state_dict(state["agent"])
        self.ppo.load_state_dict(state["ppo"])
        self.teach.load_state_dict(state["teach"])
        self.steps, self.taught, self.resets = state["steps"], state["taught"], state["resets"]
        print(f"goes on at {self.taught} taught and {self.steps} further steps")

    def save(self):
        state = {"agent": self.agent.state_dict(), "ppo": self.ppo.state_dict(), "teach": self.teach.state_dict()}
        state |= {"steps": self.steps, "taught": self.taught, "resets": self.resets}
        torch.save(state, self.dir / "checkpoint.tmp")
        os.replace(self.dir / "checkpoint.tmp", self.dir / "checkpoint.pt")

    def note(self, **what):
        what = {"taught": self.taught, "steps": self.steps, "seconds": round(time.time() - self.began, 1), **what}
        with open(self.dir / "curve.jsonl", "a") as file:
            file.write(json.dumps(what) + "\n")
        print(what, flush=True)

    def is_over(self):
        return self.args.minutes and time.time() - self.began > 60 * self.args.minutes

    def step(self, actions):
        self.observation, reward, terminated, truncated, info = self.envs.step(actions.astype(np.float32))
        return reward, terminated, truncated, info

    def learn_from_rule(self):
        """DAgger: the network acts (in some environments the rule), and the rule says what it would have done."""
        args = self.args
        if self.taught >= args.teach_steps:
            return
        ends, horizon = Episodes(), 50
        while self.taught < args.teach_steps and not self.is_over():
            share = max(0.1, 1.0 - 3.0 * self.taught / args.teach_steps)
            leads = self.rng.random(args.envs) < share
            for _ in range(horizon):
                label = rule(self.observation)
                features = self.features(self.observation)
                self.data.append(features.to(torch.float16))
                self.labels.append(torch.as_tensor(label, device=self.device).to(torch.float16))
                with torch.no_grad():
                    own = torch.clamp(self.agent.mean(features), -1, 1).cpu().numpy()
                _, terminated, truncated, info = self.step(np.where(leads[:, None], label, own))
                ended = (terminated | truncated) & ~leads
                ends.count(ended, info)
                self.taught += args.envs
            loss = self.fit(args.fits)
            if len(self.data) % (horizon * 8) < horizon or ends.ended > 500:
                self.note(stage="rule", success=ends.rate(), episodes=ends.ended, loss=loss)
                ends = Episodes()
        if self.taught < args.teach_steps or not self.data:
            return
        for group in self.teach.param_groups:
            group["lr"] = 3e-4
        self.fit(args.fits * 20)
        for group in self.teach.param_groups:
            group["lr"] = 5e-5
        loss = self.fit(args.fits * 10)
        self.note(stage="rule ended", loss=loss)

    def fit(self, count):
        x, y = torch.cat(self.data), torch.cat(self.labels)
        total = 0.0
        for _ in range(count):
            at = torch.randint(len(x), (min(16384, len(x)),), device=self.device)
            loss = nn.functional.smooth_l1_loss(self.agent.mean(x[at].float()), y[at].float(), beta=0.1)
            self.teach.zero_grad()
            loss.backward()
            self.teach.step()
            total += loss.item()
        return total / count

    def reinforce(self):
        """PPO; truncated episodes are bootstrapped from their last observation."""
        args, n, horizon = self.args, self.args.envs, self.args.horizon
        while self.steps < args.steps and not self.is_over():
            rows = {name: [] for name in ("features", "action", "log", "value", "reward", "ended")}
            ends = Episodes()
            for _ in range(horizon):
                features = self.features(self.observation)
                with torch.no_grad():
                    mean, value = self.agent.mean(features), self.agent.critic(features)[:, 0]
                    spread = torch.distributions.Normal(mean, self.agent.log_std.exp())
                    action = spread.sample()
                    log = spread.log_prob(action).sum(-1)
                reward, terminated, truncated, info = self.step(np.clip(action.cpu().numpy(), -1, 1))
                reward = torch.as_tensor(reward, dtype=torch.float32, device=self.device)
                ended = terminated | truncated
                ends.count(ended, info)
                if truncated.any():
                    rest = truncated & ~terminated
                    last = {key: np.stack([info["final_obs"][k][key] for k in np.flatnonzero(rest)]) for key in self.keys}
                    with torch.no_grad():
                        more = self.agent.critic(self.features(last))[:, 0]
                    reward[torch.as_tensor(rest, device=self.device)] += args.gamma * more
                ended = torch.as_tensor(ended, dtype=torch.float32, device=self.device)
                for name, part in zip(rows, (features, action, log, value, reward, ended)):
                    rows[name].append(part)
                self.steps += n
            rows = {name: torch.stack(parts) for name, parts in rows.items()}
            with torch.no_grad():
                value = self.agent.critic(self.features(self.observation))[:, 0]
            advantage, gain = torch.zeros_like(rows["reward"]), torch.zeros(n, device=self.device)
            for t in reversed(range(horizon)):
                goes_on = 1.0 - rows["ended"][t]
                delta = rows["reward"][t] + args.gamma * value * goes_on - rows["value"][t]
                gain = delta + args.gamma * args.gae * goes_on * gain
                advantage[t], value = gain, rows["value"][t]
            self.improve(rows, advantage, is_new=self.steps < args.warm_up)
            self.note(stage="ppo", success=ends.rate(), episodes=ends.ended, reward=rows["reward"].mean().item(),
                      std=self.agent.log_std.exp().mean().item())
            if self.steps // (n * horizon) % 10 == 0:
                self.save()

    def improve(self, rows, advantage, is_new):
        args = self.args
        flat = {name: part.flatten(0, 1) for name, part in rows.items()}
        goal = (advantage + rows["value"]).flatten()
        advantage = advantage.flatten()
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
        count = len(goal)
        for _ in range(args.epochs):
            for at in torch.randperm(count, device=self.device).split(max(count // args.batches, 1)):
                spread = torch.distributions.Normal(self.agent.mean(flat["features"][at]), self.agent.log_std.exp())
                log = spread.log_prob(flat["action"][at]).sum(-1)
                ratio = (log - flat["log"][at]).exp()
                gain = torch.min(ratio * advantage[at], ratio.clamp(1 - args.clip, 1 + args.clip) * advantage[at])
                value = self.agent.critic(flat["features"][at])[:, 0]
                # The actor waits until the critic knows the taught policy.
                loss = 0.5 * (value - goal[at]).square().mean() - (0.0 if is_new else 1.0) * gain.mean()
                self.ppo.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(self.agent.parameters(), 0.5)
                self.ppo.step()
                with torch.no_grad():
                    self.agent.log_std.clamp_(math.log(0.02), math.log(0.3))
                if not is_new and (flat["log"][at] - log).mean() > 0.05:
                    return


def interval(done, count, z=1.96):
    """Wilson's interval of a share."""
    p = done / count
    middle, half = p + z * z / (2 * count), z * math.sqrt(p * (1 - p) / count + z * z / (4 * count * count))
    return [(middle - half) / (1 + z * z / count), (middle + half) / (1 + z * z / count)]


def evaluate(act, count, seed, threads=0, environment=ENVIRONMENT):
    """Share of the first `count` worlds of a seed in which a policy holds the fruit, and the damage that it does."""
    envs = make(count, threads, gymnasium.vector.AutoresetMode.DISABLED, environment)
    observation, _ = envs.reset(seed=seed)
    over, done, cost = np.zeros(count, bool), np.zeros(count, bool), np.zeros(count)
    while not over.all():
        action = act(observation)
        action[over] = 0
        observation, _, terminated, truncated, info = envs.step(action)
        again = terminated | truncated
        ended = again & ~over
        done[ended] = np.asarray(info["is_success"])[ended]
        cost[~over] += np.asarray(info["cost"])[~over]
        over |= ended
        if again.any():
            observation, _ = envs.reset(options={"reset_mask": again})
    envs.close()
    return {"seed": seed, "worlds": count, "success": done.mean(), "interval": interval(done.sum(), count), "cost": cost.mean()}


def export(trainer, scripts):
    """Writes the policy and its spec, which names the scripts, as `--controller onnx:FILE` takes them."""
    agent, folder, keys = trainer.agent.cpu().eval(), trainer.dir, trainer.keys
    envs = make(1, 1, environment=trainer.environment)
    space, interface = envs.single_observation_space, envs.unwrapped.interface
    envs.close()
    arrays = tuple(torch.zeros(1, *space[key].shape) for key in keys)
    torch.onnx.export(agent, arrays, folder / "policy.onnx", input_names=list(keys), output_names=["action"], dynamo=False)
    files = [pathlib.Path(__file__).with_name(name) for name in (*scripts, "reach_rule.py")]
    source = {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}
    (folder / "policy.json").write_text(json.dumps({**interface, "trained_by": source}, indent=1))


def options(text):
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", required=True)
    parser.add_argument("--envs", type=int, default=512)
    parser.add_argument("--threads", type=int, default=0, help="0: all cores")
    parser.add_argument("--teach-steps", type=int, default=900_000, help="steps in which the rule teaches")
    parser.add_argument("--fits", type=int, default=60, help="batches that are fitted after every 50 steps of it")
    parser.add_argument("--steps", type=int, default=3_000_000, help="steps of PPO")
    parser.add_argument("--horizon", type=int, default=64)
    parser.add_argument("--epochs", type=int, default=4)
    parser.add_argument("--batches", type=int, default=8)
    parser.add_argument("--rate", type=float, default=1e-4)
    parser.add_argument("--gamma", type=float, default=0.99)
    parser.add_argument("--gae", type=float, default=0.95)
    parser.add_argument("--clip", type=float, default=0.2)
    parser.add_argument("--warm-up", type=int, default=200_000, help="steps in which only the critic learns")
    parser.add_argument("--minutes", type=float, default=0, help="stops after so many minutes; the same command goes on")
    parser.add_argument("--evaluate", type=int, default=0, metavar="WORLDS", help="tests the trained policy, and the rule, instead of training")
    parser.add_argument("--test-seed", type=int, default=VALIDATION_SEED)
    return parser


def run(trainer, scripts=("ppo_reach.py",)):
    """Trains, or tests what was trained, as the arguments of the trainer ask."""
    args, agent = trainer.args, trainer.agent
    if args.evaluate:
        def act(observation):
            with torch.no_grad():
                return torch.clamp(agent.mean(trainer.features(observation)), -1, 1).cpu().numpy()

        tests = {"policy": act, "rule": rule}
        result = {name: evaluate(test, args.evaluate, args.test_seed, args.threads, trainer.environment) for name, test in tests.items()}
        (trainer.dir / f"result-{args.test_seed}.json").write_text(json.dumps(result, indent=1))
        print(json.dumps(result))
        return
    trainer.learn_from_rule()
    trainer.save()
    trainer.reinforce()
    trainer.save()
    export(trainer, scripts)


if __name__ == "__main__":
    sys.exit(run(Trainer(options(__doc__).parse_args())))
