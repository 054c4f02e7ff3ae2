"""A rule for `Reach-v1` that teaches: it drives to the named fruit, puts the hand around it and closes it.

It reads what the robot measures, the named place, and one thing that holds for the benchmark's worlds: robots start some 2.4 m in front of the trunk. It
keeps no memory, so that a network without memory can learn it. All figures are our own choices, tried on the worlds of seed 2,000,000.
"""

import numpy as np

# Trunk ahead of the robot's start [m].
TRUNK = np.array([2.4, 0.0])
# The base stands STAND farther from the trunk than the fruit, and at least NEAREST from the trunk. It has arrived within READY of that place [m].
STAND, NEAREST, READY = 0.66, 0.85, 0.06
# The way around the tree is longer by OUT [m].
OUT = 0.5
# The hand comes from behind, BACK away, within LINE of the line of approach, which rises by PITCH; near the fruit it moves at INWARD [m, rad, m/s].
BACK, LINE, PITCH, INWARD, TRAVEL = 0.15, 0.02, 0.17, 0.12, 0.5
# While the base drives, the hand is TUCK ahead of its middle [m].
TUCK = 0.38
# The fingers close within CLOSE of the fruit's centre, and stay closed within HELD of it while less open than SHUT [m].
CLOSE, HELD, SHUT = 0.012, 0.05, 0.072
# The hand goes on within AT_HAND [m] even if the base was pushed away.
AT_HAND = 0.3
# Gains [1/s].
GAIN, TURN_GAIN, DRIVE_GAIN = 3.0, 2.0, 2.0
# Action 1 of the hand [m/s, rad/s] (configs/policy/v1.toml).
TOOL_SPEED, TOOL_TURN_SPEED = 0.5, 1.5


def rotation(q):
    """Matrices (n, 3, 3) of unit quaternions (n, 4: x, y, z, w)."""
    x, y, z, w = np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def polar(x, y):
    """Unit vectors (n, 2) away from the origin and across, and the angle."""
    angle = np.arctan2(y, x)
    return np.stack([np.cos(angle), np.sin(angle)], -1), np.stack([-np.sin(angle), np.cos(angle)], -1), angle


def limited(v, largest):
    """Vectors no longer than `largest`."""
    size = np.linalg.norm(v, axis=-1, keepdims=True)
    return v * np.minimum(1.0, largest / np.maximum(size, 1e-9))


def drive(base, fruit):
    """Velocity of the base (n, 2) in odom, as a share of the largest, and the way (n) that is left."""
    f, b = fruit[:, :2] - TRUNK, base[:, :2] - TRUNK
    # A fruit at the trunk is approached from the robot's side.
    outward, across, angle = polar(f[:, 0] - 0.1, f[:, 1])
    away, around, now = polar(b[:, 0], b[:, 1])
    stand = np.maximum((f * outward).sum(1) + STAND, NEAREST)
    place = outward * stand[:, None] + across * (f * across).sum(1)[:, None]
    turn = (angle - now + np.pi) % (2 * np.pi) - np.pi
    distance = np.hypot(b[:, 0], b[:, 1])
    wide = stand + OUT * np.clip(np.abs(turn) / 0.6, 0, 1)
    circle = around * np.clip(DRIVE_GAIN * turn * distance, -1, 1)[:, None] + away * np.clip(DRIVE_GAIN * (wide - distance), -1, 1)[:, None]
    straight = limited(DRIVE_GAIN * (place - b), 1.0)
    share = np.clip((np.abs(turn) - 0.1) / 0.3, 0, 1)[:, None]
    return limited(share * circle + (1 - share) * straight, 1.0), np.linalg.norm(place - b, axis=1)


def rule(observation):
    """Actions (n, 10) of control `ee_delta` for observations of n environments."""
    agent, base = observation["agent_pos"].astype(np.float64), observation["agent_pos"][:, 9:12].astype(np.float64)
    n, c, s = len(agent), np.cos(base[:, 2]), np.sin(base[:, 2])
    to_base = np.zeros((n, 3, 3))
    to_base[:, 0, 0], to_base[:, 0, 1], to_base[:, 1, 0], to_base[:, 1, 1], to_base[:, 2, 2] = c, s, -s, c, 1.0
    origin = np.concatenate([base[:, :2], np.zeros((n, 1))], 1)
    fruit = np.einsum("nij,nj->ni", to_base, observation["target"][:, :3] - origin)
    tool = np.einsum("nij,nj->ni", to_base, observation["tool_pose"][:, :3] - origin)
    hand = to_base @ rotation(observation["tool_pose"][:, 3:].astype(np.float64))

    velocity, left_to_go = drive(base, observation["target"])
    velocity = np.einsum("nij,nj->ni", to_base[:, :2, :2], velocity)
    ahead, across, bearing = polar(fruit[:, 0], fruit[:, 1])
    level = np.zeros((n, 1))
    approach = np.concatenate([ahead * np.cos(PITCH), level + np.sin(PITCH)], 1)
    way = fruit - tool
    along = (way * approach).sum(1)
    aside = np.linalg.norm(way - along[:, None] * approach, axis=1)
    distance = np.linalg.norm(way, axis=1)
    is_far = ((left_to_go > READY) | (np.abs(bearing) > 0.3)) & (distance > AT_HAND)
    fingers, force = agent[:, 7:9].sum(1), observation["forces"][:, 7:9].sum(1)
    grips = (distance < CLOSE) | ((fingers < SHUT) & (force < 0) & (distance < HELD))

    behind = fruit - (np.clip(aside / LINE - 0.5, 0, 1) * BACK)[:, None] * approach
    tucked = np.stack([TUCK * np.cos(0.5 * bearing), TUCK * np.sin(0.5 * bearing), np.clip(fruit[:, 2], 0.5, 1.3)], -1)
    move = GAIN * (np.where(is_far[:, None], tucked, behind) - tool)
    move = limited(move, np.where((along < BACK) & ~is_far, INWARD, TRAVEL)[:, None])
    # The hand points along the approach, the fingers level, whichever is up.
    y = np.concatenate([across, level], 1)
    y *= np.where((hand[:, :, 1] * y).sum(1) < 0, -1, 1)[:, None]
    goal = np.stack([np.cross(y, approach), y, approach], -1)
    off = goal @ np.swapaxes(hand, 1, 2)
    turn = 0.5 * TURN_GAIN * np.stack([off[:, 2, 1] - off[:, 1, 2], off[:, 0, 2] - off[:, 2, 0], off[:, 1, 0] - off[:, 0, 1]], -1)

    action = np.zeros((n, 10))
    action[:, :3], action[:, 3:6] = move / TOOL_SPEED, turn / TOOL_TURN_SPEED
    action[:, :6][grips] = 0
    drives = (is_far & ~grips)[:, None]
    action[:, 6:8] = drives * velocity
    action[:, 8] = drives[:, 0] * np.clip(1.5 * bearing, -1, 1)
    action[:, 9] = np.where(grips, -1, 1)
    return np.clip(action, -1, 1).astype(np.float32)
