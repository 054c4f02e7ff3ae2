"""A clone that harvests by its depth camera: `Harvest-v1`, learned from a rule that is told where the next fruit is.

The policy has three parts. The eye, a convolutional network, says which place of the depth image shows the fruit to pick next, if any does, and
where its centre is. A memory of a few numbers, the recurrent state of the ONNX file, keeps that place in odom while the camera is too near or turned away. The
hand, a dense network, moves the robot by what it measures and by the remembered place. Hand and eye are cloned at the states that the policy itself comes
to (DAgger, Ross, Gordon and Bagnell 2011): the hand from `harvest_rule`, which is told the remembered place, the eye from the truth. The policy itself sees no truth.

    pip install 'orchardbench[torch]'
    python clone_harvest.py --seed 1 --out runs/1            # trains; the same command goes on after a break
    python clone_harvest.py --seed 1 --out runs/1 --evaluate 128

DIR/curve.jsonl has the learning curve, DIR/policy.onnx and DIR/policy.json the policy for `--controller onnx:DIR/policy.onnx`.
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

from harvest_rule import AWAY, DEPOSIT, EMPTY, FULL, LET_GO, PRESSED, SHOULDER, harvest_rule
from ppo_reach import Features, interval, layer
from reach_rule import TRUNK

TASK = "orchardbench/Harvest-v1"
ENVIRONMENT = {"control": "ee_delta", "control_hz": 10}
KEYS = ("agent_pos", "agent_vel", "forces", "tool_pose", "depth", "depth_valid", "depth_time")
# Seeds of training; those of the final test are never used before it.
TRAINING_SEED, VALIDATION_SEED, TEST_SEED = 4_000_000, 2_000_000, 5_000_000
# The camera: rows, columns, vertical field of view, its place in the frame of the tool [m] and its turn towards the approach axis.
ROWS, COLUMNS, FIELD = 144, 192, math.radians(75)
EYE, TOE_IN = (0.085, 0.0, -0.04 - 0.1034), math.radians(6.0)
FOCAL = 0.5 * ROWS / math.tan(0.5 * FIELD)
# Pixels of a cell of the eye's map; depths beyond FAR [m] are not looked at.
CELL, FAR = 4, 2.5
# A place is taken from an image if the eye is so sure, MERGED into one within SAME [m] if it is less sure; another one replaces it if the eye is surer still
# and did not see it for STALE seconds; it is forgotten after FORGOTTEN.
SURE, MERGED, SURER, SAME, STALE, FORGOTTEN, WEIGHT = 0.5, 0.15, 0.7, 0.12, 1.0, 6.0, 0.5
# Seconds of an action, and number of past poses of the tool that are kept for images that come late.
STEP, POSES = 0.1, 3
# Share of the environments whose memory is told the truth that are told of no fruit.
BLIND = 0.15
# The remembered state: place, whether it is known, its age, then the poses.
STATE = 5 + 7 * POSES
NOWHERE = (float(TRUNK[0]), float(TRUNK[1]), 0.85)


def cross(a, b):
    ax, ay, az, bx, by, bz = (p[..., k : k + 1] for p in (a, b) for k in range(3))
    return torch.cat([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)


def rotated(q, v):
    """Vectors turned by unit quaternions (x, y, z, w)."""
    u, w = q[..., :3], q[..., 3:4]
    t = 2 * cross(u, v)
    return v + w * t + cross(u, t)


def odom_from_camera(tool, p):
    """Points of the optical frame (x right, y down, z forward) in odom, for poses of the tool (n, 7)."""
    s, c = math.sin(TOE_IN), math.cos(TOE_IN)
    x, y, z = p[..., 0:1], p[..., 1:2], p[..., 2:3]
    in_tool = torch.cat([-c * y - s * z + EYE[0], x + EYE[1], -s * y + c * z + EYE[2]], -1)
    return rotated(tool[..., 3:7], in_tool) + tool[..., :3]


def camera_from_odom(tool, p):
    """The inverse of `odom_from_camera`."""
    s, c = math.sin(TOE_IN), math.cos(TOE_IN)
    back = torch.cat([-tool[..., 3:6], tool[..., 6:7]], -1)
    v = rotated(back, p - tool[..., :3])
    x, y, z = v[..., 0:1] - EYE[0], v[..., 1:2] - EYE[1], v[..., 2:3] - EYE[2]
    return torch.cat([y, -c * x - s * z, -s * x + c * z], -1)


def holds(agent_pos, forces):
    """1 where the fingers hold something, (n, 1)."""
    opening, force = agent_pos[..., 7:8] + agent_pos[..., 8:9], forces[..., 7:8] + forces[..., 8:9]
    return ((opening > EMPTY) & (opening < FULL) & (force < -PRESSED)).float()


class Eye(nn.Module):
    """Depth images to logits of cells, the last one for no fruit, and corrections of the fruit's centre in every cell."""

    def __init__(self):
        super().__init__()

        def conv(inputs, outputs, size, stride=1):
            return nn.Sequential(nn.Conv2d(inputs, outputs, size, stride, size // 2), nn.BatchNorm2d(outputs), nn.ReLU())

        self.fine = nn.Sequential(conv(3, 12, 5, 2), conv(12, 24, 3, 2), conv(24, 24, 3))
        self.coarse = nn.Sequential(conv(26, 40, 3, 2), conv(40, 40, 3), conv(40, 40, 3, 2), conv(40, 40, 3))
        self.both = conv(64, 32, 3)
        self.out = nn.Conv2d(32, 4, 1)
        self.none = nn.Linear(40, 1)
        v, u = torch.meshgrid(torch.linspace(-1, 1, ROWS // CELL), torch.linspace(-1, 1, COLUMNS // CELL), indexing="ij")
        self.register_buffer("place", torch.stack([u, v])[None], persistent=False)

    def forward(self, depth):
        """`depth` (n, 1, rows, columns) in metres, 0 where nothing was measured: logits (n, cells + 1), corrections (n, 3, cells)."""
        seen = (depth > 0).float() * (depth < FAR).float()
        inputs = torch.cat([seen, seen * depth * (1.0 / FAR), seen * 0.3 / torch.clamp(depth, min=0.3)], 1)
        fine = self.fine(inputs)
        coarse = self.coarse(torch.cat([fine, self.place.expand(fine.shape[0], -1, -1, -1)], 1))
        wide = nn.functional.interpolate(coarse, size=(ROWS // CELL, COLUMNS // CELL), mode="nearest")
        out = self.out(self.both(torch.cat([fine, wide], 1))).flatten(2)
        none = self.none(coarse.mean((2, 3)))
        return torch.cat([out[:, 0], none], 1), out[:, 1:4]


def cells(depth):
    """Depth in the middle of every cell, (n, cells), 1 m where there is none."""
    middle = depth[:, 0, CELL // 2 :: CELL, CELL // 2 :: CELL].flatten(1)
    return torch.where((middle > 0) & (middle < FAR), middle, torch.ones_like(middle))


def rays():
    """Slopes of the rays through the middles of the cells, (2, cells)."""
    v, u = torch.meshgrid(torch.arange(CELL // 2, ROWS, CELL) + 0.5, torch.arange(CELL // 2, COLUMNS, CELL) + 0.5, indexing="ij")
    return torch.stack([(u - 0.5 * COLUMNS) / FOCAL, (v - 0.5 * ROWS) / FOCAL]).flatten(1).float()


class Policy(nn.Module):
    """Eye, memory and hand."""

    def __init__(self, width=512):
        super().__init__()
        self.eye, self.features = Eye(), Features()
        self.register_buffer("rays", rays(), persistent=False)
        shapes = (13, 10, 9, 7, STATE)
        size = self.inputs(*(torch.zeros(1, size) for size in shapes)).shape[-1]
        self.hand = nn.Sequential(
            layer(size, width), nn.LayerNorm(width), nn.SiLU(), layer(width, width), nn.LayerNorm(width), nn.SiLU(),
            layer(width, width), nn.SiLU(), layer(width, 10, 0.01),
        )

    def look(self, depth):
        """The best cell's centre of a fruit in the optical frame (n, 3), and how sure the eye is of it (n, 1)."""
        logits, correction = self.eye(depth)
        chance = torch.softmax(logits, 1)[:, :-1]
        best = chance.argmax(1, keepdim=True)
        z = cells(depth).gather(1, best) + correction[:, 2].gather(1, best)
        slope = [self.rays[k : k + 1].expand(depth.shape[0], -1).gather(1, best) + correction[:, k].gather(1, best) for k in range(2)]
        return torch.cat([slope[0] * z, slope[1] * z, z], 1), chance.gather(1, best)

    def remember(self, agent_pos, forces, tool_pose, depth, depth_time, state):
        """The state after an observation."""
        poses = torch.cat([tool_pose, state[:, 5:-7]], 1)
        # The pose when the image was taken, between those of the last actions.
        age = (depth_time[:, 1:2] - depth_time[:, 0:1]) / STEP
        share = [torch.clamp(1 - torch.abs(age - k), min=0.0) for k in range(POSES)]
        tool = sum(share[k] * poses[:, 7 * k : 7 * k + 7] for k in range(POSES))
        in_time = ((sum(share) > 0.999) & (depth_time[:, 0:1] >= 0)).float()
        p_camera, chance = self.look(depth)
        chance = chance * in_time
        p = odom_from_camera(tool, p_camera)
        place, known, old = state[:, 0:3], state[:, 3:4], state[:, 4:5] + STEP
        near = (torch.sqrt(((p - place) * (p - place)).sum(1, keepdim=True)) < SAME).float()
        merges = known * near * (chance > MERGED).float()
        is_new = (1 - merges) * torch.clamp((1 - known) * (chance > SURE).float() + (chance > SURER).float() * (old > STALE).float(), max=1.0)
        place = place + (WEIGHT * merges + is_new) * (p - place)
        sees = torch.clamp(merges + is_new, max=1.0)
        old = old * (1 - sees)
        free = 1 - holds(agent_pos, forces)
        known = torch.clamp(known + sees, max=1.0) * (old < FORGOTTEN).float() * free
        nowhere = torch.tensor(NOWHERE, device=place.device)
        return torch.cat([known * place + (1 - known) * nowhere, known, known * old, poses], 1)

    def inputs(self, agent_pos, agent_vel, forces, tool_pose, state):
        """What the hand is given: places and directions about the remembered fruit, the shoulder, the bucket and the trunk."""
        place, known = state[:, 0:3], state[:, 3:4]
        target = torch.cat([place, torch.full_like(known, 0.0375)], 1)
        x, y, yaw = agent_pos[:, 9:10], agent_pos[:, 10:11], agent_pos[:, 11:12]
        c, s = torch.cos(yaw), torch.sin(yaw)

        def in_base(vx, vy):
            return c * vx + s * vy, c * vy - s * vx

        tx, ty = in_base(tool_pose[:, 0:1] - x, tool_pose[:, 1:2] - y)
        sx = tx - float(SHOULDER[0])
        radius = torch.sqrt(sx * sx + ty * ty + 1e-6)
        kx, ky = in_base(float(TRUNK[0]) - x, float(TRUNK[1]) - y)
        trunk = torch.sqrt(kx * kx + ky * ky + 1e-6)
        over = torch.sqrt((tx - float(DEPOSIT[0])) ** 2 + (ty - float(DEPOSIT[1])) ** 2 + 1e-6)
        qx, qy, qz, qw = (tool_pose[:, k : k + 1] for k in range(3, 7))
        down = 1 - 2 * (qx * qx + qy * qy)
        height = tool_pose[:, 2:3]
        opening, force = agent_pos[:, 7:8] + agent_pos[:, 8:9], forces[:, 7:8] + forces[:, 8:9]
        held = holds(agent_pos, forces)
        own = torch.cat([
            known, held, sx / radius, ty / radius, radius, kx / trunk, ky / trunk, trunk - AWAY, torch.tanh((trunk - AWAY) / 0.1), down,
            tx - float(DEPOSIT[0]), ty - float(DEPOSIT[1]), torch.tanh(over / 0.1), torch.tanh((height - LET_GO) / 0.05), torch.tanh((radius - 0.4) / 0.1),
            torch.tanh((opening - FULL) / 0.002), torch.tanh((opening - EMPTY) / 0.01), torch.tanh(force / 50.0),
        ], -1)
        return torch.cat([self.features(agent_pos, agent_vel, forces, tool_pose, target), own, held * own], -1)

    def act(self, agent_pos, agent_vel, forces, tool_pose, state):
        return torch.clamp(self.hand(self.inputs(agent_pos, agent_vel, forces, tool_pose, state)), -1.0, 1.0)

    def forward(self, agent_pos, agent_vel, forces, tool_pose, depth, depth_valid, depth_time, state_in):
        state = self.remember(agent_pos, forces, tool_pose, (depth * depth_valid)[:, None], depth_time, state_in)
        return self.act(agent_pos, agent_vel, forces, tool_pose, state), state


def make(envs, threads, privileged, mode):
    return gymnasium.make_vec(TASK, num_envs=envs, vectorization_mode="vector_entry_point", autoreset_mode=mode, threads=threads,
                              obs=("state", "depth"), privileged=privileged, **ENVIRONMENT)


class Ring:
    """The last `size` rows of several arrays."""

    def __init__(self, size, device, **shapes):
        self.size, self.count, self.at = size, 0, 0
        self.rows = {name: torch.zeros(size, *shape, dtype=kind, device=device) for name, (shape, kind) in shapes.items()}

    def add(self, **parts):
        n = len(next(iter(parts.values())))
        where = (self.at + torch.arange(n, device=next(iter(self.rows.values())).device)) % self.size
        for name, part in parts.items():
            self.rows[name][where] = part.to(self.rows[name].dtype)
        self.at, self.count = (self.at + n) % self.size, min(self.count + n, self.size)

    def draw(self, n):
        device = next(iter(self.rows.values())).device
        at = torch.randint(self.count, (n,), device=device)
        return {name: rows[at] for name, rows in self.rows.items()}


SMALL = (13, 10, 9, 7)


class Trainer:
    def __init__(self, args):
        self.args, self.device = args, torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.dir = pathlib.Path(args.out)
        self.dir.mkdir(parents=True, exist_ok=True)
        torch.manual_seed(args.seed)
        self.rng = np.random.default_rng(args.seed)
        self.policy = Policy().to(self.device)
        self.optimiser = torch.optim.AdamW(self.policy.parameters(), lr=args.rate, weight_decay=1e-4)
        self.steps, self.resets, self.began = 0, 0, time.time()
        file = self.dir / "checkpoint.pt"
        if file.exists():
            kept = torch.load(file, map_location=self.device, weights_only=True)
            self.policy.load_state_dict(kept["policy"])
            self.optimiser.load_state_dict(kept["optimiser"])
            self.steps, self.resets = kept["steps"], kept["resets"]
            print(f"goes on at {self.steps} steps")

    def save(self):
        kept = {"policy": self.policy.state_dict(), "optimiser": self.optimiser.state_dict(), "steps": self.steps, "resets": self.resets}
        torch.save(kept, self.dir / "checkpoint.tmp")
        os.replace(self.dir / "checkpoint.tmp", self.dir / "checkpoint.pt")

    def note(self, **what):
        what = {"steps": self.steps, "seconds": round(time.time() - self.began, 1), **what}
        with open(self.dir / "curve.jsonl", "a") as file:
            file.write(json.dumps(what) + "\n")
        print(what, flush=True)

    def tensors(self, observation):
        arrays = {key: torch.as_tensor(observation[key], device=self.device).float() for key in KEYS if key != "depth_valid"}
        arrays["depth"] = (arrays["depth"] * torch.as_tensor(observation["depth_valid"], device=self.device))[:, None]
        return arrays

    def is_over(self):
        return self.args.minutes and time.time() - self.began > 60 * self.args.minutes

    def clone(self):
        """DAgger. In some environments the memory is told the truth, so that all stages of a pick are seen while the eye is still blind."""
        args, n = self.args, self.args.envs
        envs = make(n, args.threads, True, gymnasium.vector.AutoresetMode.SAME_STEP)
        observation, _ = envs.reset(seed=TRAINING_SEED + 1000 * args.seed + self.resets)
        self.resets += 1
        hands = Ring(args.states, self.device, small=((sum(SMALL) + STATE,), torch.float32), label=((10,), torch.float16))
        eyes = Ring(args.images, self.device, depth=((1, ROWS, COLUMNS), torch.float16), cell=((), torch.int64), p=((3,), torch.float32))
        state, ends = torch.zeros(n, STATE, device=self.device), {"deposited": 0.0, "dropped": 0.0, "episodes": 0}
        told, blind, own = torch.zeros(n, 1, device=self.device), torch.zeros(n, 1, device=self.device), slice(n - max(n // 8, 1), n)
        error = torch.zeros(n, 3, device=self.device)
        losses, last, again = [0.0, 0.0, 0.0], self.steps, True
        while self.steps < args.steps and not self.is_over():
            share = max(0.1, 0.9 - 1.2 * self.steps / args.steps)
            if again or self.steps % (n * 100) == 0:
                again = False
                # The last eighth of the environments is the policy's own: its harvest is the curve. Some are told that no fruit is known.
                told = (torch.rand(n, 1, device=self.device) < share).float()
                blind = (torch.rand(n, 1, device=self.device) < BLIND).float()
                leads = self.rng.random(n) < share
                told[own], leads[own] = 0, False
            o = self.tensors(observation)
            truth = torch.as_tensor(observation["privileged"], device=self.device).float()
            self.policy.eval()
            with torch.no_grad():
                state = self.policy.remember(o["agent_pos"], o["forces"], o["tool_pose"], o["depth"], o["depth_time"], state)
                free = 1 - holds(o["agent_pos"], o["forces"])
                right = torch.cat([truth[:, :3] + error, free * (1 - blind) * (truth[:, 3:4] > 0), torch.zeros_like(free), state[:, 5:]], 1)
                state = torch.where(told > 0, right, state)
                action = self.policy.act(*(o[key] for key in KEYS[:4]), state).cpu().numpy()
            self.keep_image(eyes, o, truth)
            known = state[:, :4].cpu().numpy().astype(np.float64)
            label = harvest_rule(observation, known[:, :3], known[:, 3] > 0)
            small = torch.cat([*(o[key] for key in KEYS[:4]), state], 1)
            hands.add(small=small, label=torch.as_tensor(label, device=self.device))
            given = np.where(leads[:, None], label, action)
            observation, _, terminated, truncated, info = envs.step(given.astype(np.float32))
            ended = terminated | truncated
            if ended.any():
                at = np.flatnonzero(ended)
                state[torch.as_tensor(at, device=self.device)] = 0
                error[torch.as_tensor(at, device=self.device)] = 0.004 * torch.randn(len(at), 3, device=self.device)
                figures = info["final_info"]["statistics"]
                for k in at[at >= own.start]:
                    ends["deposited"] += float(figures["deposited"][k])
                    ends["dropped"] += float(figures["fruit_dropped"][k])
                    ends["episodes"] += 1
            self.steps += n
            if self.steps % (n * args.horizon) == 0:
                losses = self.fit(hands, eyes, args.fits)
                if self.steps - last >= args.note:
                    last = self.steps
                    count = max(ends["episodes"], 1)
                    self.note(share=share, hand=losses[0], eye=losses[1], sees=losses[2], episodes=ends["episodes"],
                              deposited=ends["deposited"] / count, dropped=ends["dropped"] / count)
                    ends = {"deposited": 0.0, "dropped": 0.0, "episodes": 0}
        if self.steps >= args.steps:
            for group in self.optimiser.param_groups:
                group["lr"] = 0.2 * args.rate
            losses = self.fit(hands, eyes, args.fits * 30)
            self.note(stage="ended", hand=losses[0], eye=losses[1], sees=losses[2])
        envs.close()

    def keep_image(self, eyes, o, truth):
        """Keeps images that were taken just now, each with the cell and the centre of the nearest fruit to pick, or with none if it is not seen."""
        fresh = (o["depth_time"][:, 0] > o["depth_time"][:, 1] - 1e-3) & (torch.rand(len(truth), device=self.device) < self.args.kept)
        at = fresh.nonzero()[:, 0]
        if len(at) == 0:
            return
        p = camera_from_odom(o["tool_pose"][at], truth[at, :3])
        z = p[:, 2].clamp(min=1e-3)
        u, v = 0.5 * COLUMNS + FOCAL * p[:, 0] / z, 0.5 * ROWS + FOCAL * p[:, 1] / z
        column, row = u.long().clamp(0, COLUMNS - 1), v.long().clamp(0, ROWS - 1)
        seen = o["depth"][at, 0, row, column]
        inside = (u > 0) & (u < COLUMNS) & (v > 0) & (v < ROWS) & (z < FAR) & (p[:, 2] > 0.2)
        shows = inside & (seen > z - 0.07) & (seen < z) & (truth[at, 3] > 0)
        cell = (row // CELL) * (COLUMNS // CELL) + column // CELL
        none = torch.full_like(cell, (ROWS // CELL) * (COLUMNS // CELL))
        eyes.add(depth=o["depth"][at], cell=torch.where(shows, cell, none), p=p)

    def fit(self, hands, eyes, count):
        args, totals = self.args, [0.0, 0.0, 0.0]
        self.policy.train()
        none = (ROWS // CELL) * (COLUMNS // CELL)
        for _ in range(count):
            batch = hands.draw(args.batch)
            parts = torch.split(batch["small"], [*SMALL, STATE], 1)
            hand = nn.functional.smooth_l1_loss(self.policy.hand(self.policy.inputs(*parts)), batch["label"].float(), beta=0.1)
            images = eyes.draw(args.image_batch)
            depth = images["depth"].float()
            # Left and right are the same to the eye.
            if torch.rand(()) < 0.5:
                depth = depth.flip(3)
                row, column = images["cell"] // (COLUMNS // CELL), images["cell"] % (COLUMNS // CELL)
                mirrored = row * (COLUMNS // CELL) + COLUMNS // CELL - 1 - column
                images["cell"] = torch.where(images["cell"] < none, mirrored, images["cell"])
                images["p"] = images["p"] * torch.tensor([-1.0, 1.0, 1.0], device=self.device)
            logits, correction = self.policy.eye(depth)
            eye = nn.functional.cross_entropy(logits, images["cell"])
            shown = images["cell"] < none
            at = images["cell"].clamp(max=none - 1)[:, None]
            p = images["p"]
            goal = torch.stack([p[:, 0] / p[:, 2].clamp(min=0.1), p[:, 1] / p[:, 2].clamp(min=0.1), p[:, 2]], 1)
            goal = goal - torch.cat([self.policy.rays[0][at], self.policy.rays[1][at], cells(depth).gather(1, at)], 1)
            off = correction.gather(2, at[:, None].expand(-1, 3, -1))[..., 0] - goal
            off = nn.functional.smooth_l1_loss(off[shown], torch.zeros_like(off[shown]), beta=0.01) if shown.any() else off.sum() * 0
            loss = hand * args.hand_weight + eye + 20 * off
            self.optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(self.policy.parameters(), 5.0)
            self.optimiser.step()
            right = (logits.argmax(1) == images["cell"]).float().mean()
            for k, part in enumerate((hand, eye, right)):
                totals[k] += part.item()
        return [total / count for total in totals]


def evaluate(trainer, count, seed, by_rule):
    """Fruit placed over fruit gripped, and fruit deposited and dropped an episode, over the first `count` worlds of a seed. By the rule: it is told the truth."""
    envs = make(count, trainer.args.threads, by_rule, gymnasium.vector.AutoresetMode.DISABLED)
    observation, _ = envs.reset(seed=seed)
    state = torch.zeros(count, STATE, device=trainer.device)
    over, figures, grips = np.zeros(count, bool), [None] * count, np.zeros(count)
    weight = next(term["weight"] for term in envs.unwrapped.interface["reward"] if term["name"] == "grip")
    trainer.policy.eval()
    while not over.all():
        if by_rule:
            truth = observation["privileged"].astype(np.float64)
            action = harvest_rule(observation, truth[:, :3], truth[:, 3] > 0)
        else:
            o = trainer.tensors(observation)
            with torch.no_grad():
                state = trainer.policy.remember(o["agent_pos"], o["forces"], o["tool_pose"], o["depth"], o["depth_time"], state)
                action = trainer.policy.act(*(o[key] for key in KEYS[:4]), state).cpu().numpy()
        action[over] = 0
        observation, _, terminated, truncated, info = envs.step(action)
        again = terminated | truncated
        grips[~over] += info["reward_terms"]["grip"][~over] / weight
        for k in np.flatnonzero(again & ~over):
            figures[k] = {name: float(part[k]) for name, part in info["statistics"].items()}
        over |= again
        if again.any():
            observation, _ = envs.reset(options={"reset_mask": again})
    envs.close()
    sums = {name: sum(f[name] for f in figures) for name in figures[0]}
    gripped, deposited = grips.sum(), sums["deposited"]
    return {"seed": seed, "worlds": count, "by": "rule with the truth" if by_rule else "policy", "placed_of_gripped": deposited / max(gripped, 1),
            "interval": interval(deposited, max(gripped, 1)), "gripped": gripped / count, **{name: total / count for name, total in sums.items()}}


def export(policy, folder):
    """Writes the policy and its spec, as `--controller onnx:FILE` takes them."""
    policy = policy.cpu().eval()
    envs = make(1, 1, False, gymnasium.vector.AutoresetMode.SAME_STEP)
    space, interface = envs.single_observation_space, envs.unwrapped.interface
    envs.close()
    arrays = (*(torch.zeros(1, *space[key].shape) for key in KEYS), torch.zeros(1, STATE))
    torch.onnx.export(policy, arrays, folder / "policy.onnx", input_names=[*KEYS, "state_in"], output_names=["action", "state_out"], dynamo=False)
    files = [pathlib.Path(__file__).with_name(name) for name in ("clone_harvest.py", "harvest_rule.py", "ppo_reach.py", "reach_rule.py")]
    source = {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}
    (folder / "policy.json").write_text(json.dumps({**interface, "trained_by": source}, indent=1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", required=True)
    parser.add_argument("--envs", type=int, default=256)
    parser.add_argument("--threads", type=int, default=0, help="0: all cores")
    parser.add_argument("--steps", type=int, default=3_000_000, help="steps of all environments together")
    parser.add_argument("--horizon", type=int, default=50, help="steps between fits")
    parser.add_argument("--fits", type=int, default=60, help="batches that are fitted then")
    parser.add_argument("--batch", type=int, default=16384)
    parser.add_argument("--image-batch", type=int, default=256)
    parser.add_argument("--states", type=int, default=3_000_000, help="states that are kept")
    parser.add_argument("--images", type=int, default=250_000, help="images that are kept")
    parser.add_argument("--kept", type=float, default=0.3, help="share of the images that are kept")
    parser.add_argument("--rate", type=float, default=1e-3)
    parser.add_argument("--hand-weight", type=float, default=10.0)
    parser.add_argument("--note", type=int, default=50_000, help="steps between points of the curve")
    parser.add_argument("--minutes", type=float, default=0, help="stops after so many minutes; the same command goes on")
    parser.add_argument("--evaluate", type=int, default=0, metavar="WORLDS", help="tests the trained policy, and the rule, instead of training")
    parser.add_argument("--test-seed", type=int, default=VALIDATION_SEED)
    args = parser.parse_args()
    trainer = Trainer(args)
    if args.evaluate:
        result = [evaluate(trainer, args.evaluate, args.test_seed, by_rule) for by_rule in (False, True)]
        (trainer.dir / f"result-{args.test_seed}.json").write_text(json.dumps(result, indent=1))
        print(json.dumps(result, indent=1))
        return
    trainer.clone()
    trainer.save()
    export(trainer.policy, trainer.dir)


if __name__ == "__main__":
    sys.exit(main())
