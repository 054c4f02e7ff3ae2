"""A network that finds apples in depth images, or in colour and depth, trained on data sets of `orchard dataset` alone.

The network says where in an image an apple is and how large it looks; the geometric fit of the detector then says where it is in space and how large it
is (`orchard detect --detector learned`, or `learned-colour`). Without `--colour` it sees depth only, so colour, cultivar and light do not matter to it.

    orchard dataset --seeds 6000000..6000040 --views 8 --preset randomised --camera d435i-aligned --out data/a   # and others
    python train_detector.py --data data/a data/b --validate data/v --seed 1 --out runs/detector
    python train_detector.py --colour --data data/a data/b --validate data/v --seed 1 --out runs/detector-colour

DIR/curve.jsonl has the loss and the validation, DIR/detector.onnx the network, DIR/detector.json what it was made from. It needs numpy, torch, onnx and pillow.
"""

import argparse
import concurrent.futures
import hashlib
import json
import math
import pathlib
import time

import numpy as np
import torch
from PIL import Image
from torch import nn
from torch.nn import functional

from detector_network import CELL, FAR, MULTIPLE, NEAR, RADIUS, TYPICAL_PX, ColourDetector, DepthDetector

# Radius of an apple at 1 m in the sampled image: every so many columns and rows are taken that it is at least so large [px].
SAMPLED_PX = 16.0
# Least visible share of an apple that is to be found; below it, or with fewer measured pixels of its disc, an apple counts neither way.
LEAST_VISIBLE, LEAST_MEASURED = 0.3, 0.2
# Side of a crop [px], apples of a crop, crops of a step.
SIDE, MOST, BATCH = 256, 48, 64
# Factors of the augmentation: size of the image, scale of the world.
ZOOM, WORLD = (0.65, 1.6), (0.85, 1.15)
# Shares of crops whose colour is grey, whose depth is empty, whose background is another image's, and whose colour is blurred and moved against depth.
GREY, BLIND, PASTED, BLURRED, MOVED = 0.1, 0.1, 0.5, 0.5, 0.3
# Largest moves of colour against depth [px].
LARGEST_MOVE = 2
# Share of crops with a ball, and the radii of balls [m]: like apples, larger, smaller. Balls lie so far behind or before a pixel of the crop [m].
BALLS, BALL_LIKE, BALL_LARGE, BALL_SMALL, BALL_BEFORE = 0.35, (0.027, 0.045), (0.053, 0.1), (0.006, 0.018), (-0.05, 0.35)
# Pixels of these classes of a data set are background: none and ground. Class of fruit.
BACKGROUND, FRUIT = (0, 5), 1


def step_of(focal):
    """Every so many columns and rows of an image are looked at."""
    return max(1, int(focal * RADIUS / SAMPLED_PX))


def thinned(image, step):
    """Means of blocks of `step` x `step` pixels; blocks at the right and lower edge may be smaller."""
    rows, columns = (-(-n // step) * step for n in image.shape[:2])
    image = np.pad(image, ((0, rows - image.shape[0]), (0, columns - image.shape[1]), (0, 0)), "edge")
    return image.reshape(rows // step, step, columns // step, step, 3).mean((1, 3))


def read(folder, colour):
    """Images of a data set: depth as the network sees it, its focal length, its apples (u, v, radius in pixels, visible share; n, 4), what is background and what is fruit
    (rows, columns, 2), and colour or None."""
    folder = pathlib.Path(folder)
    recipe = json.loads((folder / "manifest.json").read_text())["recipe"]
    k = json.loads((folder / "intrinsics.json").read_text())
    notes = json.loads((folder / "annotations.json").read_text())
    focal = 0.5 * (k["fx"] + k["fy"])
    step = step_of(focal)
    fruit = {image["id"]: [] for image in notes["images"]}
    for a in notes["annotations"]:
        x, y, z = a["center_camera_m"]
        if z > 0:
            u, v, r = k["fx"] * x / z + k["cx"], k["fy"] * y / z + k["cy"], focal * a["radius_m"] / z
            fruit[a["image_id"]].append((u / step, v / step, r / step, a["visible_fraction"]))

    def one(image):
        depth = np.asarray(Image.open(folder / image["depth_file"]), np.float32) * recipe["depth_unit_m"]
        label = np.asarray(Image.open(folder / image["label_file"]))[::step, ::step]
        kinds = np.stack([np.isin(label, BACKGROUND), label == FRUIT], 2).astype(np.uint8)
        seen = thinned(np.asarray(Image.open(folder / image["file_name"])), step).round().astype(np.uint8) if colour else None
        return depth[::step, ::step], focal / step, np.array(fruit[image["id"]], np.float32).reshape(-1, 4), kinds, seen

    with concurrent.futures.ThreadPoolExecutor() as pool:
        yield from pool.map(one, notes["images"])


# This script and its networks.
SCRIPTS = [pathlib.Path(__file__), pathlib.Path(__file__).with_name("detector_network.py")]


class Images:
    """All images on the device, padded to one size."""

    def __init__(self, folders, device, colour):
        images = [image for folder in folders for image in read(folder, colour)]
        rows, columns = (max(image[0].shape[k] for image in images) for k in (0, 1))
        self.depth = torch.zeros(len(images), rows, columns, dtype=torch.float16, device=device)
        self.kinds = torch.zeros(len(images), rows, columns, 2, dtype=torch.uint8, device=device)
        self.seen = torch.zeros(len(images), rows, columns, 3, dtype=torch.uint8, device=device) if colour else None
        self.size = torch.tensor([image[0].shape for image in images], device=device)
        self.focal = torch.tensor([image[1] for image in images], dtype=torch.float32, device=device)
        most = max(len(image[2]) for image in images)
        self.fruit = torch.zeros(len(images), most, 4, device=device)
        for k, (depth, _, fruit, kinds, seen) in enumerate(images):
            # Half precision keeps a quarter of a millimetre at 0.5 m and a millimetre at 2 m, as the files do.
            self.depth[k, : depth.shape[0], : depth.shape[1]] = torch.from_numpy(depth).to(device).half()
            self.fruit[k, : len(fruit)] = torch.from_numpy(fruit).to(device)
            self.kinds[k, : depth.shape[0], : depth.shape[1]] = torch.from_numpy(kinds).to(device)
            if colour:
                self.seen[k, : depth.shape[0], : depth.shape[1]] = torch.from_numpy(seen).to(device)

    def colour(self, k):
        """Colour of an image (1, 3, rows, columns), or None."""
        if self.seen is None:
            return None
        rows, columns = self.size[k].tolist()
        return self.seen[k, :rows, :columns].permute(2, 0, 1)[None].float() / 255.0

    def crops(self, count, generator):
        """Random crops with their augmentation: depth, focal length, the apples of which the most visible are kept, where pixels show fruit, and colour or None."""
        device = self.depth.device

        def uniform(low, high, *shape):
            return low + (high - low) * torch.rand(*shape, generator=generator, device=device)

        which = torch.randint(len(self.depth), (count,), generator=generator, device=device)
        zoom = torch.exp(uniform(math.log(ZOOM[0]), math.log(ZOOM[1]), count))
        world = uniform(*WORLD, count)
        size = self.size[which]
        # The first column and row of the crop, in pixels of the image.
        span = SIDE / zoom
        start = torch.stack([uniform(-0.15, 1.0, count) * (size[:, k] - 0.85 * span).clamp(min=0.0) for k in (1, 0)], 1)
        at = torch.arange(SIDE, device=device)
        u = (start[:, 0:1] + at / zoom[:, None]).round().long()
        v = (start[:, 1:2] + at / zoom[:, None]).round().long()
        inside = ((u >= 0) & (u < size[:, 1:2]))[:, None, :] & ((v >= 0) & (v < size[:, 0:1]))[:, :, None]
        u, v = u.clamp(0, self.depth.shape[2] - 1), v.clamp(0, self.depth.shape[1] - 1)
        depth = self.depth[which[:, None, None], v[:, :, None], u[:, None, :]].float() * inside
        kinds = self.kinds[which[:, None, None], v[:, :, None], u[:, None, :]].permute(0, 3, 1, 2).float() * inside[:, None]
        shows = kinds[:, 1]
        colour = None
        if self.seen is not None:
            seen = self.seen[which[:, None, None], v[:, :, None], u[:, None, :]].permute(0, 3, 1, 2).float() * inside[:, None]
            colour = augmented(seen / 255.0, (kinds[:, :1] > 0) | ~inside[:, None], generator)
        fruit = self.fruit[which].clone()
        fruit[..., :2] = (fruit[..., :2] - start[:, None]) * zoom[:, None, None]
        fruit[..., 2] *= zoom[:, None]
        # Mirrored, with holes, and with noise beyond the camera's own.
        mirrored = torch.rand(count, generator=generator, device=device) < 0.5
        depth, shows = (torch.where(mirrored[:, None, None], t.flip(2), t) for t in (depth, shows))
        if colour is not None:
            colour = torch.where(mirrored[:, None, None, None], colour.flip(3), colour)
        fruit[..., 0] = torch.where(mirrored[:, None], SIDE - 1 - fruit[..., 0], fruit[..., 0])
        holes = torch.rand(count, 1, SIDE // 8, SIDE // 8, generator=generator, device=device)
        holes = functional.interpolate(holes, scale_factor=8, mode="bilinear")[:, 0]
        depth = depth * (holes > uniform(-0.3, 0.3, count)[:, None, None])
        coarse = torch.randn(count, 1, SIDE // 4, SIDE // 4, generator=generator, device=device)
        noise = functional.interpolate(coarse, scale_factor=4, mode="bilinear")[:, 0]
        depth = depth + (depth > 0) * noise * depth.square() * uniform(0.0, 0.004, count)[:, None, None]
        # A larger world looks the same from farther away; its apples are larger.
        depth = depth * world[:, None, None]
        # Of an image's apples those in the crop.
        reach = fruit[..., 2] * 0.5
        seen = (fruit[..., :2] > -reach[..., None]).all(-1) & (fruit[..., :2] < SIDE + reach[..., None]).all(-1)
        order = torch.argsort((seen & (fruit[..., 3] > 0)).float(), dim=1, descending=True, stable=True)[:, :MOST]
        fruit = torch.gather(fruit * seen[..., None], 1, order[..., None].expand(-1, -1, 4))
        return with_balls(depth[:, None], self.focal[which] * zoom, fruit, shows, colour, generator)


def with_balls(depth, focal, fruit, shows, colour, generator):
    """Crops, some with a ball of any colour. One of an apple's size counts as an apple; a larger or smaller one is none."""
    n, device = len(depth), depth.device

    def uniform(low, high, *shape):
        return low + (high - low) * torch.rand(n, *(shape or (1, 1)), generator=generator, device=device)

    def smooth():
        coarse = torch.randn(n, 1, SIDE // 4, SIDE // 4, generator=generator, device=device)
        return functional.interpolate(coarse, scale_factor=4, mode="bilinear")[:, 0]

    kind = uniform(0.0, 1.0)
    apple = kind < 0.5
    radius = torch.where(apple, uniform(*BALL_LIKE), torch.where(kind < 0.8, uniform(*BALL_LARGE), uniform(*BALL_SMALL)))
    u, v = (torch.randint(SIDE, (n, 1, 1), generator=generator, device=device) for _ in range(2))
    behind = depth[:, 0].flatten(1).gather(1, (v * SIDE + u)[:, :, 0])[:, :, None]
    z = behind + radius - uniform(*BALL_BEFORE)
    used = (uniform(0.0, 1.0) < BALLS) & (behind > NEAR) & (z > 0.3)
    z, f = z.clamp(min=0.3), focal[:, None, None]
    at = torch.arange(SIDE, device=device)
    across, down = at[None, None, :] - u, at[None, :, None] - v
    off = (across.square() + down.square()).float().sqrt() * z / f / radius
    noise = smooth()
    front = z - radius * (1.0 - off.square()).clamp(min=0.0).sqrt() + noise * z.square() * uniform(0.0, 0.003)
    inside = used & (off < 1.0) & ((depth[:, 0] == 0) | (depth[:, 0] > front))
    # At the rim, and on what is around it, the camera measures nothing.
    ragged = smooth()
    rim = off + 0.04 * ragged > uniform(0.85, 1.05)
    ring = used & (off >= 1.0) & (off + 0.1 * ragged < uniform(0.5, 1.8))
    measured = torch.where(inside, front * ~rim, depth[:, 0] * ~ring)
    # An apple behind the ball counts neither way.
    cell = fruit[..., :2].round().long().clamp(0, SIDE - 1)
    hidden = inside.flatten(1).gather(1, cell[..., 1] * SIDE + cell[..., 0])
    fruit = torch.cat([fruit[..., :3], torch.where(hidden, fruit[..., 3].clamp(max=0.05), fruit[..., 3])[..., None]], 2)
    visible = inside.sum((1, 2)) / (used & (off < 1.0)).sum((1, 2)).clamp(min=1)
    ball = [u[:, 0, 0], v[:, 0, 0], (f * radius / z)[:, 0, 0], visible * (used & apple)[:, 0, 0]]
    fruit = torch.cat([fruit, torch.stack(ball, 1)[:, None].float()], 1)
    shown = apple if colour is not None else apple & ~rim
    shows = torch.where(inside, shown.float().expand_as(shows), shows)
    if colour is not None:
        light = (uniform(-1.0, 1.0) * across + uniform(-1.0, 1.0) * down) * z / f / radius
        grey = uniform(0.0, 1.0, 1, 1, 1) < 0.3
        tone = torch.where(grey, uniform(0.5, 1.0, 1, 1, 1), uniform(0.0, 1.0, 3, 1, 1))
        paint = (tone * (1.0 + 0.4 * light[:, None]) + 0.05 * noise[:, None]).clamp(0.0, 1.0)
        colour = torch.where(inside[:, None], paint, colour)
    return measured[:, None], focal, fruit, shows, colour


def augmented(colour, background, generator):
    """Colour crops (n, 3, side, side; sRGB from 0 to 1) as other lights, lenses and backgrounds would show them."""
    n, device = len(colour), colour.device

    def uniform(low, high):
        return low + (high - low) * torch.rand(n, 1, 1, 1, generator=generator, device=device)

    def field(cells, channels=1):
        """Smooth noise."""
        coarse = torch.randn(n, channels, cells, cells, generator=generator, device=device)
        return functional.interpolate(coarse, SIDE, mode="bilinear", align_corners=False)

    def share(part):
        return torch.rand(n, 1, 1, 1, generator=generator, device=device) < part

    # Behind the tree another image of the batch, or noise; both darker or brighter.
    other = torch.where(share(0.5), colour.roll(1, 0).flip(3), 0.45 + 0.2 * field(SIDE // 4, 3) + 0.15 * field(SIDE // 32, 3))
    colour = torch.where(background & share(PASTED), other * uniform(0.3, 1.3), colour)
    # Light: exposure, white balance, shadows, gamma; then contrast, saturation, and a turn of the hues about grey.
    colour = colour.clamp(0.0, 1.0) * torch.exp(uniform(-0.6, 0.5)) * torch.exp(0.15 * torch.randn(n, 3, 1, 1, generator=generator, device=device))
    colour = colour * torch.exp(uniform(0.0, 0.6) * field(SIDE // 32))
    colour = colour.clamp(0.0, 1.0).pow(torch.exp(uniform(-0.4, 0.4)))
    grey = colour.mean(1, keepdim=True)
    colour = grey + (colour - grey) * uniform(0.3, 1.5)
    angle = uniform(-0.35, 0.35)
    ahead, back = colour.roll(1, 1), colour.roll(2, 1)
    colour = colour * torch.cos(angle) + (1 - torch.cos(angle)) * colour.mean(1, keepdim=True) + torch.sin(angle) * (ahead - back) / math.sqrt(3.0)
    middle = colour.mean((1, 2, 3), keepdim=True)
    colour = middle + (colour - middle) * uniform(0.6, 1.4)
    # Lens and sensor: blur, a move against depth, noise.
    soft = functional.avg_pool2d(functional.pad(colour, (2, 2, 2, 2), mode="replicate"), 5, 1)
    colour = torch.where(share(BLURRED), colour + (soft - colour) * uniform(0.0, 1.0), colour)
    across, down = torch.randint(-LARGEST_MOVE, LARGEST_MOVE + 1, (2,), generator=generator, device=device).tolist()
    colour = torch.where(share(MOVED), colour.roll((down, across), (2, 3)), colour)
    colour = colour + uniform(0.0, 0.06) * torch.randn(colour.shape, generator=generator, device=device)
    return torch.where(share(GREY), torch.full_like(colour, 0.5), colour.clamp(0.0, 1.0))


def targets(depth, fruit):
    """Map of the centres, weight of each cell, and the cell of each apple that is to be found."""
    n, cells = len(depth), SIDE // CELL
    at = (torch.arange(cells, device=depth.device) + 0.5) * CELL - 0.5
    du = at[None, None, None, :] - fruit[..., 0, None, None]
    dv = at[None, None, :, None] - fruit[..., 1, None, None]
    square = du.square() + dv.square()
    radius = fruit[..., 2].clamp(min=1.0)
    # Share of measured cells of the disc.
    measured = functional.avg_pool2d(((depth > NEAR) & (depth < FAR)).float(), CELL)
    disc = (square <= radius[..., None, None].square().clamp(min=0.5 * CELL * CELL)).float()
    share = (disc * measured).sum((2, 3)) / disc.sum((2, 3)).clamp(min=1.0)
    cell = ((fruit[..., :2] + 0.5) / CELL).long()
    inside = ((cell >= 0) & (cell < cells)).all(-1)
    there = fruit[..., 3] > 0
    good = there & inside & (fruit[..., 3] >= LEAST_VISIBLE) & (share >= LEAST_MEASURED)
    sigma = (radius / 3.0).clamp(min=0.6 * CELL)
    bell = torch.exp(-0.5 * square / sigma[..., None, None].square())
    heat = (bell * good[..., None, None]).amax(1)
    cell = cell.clamp(0, cells - 1)
    index = (cell[..., 1] * cells + cell[..., 0]).clamp(min=0)
    # The cells of centres are exactly 1.
    peak = torch.zeros(n, cells * cells, device=depth.device)
    peak.scatter_reduce_(1, index, good.float(), "amax")
    peak = peak.view(n, cells, cells)
    ignored = (disc * (there & ~good)[..., None, None]).amax(1) * (1 - (heat > 0.3).float())
    return torch.maximum(heat * (1 - 1e-3), peak), peak, 1 - ignored, index, good


def loss_of(network, depth, focal, fruit, shows, colour):
    heat, peak, weight, index, good = targets(depth, fruit)
    if colour is not None:
        # Now and then colour alone has to do.
        depth = depth * (torch.rand(len(depth), 1, 1, 1, device=depth.device) >= BLIND)
    y = network.raw(depth, focal.view(-1, 1, 1, 1), colour).float()
    logit = y[:, 0]
    p = torch.sigmoid(logit).clamp(1e-5, 1 - 1e-5)
    # The focal loss of CenterNet (Zhou, Wang and Kraehenbuehl 2019).
    positive = -(1 - p).square() * torch.log(p) * peak
    negative = -(1 - heat).pow(4) * p.square() * torch.log(1 - p) * (1 - peak) * weight
    count = peak.sum().clamp(min=1.0)
    cells = SIDE // CELL
    taken = torch.gather(y[:, 1:4].flatten(2), 2, index[:, None, :].expand(-1, 3, -1))
    centre = torch.stack([index % cells, index // cells], 1)
    wanted = (fruit[..., :2].transpose(1, 2) + 0.5) / CELL - 0.5 - centre
    place = (taken[:, :2] - wanted).abs().sum(1)
    size = (taken[:, 2] - torch.log(fruit[..., 2].clamp(min=1.0) / TYPICAL_PX)).abs()
    share = functional.avg_pool2d(shows[:, None], CELL)[:, 0]
    surface = functional.binary_cross_entropy_with_logits(y[:, 4], share, reduction="sum") / share.sum().clamp(min=1.0)
    return (positive.sum() + negative.sum() + ((place + 2.0 * size) * good).sum()) / count + surface


@torch.no_grad()
def peaks(network, depth, focal, colour, least=0.05):
    """Places that the network finds in one image: score's logit, u, v, radius (n, 4)."""
    rows, columns = depth.shape
    beyond = (0, -columns % MULTIPLE, 0, -rows % MULTIPLE)
    padded = functional.pad(depth, beyond)
    colour = None if colour is None else functional.pad(colour, beyond)
    y = network.raw(padded[None, None], focal.view(1, 1, 1, 1), colour)[0].float()
    p = torch.sigmoid(y[0])
    top = functional.max_pool2d(p[None, None], 3, 1, 1)[0, 0]
    v, u = torch.nonzero((p == top) & (p > least), as_tuple=True)
    place = torch.stack([u, v], 1) + 0.5 + y[1:3, v, u].T
    return torch.cat([y[0, v, u][:, None], place * CELL - 0.5, TYPICAL_PX * torch.exp(y[3, v, u])[:, None]], 1)


def validate(network, images, every=1):
    """Average precision over apples of which 40 % are visible, and the logit of each peak with whether it is right."""
    network.eval()
    found, total = [], 0
    for k in range(0, len(images.depth), every):
        rows, columns = images.size[k].tolist()
        depth = images.depth[k, :rows, :columns].float()
        at = peaks(network, depth, images.focal[k], images.colour(k))
        fruit = images.fruit[k]
        fruit = fruit[fruit[:, 3] > 0]
        inside = (fruit[:, :2] >= 0).all(1) & (fruit[:, 0] < columns) & (fruit[:, 1] < rows)
        counted = (fruit[:, 3] >= 0.4) & inside
        total += int(counted.sum())
        taken = torch.zeros(len(fruit), dtype=torch.bool)
        for logit, u, v, _ in at[at[:, 0].argsort(descending=True)].tolist():
            if not len(fruit):
                found.append((logit, 0))
                continue
            distance = (fruit[:, :2] - torch.tensor([u, v], device=fruit.device)).norm(dim=1) / fruit[:, 2].clamp(min=1.0)
            distance[taken] = math.inf
            best = int(distance.argmin())
            if distance[best] < 0.5:
                taken[best] = True
                if counted[best]:
                    found.append((logit, 1))
            else:
                found.append((logit, 0))
    network.train()
    found = np.array(sorted(found, reverse=True)).reshape(-1, 2)
    right = np.cumsum(found[:, 1])
    precision = right / np.arange(1, len(found) + 1)
    recall = right / max(total, 1)
    envelope = np.maximum.accumulate(precision[::-1])[::-1]
    area = float(np.sum(np.diff(np.concatenate([[0.0], recall])) * envelope)) if len(found) else 0.0
    return {"ap": area, "recall": float(recall[-1]) if len(found) else 0.0, "fruit": total}, found


def calibrated(found, rounds=50):
    """Slope and offset of a logistic regression of whether a peak is right on its logit, by Newton's method."""
    x = np.stack([found[:, 0], np.ones(len(found))], 1)
    w = np.array([1.0, 0.0])
    for _ in range(rounds):
        p = 1 / (1 + np.exp(-x @ w))
        w += np.linalg.solve((x * (p * (1 - p))[:, None]).T @ x + 1e-6 * np.eye(2), x.T @ (found[:, 1] - p))
    return w


def train(args, device):
    torch.manual_seed(args.seed)
    generator = torch.Generator(device).manual_seed(args.seed)
    images, held = (Images(folders, device, args.colour) for folders in (args.data, args.validate))
    print(f"{len(images.depth)} images to train on, {len(held.depth)} to validate", flush=True)
    network = (ColourDetector() if args.colour else DepthDetector()).to(device)
    optimiser = torch.optim.AdamW(network.parameters(), 2e-3, weight_decay=1e-4)
    rate = torch.optim.lr_scheduler.OneCycleLR(optimiser, 2e-3, args.steps)
    curve = (args.out / "curve.jsonl").open("w")
    start, mean = time.time(), None
    for step in range(1, args.steps + 1):
        crops = images.crops(args.batch, generator)
        with torch.autocast(device.type, torch.bfloat16, enabled=device.type == "cuda"):
            loss = loss_of(network, *crops)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimiser.step()
        rate.step()
        mean = float(loss) if mean is None else 0.98 * mean + 0.02 * float(loss)
        if step % args.every == 0 or step == args.steps:
            result, found = validate(network, held, args.thin if step < args.steps else 1)
            line = {"step": step, "loss": mean, "s": time.time() - start, **result}
            curve.write(json.dumps(line) + "\n")
            curve.flush()
            print(line, flush=True)
    network.calibration.copy_(torch.tensor(calibrated(found), dtype=torch.float32))
    return network.eval(), result


def export(network, args, result):
    network = network.cpu()
    inputs = (torch.full((1, 1, 96, 128), 1.0), torch.tensor([400.0])) + ((torch.full((1, 3, 96, 128), 0.5),) if args.colour else ())
    names, sides = ["depth", "focal", "colour"][: len(inputs)], {2: "rows", 3: "columns"}
    path = args.out / "detector.onnx"
    torch.onnx.export(
        network, inputs, path, input_names=names, output_names=["map"],
        dynamic_axes={name: sides for name in [*names, "map"] if name != "focal"}, dynamo=False,
    )
    about = {
        "script_sha256": hashlib.sha256(b"".join(map(pathlib.Path.read_bytes, SCRIPTS))).hexdigest(),
        "network_sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "colour": args.colour, "seed": args.seed, "steps": args.steps, "batch": args.batch, "validation": result,
        "data": [json.loads((pathlib.Path(folder) / "manifest.json").read_text())["checksum"] for folder in args.data],
    }
    (args.out / "detector.json").write_text(json.dumps(about, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--colour", action="store_true", help="the network sees colour besides depth")
    parser.add_argument("--data", nargs="+", required=True, help="folders of `orchard dataset` to train on")
    parser.add_argument("--validate", nargs="+", required=True, help="folders of other seeds, for the curve and the calibration of scores")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder of the results")
    parser.add_argument("--seed", type=int, default=1, help="seed of weights and crops")
    parser.add_argument("--steps", type=int, default=8000, help="steps of the optimiser")
    parser.add_argument("--batch", type=int, default=BATCH, help="crops of a step")
    parser.add_argument("--every", type=int, default=1000, help="steps between validations")
    parser.add_argument("--thin", type=int, default=4, help="every so many images are validated before the last time")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    network, result = train(args, device)
    export(network, args, result)


if __name__ == "__main__":
    main()
