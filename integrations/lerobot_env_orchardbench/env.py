"""EnvHub: put this file into a repository of the Hub, and ``lerobot.envs.factory.make_env("USER/REPO", trust_remote_code=True)`` makes the environments.

It needs the packages ``orchardbench`` and ``lerobot_env_orchardbench``."""

from lerobot_env_orchardbench import make_envs


def make_env(n_envs=1, use_async_envs=False, cfg=None):
    settings = {} if cfg is None or not hasattr(cfg, "gym_kwargs") else cfg.gym_kwargs
    return make_envs(n_envs, use_async_envs, **settings)
