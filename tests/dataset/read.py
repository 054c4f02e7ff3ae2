"""Reads a data set with pycocotools, Pillow and numpy and holds its files against one another."""

import hashlib
import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from pycocotools.coco import COCO
from pycocotools.mask import area

# Depth is rounded to f32 before it is rounded to the file's unit [m]; a few metres of it.
ROUNDING = 1e-6


def pixels(root, name, mode):
    image = Image.open(root / name)
    assert image.mode in mode, f"{name} is {image.mode}"
    return np.array(image)


def rotation(q):
    """Matrix of the quaternion (x, y, z, w)."""
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def checked(path):
    """The content of a JSON file whose second line is the SHA-256 of its other lines."""
    lines = path.read_bytes().splitlines(keepends=True)
    content = json.loads(b"".join(lines))
    assert hashlib.sha256(lines[0] + b"".join(lines[2:])).hexdigest() == content["checksum"], f"{path}: checksum"
    return content


class View:
    """The files of one image."""

    def __init__(self, root, entry):
        self.color = pixels(root, entry["file_name"], ["RGB"])
        self.depth = pixels(root, entry["depth_file"], ["I;16", "I"]).astype(np.int64)
        self.label = pixels(root, entry["label_file"], ["L"])
        self.instance = pixels(root, entry["instance_file"], ["I;16", "I"]).astype(np.int64)
        true_depth = entry.get("true_depth_file")
        self.true_depth = self.depth if true_depth is None else pixels(root, true_depth, ["I;16", "I"]).astype(np.int64)
        size = (entry["height"], entry["width"])
        for image in (self.color, self.depth, self.label, self.instance, self.true_depth):
            assert image.shape[:2] == size, f"{entry['file_name']}: {image.shape}"


def check_view(view, annotations, coco, manifest, k, where):
    """Masks, boxes, classes, instances, depths and balls of one image agree."""
    fruit_class = next(c["value"] for c in manifest["classes"] if c["name"] == "fruit")
    unit = manifest["recipe"]["depth_unit_m"]
    left = view.label == fruit_class
    for a in annotations:
        told = f"{where}, fruit {a['instance']}"
        mask = coco.annToMask(a).astype(bool)
        assert np.array_equal(mask, (view.label == fruit_class) & (view.instance == a["instance"])), f"{told}: mask"
        assert a["area"] == mask.sum() == area(coco.annToRLE(a)), f"{told}: area"
        v, u = np.nonzero(mask)
        box = [u.min(), v.min(), u.max() - u.min() + 1, v.max() - v.min() + 1]
        assert a["bbox"] == box, f"{told}: box {a['bbox']}, not {box}"
        assert a["iscrowd"] == 0
        assert 0 < a["visible_fraction"] <= 1, f"{told}: visible fraction {a['visible_fraction']}"
        assert a["visible_fraction"] == a["area"] / a["unoccluded_px"], f"{told}: visible fraction"
        left &= ~mask
        # Every pixel of the mask looks at the ball, whose near side is as deep as the depth image says.
        c, r = np.array(a["center_camera_m"]), a["radius_m"]
        ray = np.stack([(u - k["cx"]) / k["fx"], (v - k["cy"]) / k["fy"], np.ones(len(u))])
        dd, dc = (ray * ray).sum(axis=0), c @ ray
        half = dc * dc - dd * (c @ c - r * r)
        assert half.min() > -ROUNDING, f"{told}: a pixel beside the ball"
        z = (dc - np.sqrt(np.maximum(half, 0))) / dd
        off = np.abs(view.true_depth[mask] * unit - z).max()
        assert off <= 0.5 * unit + ROUNDING, f"{told}: depth off by {off} m"
    assert not left.any(), f"{where}: fruit pixels without an annotation"
    nothing = view.label == 0
    assert not view.true_depth[nothing].any() and (view.instance[nothing] == manifest["no_instance"]).all(), where


def check_geometry(views, coco, cameras, where):
    """The fruit of one tree stands at one place in the world in all its images."""
    seen = {}
    for image_id in views:
        x = cameras[image_id]["x_world_camera"]
        r, t = rotation(x["rotation_xyzw"]), np.array(x["translation_m"])
        for a in coco.loadAnns(coco.getAnnIds(imgIds=[image_id])):
            seen.setdefault(a["instance"], []).append(r @ a["center_camera_m"] + t)
    gaps = [np.ptp(np.array(points), axis=0).max() for points in seen.values()]
    assert max(gaps, default=0) < 1e-9, f"{where}: fruit moves by {max(gaps)} m between views"
    return sum(len(points) > 1 for points in seen.values())


def check(root):
    manifest = checked(root / "manifest.json")
    assert manifest["format"] == "orchard-dataset"
    for file in manifest["files"]:
        assert hashlib.sha256((root / file["path"]).read_bytes()).hexdigest() == file["sha256"], file["path"]
        if file["path"] == "recipe.json" or file["path"].startswith("trees/"):
            checked(root / file["path"])
    coco = COCO(root / "annotations.json")
    cameras = json.loads((root / "cameras.json").read_text())
    k, poses = cameras["intrinsics"], {pose["image_id"]: pose for pose in cameras["poses"]}
    assert k == manifest["recipe"]["intrinsics"] == json.loads((root / "intrinsics.json").read_text())
    counts = manifest["counts"]
    assert (len(coco.imgs), len(coco.anns)) == (counts["images"], counts["annotations"]) and len(poses) == len(coco.imgs)
    assert [c["name"] for c in coco.loadCats(coco.getCatIds())] == ["fruit"]
    trees, luminance = {}, []
    for image_id, entry in sorted(coco.imgs.items()):
        view = View(root, entry)
        assert poses[image_id]["file_name"] == entry["file_name"]
        annotations = coco.loadAnns(coco.getAnnIds(imgIds=[image_id]))
        check_view(view, annotations, coco, manifest, k, entry["file_name"])
        trees.setdefault((entry["seed"], entry["tree"]), []).append(image_id)
        luminance.append(view.color.mean())
    twice = sum(check_geometry(views, coco, poses, f"tree {tree}") for tree, views in trees.items())
    assert twice > 0, "no fruit is seen from two sides"
    assert len(trees) == counts["trees"]
    return f"{len(coco.imgs)} images, {len(coco.anns)} fruit, {twice} seen from several sides, mean brightness {np.mean(luminance):.0f}"


def main(roots):
    failed = False
    for root in map(Path, roots):
        try:
            print(f"pass  {root.name}: {check(root)}")
        except AssertionError as e:
            print(f"FAIL  {root.name}: {e}")
            failed = True
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
