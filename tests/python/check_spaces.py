"""Spaces, pictures, conventions and text of the environments."""

import json
import pathlib
import tempfile
import warnings

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env

from checks import raises, same
from environments import GENTLE, HARVEST, REACH, SEED, actions, single, vector


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
