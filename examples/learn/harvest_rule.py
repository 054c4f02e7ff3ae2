"""A rule for `Harvest-v1` that teaches: it drives to a fruit, grips it, backs away with it, and lays it into the bucket.

It is told one place, where a fruit is thought to be, or that none is known; then it looks around while it drives around the tree. All else it
reads from what the robot measures. It keeps no memory, so that a network without memory can learn it: the stages of a pick are told by where the hand and the
base are. All figures are our own choices, tried on the worlds of seed 2,000,000.
"""

import numpy as np

from reach_rule import AT_HAND, BACK, CLOSE, GAIN, INWARD, LINE, PITCH, READY, TOOL_SPEED, TOOL_TURN_SPEED, TRAVEL, TRUNK, TUCK, TURN_GAIN
from reach_rule import drive, limited, polar, rotation

# The fingers hold something while their opening [m] is between these and they are pressed apart by so much [N].
EMPTY, FULL, PRESSED = 0.03, 0.0785, 10.0
# The base backs away from the trunk with a fruit to AWAY [m] at BACKING, and is there within NEARLY [m].
AWAY, BACKING, NEARLY = 1.45, 0.15, 0.05
# Shares of the base's largest speed, and largest speed itself [m/s].
BASE_SPEED = 1.1
# The hand backs, in the base's frame, to RETRACTED ahead of the shoulder at PULL [m, m/s].
SHOULDER, RETRACTED, PULL = np.array([0.15, 0.0]), 0.36, 0.10
# The hand swings to the bucket over the left side: around the shoulder at SWING_RADIUS and SWING_HEIGHT [m], towards the angle of the place [rad].
SWING_RADIUS, SWING_HEIGHT, SWING_SPEED = 0.45, 0.70, 0.45
# The place above the bucket's floor, base frame, and the heights at which the hand lets go and has left [m].
DEPOSIT, LET_GO, CLEAR = np.array([-0.24, 0.05]), 0.37, 0.56
# Without a known fruit: the base goes around the tree in this distance [m] and at this speed [m/s], the hand is held at this height [m].
LOOK_DISTANCE, LOOK_SPEED, LOOK_HEIGHT = 1.75, 0.25, 0.85


def smooth(x, low, high):
    return np.clip((x - low) / (high - low), 0, 1)


def harvest_rule(observation, place, known):
    """Actions (n, 10) of control `ee_delta`: observations of n environments, places of fruit (n, 3; odom), whether one is known (n)."""
    agent, base = observation["agent_pos"].astype(np.float64), observation["agent_pos"][:, 9:12].astype(np.float64)
    n, c, s = len(agent), np.cos(base[:, 2]), np.sin(base[:, 2])
    to_base = np.zeros((n, 3, 3))
    to_base[:, 0, 0], to_base[:, 0, 1], to_base[:, 1, 0], to_base[:, 1, 1], to_base[:, 2, 2] = c, s, -s, c, 1.0
    origin = np.concatenate([base[:, :2], np.zeros((n, 1))], 1)
    in_base = lambda v: np.einsum("nij,nj->ni", to_base, v)
    fruit, tool = in_base(place[:, :3] - origin), in_base(observation["tool_pose"][:, :3] - origin)
    trunk = in_base(np.concatenate([np.broadcast_to(TRUNK, (n, 2)) - base[:, :2], np.zeros((n, 1))], 1))[:, :2]
    hand = to_base @ rotation(observation["tool_pose"][:, 3:].astype(np.float64))
    fingers, force = agent[:, 7:9].sum(1), observation["forces"][:, 7:9].sum(1)
    holds = (fingers > EMPTY) & (fingers < FULL) & (force < -PRESSED)

    # The hand about the shoulder; angles run from the front over the left side to the bucket, and a little to the right.
    outward, around, _ = polar(tool[:, 0] - SHOULDER[0], tool[:, 1] - SHOULDER[1])
    radius = np.linalg.norm(tool[:, :2] - SHOULDER, axis=1)
    angle = np.arctan2(tool[:, 1], tool[:, 0] - SHOULDER[0])
    angle = np.where(angle < -0.5 * np.pi, angle + 2 * np.pi, angle)
    deposit_angle = np.arctan2(DEPOSIT[1], DEPOSIT[0] - SHOULDER[0])
    over_bucket = np.linalg.norm(tool[:, :2] - DEPOSIT, axis=1)

    # Towards the fruit, as in `Reach-v1`.
    ahead, across, bearing = polar(fruit[:, 0], fruit[:, 1])
    level = np.zeros((n, 1))
    approach = np.concatenate([ahead * np.cos(PITCH), level + np.sin(PITCH)], 1)
    way = fruit - tool
    along = (way * approach).sum(1)
    aside = np.linalg.norm(way - along[:, None] * approach, axis=1)
    distance = np.linalg.norm(way, axis=1)
    velocity, left_to_go = drive(base, place)
    velocity = np.einsum("nij,nj->ni", to_base[:, :2, :2], velocity)
    is_far = ((left_to_go > READY) | (np.abs(bearing) > 0.3)) & (distance > AT_HAND)
    closes = known & ((distance < CLOSE) | ((fingers < FULL) & (force < 0) & (distance < 0.05)))
    behind = fruit - (smooth(aside / LINE, 0.5, 1.5) * BACK)[:, None] * approach
    tucked = np.stack([TUCK * np.cos(0.5 * bearing), TUCK * np.sin(0.5 * bearing), np.clip(fruit[:, 2], 0.5, 1.3)], -1)
    move = limited(GAIN * (np.where(is_far[:, None], tucked, behind) - tool), np.where((along < BACK) & ~is_far, INWARD, TRAVEL)[:, None])
    move[closes] = 0
    pointing = approach.copy()
    turn_base = np.clip(1.5 * bearing, -1, 1) * is_far
    drives = velocity * is_far[:, None]

    # Looking around.
    away, past, _ = polar(-trunk[:, 0], -trunk[:, 1])
    far = np.linalg.norm(trunk, axis=1)
    facing = np.arctan2(trunk[:, 1], trunk[:, 0])
    looks = (~known & ~holds)[:, None]
    home = np.array([TUCK, 0.0, LOOK_HEIGHT])
    # The hand leaves the tree first, then the base, then it goes around.
    is_out = smooth(RETRACTED + 0.16 - radius, 0.0, 0.06)[:, None]
    around_tree = smooth(far, LOOK_DISTANCE - 0.15, LOOK_DISTANCE - 0.05)[:, None]
    patrol = is_out * limited((2.0 * (LOOK_DISTANCE - far))[:, None] * away + around_tree * LOOK_SPEED * past, 0.3) / BASE_SPEED
    leaving = limited(GAIN * (home - tool), TRAVEL) * is_out - (1 - is_out) * hand[:, :, 2] * 0.2
    forward = np.tile([np.cos(PITCH), 0.0, np.sin(PITCH)], (n, 1))
    move = np.where(looks, leaving, move)
    pointing = np.where(looks, np.where(is_out > 0.5, forward, hand[:, :, 2]), pointing)
    drives, turn_base = np.where(looks, patrol, drives), np.where(looks[:, 0], is_out[:, 0] * np.clip(1.5 * facing, -1, 1), turn_base)

    # Backwards with the fruit, then around the shoulder to the bucket.
    is_away = far > AWAY - NEARLY
    backs = (holds & (~is_away | (radius > RETRACTED + NEARLY)) & (np.abs(angle) < 0.8))[:, None]
    direction = hand[:, :, 2]
    left = np.clip(radius - RETRACTED, 0, 1)
    move = np.where(backs, -direction * np.minimum(GAIN * left, PULL)[:, None], move)
    pointing = np.where(backs, direction, pointing)
    drives = np.where(backs, away * (np.clip(2.0 * (AWAY - far), 0, BACKING) / BASE_SPEED)[:, None], drives)
    turn_base = np.where(backs[:, 0], 0.0, turn_base)

    swings = holds & ~backs[:, 0]
    returns = ~holds & (angle > 0.9)
    goal_angle = np.where(swings, deposit_angle, 0.0)
    turn_left = goal_angle - angle
    inwards = swings & (np.abs(turn_left) < 0.35)
    circle = around * limited((SWING_RADIUS * 3.0 * turn_left)[:, None], SWING_SPEED) + outward * np.clip(3.0 * (SWING_RADIUS - radius), -0.3, 0.3)[:, None]
    straight = limited(GAIN * (DEPOSIT - tool[:, :2]), 0.3)
    flat = np.where(inwards[:, None], straight, circle)
    low = np.where(inwards & (over_bucket < 0.06), LET_GO - 0.02, SWING_HEIGHT)
    in_bucket = (over_bucket < 0.2) & (tool[:, 2] < CLEAR)
    climbs = returns & in_bucket
    flat[climbs] = 0
    swing = np.concatenate([flat, np.clip(3.0 * (low - tool[:, 2]), -0.35, 0.35)[:, None]], 1)
    moves = (swings | returns)[:, None]
    move = np.where(moves, swing, move)
    # The hand turns down on its way, and up again.
    down = 0.5 * np.pi * smooth(angle, 0.7, 1.9)
    swung = np.concatenate([outward * np.cos(down)[:, None], -np.sin(down)[:, None]], 1)
    pointing = np.where(moves, swung, pointing)
    drives[swings], turn_base[swings] = 0.0, 0.0
    lets_go = swings & (over_bucket < 0.08) & (tool[:, 2] < LET_GO)
    closes = (holds & ~lets_go) | (closes & ~returns)

    # The hand points as it should, the fingers level, whichever is up.
    y = np.cross(np.array([0.0, 0.0, 1.0]), pointing)
    y = np.where(np.linalg.norm(y, axis=1, keepdims=True) < 0.15, np.concatenate([around, level], 1), y)
    y = np.where(moves, np.concatenate([around, level], 1), y)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    y *= np.where((hand[:, :, 1] * y).sum(1) < 0, -1, 1)[:, None]
    goal = np.stack([np.cross(y, pointing), y, pointing], -1)
    off = goal @ np.swapaxes(hand, 1, 2)
    turn = 0.5 * TURN_GAIN * np.stack([off[:, 2, 1] - off[:, 1, 2], off[:, 0, 2] - off[:, 2, 0], off[:, 1, 0] - off[:, 0, 1]], -1)
    still = closes & ~holds
    move[still], turn[still] = 0, 0
    drives[still], turn_base[still] = 0, 0

    action = np.concatenate([move / TOOL_SPEED, turn / TOOL_TURN_SPEED, drives, turn_base[:, None], np.where(closes, -1.0, 1.0)[:, None]], 1)
    return np.clip(action, -1, 1).astype(np.float32)
