"""OrchardBench as an environment of LeRobot: importing this package registers ``--env.type=orchardbench``."""

from lerobot_env_orchardbench.config import OrchardBenchEnv
from lerobot_env_orchardbench.env import LeRobotOrchard, make_envs

__all__ = ["LeRobotOrchard", "OrchardBenchEnv", "make_envs"]
