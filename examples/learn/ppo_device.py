"""PPO on `Reach-v1` with thousands of worlds on a graphics device, from state, or from state and depth images of 64 x 64 pixels.

As in `ppo_reach.py`, whose networks and loops these are, a rule teaches first and PPO goes on. The worlds move on the device (`backend="gpu"`), and depth
images stay there: the network reads them where they were drawn. The test runs on the processor in float64, as the benchmark does.

    pip install 'orchardbench[torch]'
    python ppo_device.py --seed 1 --out runs/1 --minutes 9                # from state
    python ppo_device.py --depth --seed 1 --out runs/d1 --minutes 9       # from state and depth
    python ppo_device.py --depth --seed 1 --out runs/d1 --evaluate 512 --test-seed 1000000

Without a card of NVIDIA tensors go through the processor's memory, and any graphics device does.
"""

import pathlib
import sys

import gymnasium
import torch
from torch import nn

from orchardbench import OrchardVectorEnv

from ppo_reach import ENVIRONMENT, KEYS, Agent, Features, Trainer, net, options, run

# Camera of the depth images: the benchmark's with SIDE x SIDE pixels; NEAR is its least depth [m], CODE the size of what the eye makes of an image.
CAMERA, SIDE, NEAR, CODE = pathlib.Path(__file__).with_name("camera-64.toml"), 64, 0.3, 64


class CardEnvs:
    """Environments on a graphics device: numbers and ends as arrays of numpy, depth images as tensors where they were drawn."""

    def __init__(self, envs, device, environment):
        mode = gymnasium.vector.AutoresetMode.SAME_STEP
        self.envs = OrchardVectorEnv("Reach-v1", envs, mode, copy=False, tensors="torch", device=device, backend="gpu", **environment)
        self.single_observation_space, self.single_action_space = self.envs.single_observation_space, self.envs.single_action_space

    @staticmethod
    def told(observation):
        return {key: value if key == "depth" else value.cpu().numpy() for key, value in observation.items()}

    def reset(self, seed):
        observation, info = self.envs.reset(seed=seed)
        return self.told(observation), info

    def step(self, actions):
        observation, *ends, info = self.envs.step(actions)
        for last in info.get("final_obs", ()):
            if last is not None:
                last.update({key: value.cpu().numpy() for key, value in last.items()})
        return self.told(observation), *(values.cpu().numpy() for values in ends), info


class SeeingFeatures(nn.Module):
    """The features of the state, and behind them the depth image as nearness: 1 at the camera's least depth, 0 far away or not measured."""

    def __init__(self):
        super().__init__()
        self.state = Features()

    def forward(self, *observation):
        *state, depth = observation
        nearness = torch.where(depth > 0, NEAR / torch.clamp(depth, min=NEAR), torch.zeros_like(depth))
        return torch.cat([self.state(*state), nearness.flatten(1)], -1)


class Seeing(nn.Module):
    """A dense network over the state's features and what an eye of its own makes of the image."""

    def __init__(self, inputs, outputs, gain):
        super().__init__()
        self.state = inputs - SIDE * SIDE
        self.eye = nn.Sequential(
            nn.Conv2d(1, 16, 5, 2, 2), nn.ReLU(), nn.Conv2d(16, 32, 3, 2, 1), nn.ReLU(), nn.Conv2d(32, 32, 3, 2, 1), nn.ReLU(), nn.Conv2d(32, 32, 3, 2, 1), nn.ReLU(),
            nn.Flatten(), nn.Linear(32 * (SIDE // 16) ** 2, CODE), nn.LayerNorm(CODE), nn.Tanh(),
        )
        self.dense = net(self.state + CODE, outputs, gain)

    def forward(self, features):
        code = self.eye(features[:, self.state :].reshape(-1, 1, SIDE, SIDE))
        return self.dense(torch.cat([features[:, : self.state], code], -1))


class DeviceTrainer(Trainer):
    def __init__(self, args):
        if args.depth:
            self.keys = (*KEYS, "depth")
            self.environment = ENVIRONMENT | {"obs": ("state", "depth"), "camera": str(CAMERA)}
        if args.trees is not None:
            self.environment = getattr(self, "environment", ENVIRONMENT) | {"trees": args.trees}
        super().__init__(args)

    def make_envs(self):
        return CardEnvs(self.args.envs, "cuda" if torch.cuda.is_available() else "cpu", self.environment)

    def make_agent(self, observation, actions):
        if not self.args.depth:
            return Agent(observation, actions)
        return Agent(observation, actions, self.keys, SeeingFeatures, Seeing)


def main():
    parser = options(__doc__)
    parser.add_argument("--depth", action="store_true", help="sees the depth image, too")
    parser.add_argument("--trees", type=int, help="number of trees that are grown once and kept, so that resets cost little (default: every episode has a new one)")
    # Four times as many worlds as there are rounds of teaching would leave too few rounds.
    parser.set_defaults(envs=4096, teach_steps=2_000_000, fits=200, steps=100_000_000, horizon=32, warm_up=1_000_000)
    return run(DeviceTrainer(parser.parse_args()), ("ppo_device.py", "ppo_reach.py"))


if __name__ == "__main__":
    sys.exit(main())
