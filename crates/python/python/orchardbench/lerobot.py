"""Demonstrations of ``orchard demos`` as a LeRobot v3 data set, written by LeRobot itself (``pip install orchardbench[lerobot]``).

    python -m orchardbench.lerobot DIR OUT

DIR is the neutral folder. OUT is new; ``LeRobotDataset(REPO_ID, root=OUT)`` reads it. Depth is kept without loss as LeRobot's depth maps (16 bits,
millimetres). Episodes stand in the order training, validation, tests, and ``splits`` of ``meta/info.json`` has their ranges.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
from lerobot.datasets.io_utils import write_info
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from PIL import Image

STATE = ("agent_pos", "agent_vel", "forces")
"""Fields that are ``observation.state``, one after another."""
GOAL = "target"
"""Field that is ``observation.environment_state``."""
IMAGES = {"pixels_wrist": "observation.images.wrist", "pixels_base": "observation.images.base", "depth": "observation.images.depth"}
SPLITS = ("train", "validation", "test")
MILLIMETRE = 1e-3
"""Unit of LeRobot's depth maps of whole numbers [m]."""


def features_of(meta: dict[str, Any], videos: bool) -> dict[str, dict[str, Any]]:
    """LeRobot's features of the conventions of a folder."""
    fields = {field["key"]: field for field in meta["interface"]["observation"]}
    features: dict[str, dict[str, Any]] = {}

    def numbers(key: str, names: list[str], dtype: str = "float32") -> None:
        features[key] = {"dtype": dtype, "shape": (len(names),), "names": names}

    state = [f"{key}.{element['name']}" for key in STATE if key in fields for element in fields[key]["elements"]]
    if state:
        numbers("observation.state", state)
    if GOAL in fields:
        numbers("observation.environment_state", [f"{GOAL}.{element['name']}" for element in fields[GOAL]["elements"]])
    for key, name in IMAGES.items():
        if key not in fields:
            continue
        height, width = fields[key]["shape"][:2]
        channels, is_depth = (1, True) if key == "depth" else (3, False)
        dtype = "video" if videos and not is_depth else "image"
        features[name] = {"dtype": dtype, "shape": (height, width, channels), "names": ["height", "width", "channels"]}
        if is_depth:
            features[name]["info"] = {"is_depth_map": True}
    numbers("action", [channel["name"] for channel in meta["interface"]["action"]])
    for name, dtype in (("next.reward", "float32"), ("next.cost", "float32"), ("next.done", "bool"), ("next.success", "bool")):
        features[name] = {"dtype": dtype, "shape": (1,), "names": None}
    return features


def frames_of(root: Path, meta: dict[str, Any], demonstration: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The frames of an episode, as LeRobot takes them."""
    shapes = {field["key"]: field["shape"] for field in meta["interface"]["observation"]}
    images: dict[str, tuple[str, Any]] = {}
    rows = parquet.read_table(root / demonstration["steps"]["path"]).to_pylist()
    for number, row in enumerate(rows):
        frame: dict[str, Any] = {"task": demonstration["task_description"]}
        state = [np.asarray(row[key], dtype=np.float32) for key in STATE if key in row]
        if state:
            frame["observation.state"] = np.concatenate(state)
        if GOAL in row:
            frame["observation.environment_state"] = np.asarray(row[GOAL], dtype=np.float32)
        for key, name in IMAGES.items():
            if key in row:
                if key not in images or images[key][0] != row[key]:
                    images[key] = (row[key], _image(root, key, row[key], shapes[key]))
                frame[name] = images[key][1]
        frame["action"] = np.asarray(row["action"], dtype=np.float32)
        frame["next.reward"] = np.array([row["reward"]], dtype=np.float32)
        frame["next.cost"] = np.array([row["cost"]], dtype=np.float32)
        frame["next.done"] = np.array([row["terminated"] or row["truncated"]])
        frame["next.success"] = np.array([demonstration["success"] and number == len(rows) - 1])
        yield frame


def _image(root: Path, key: str, path: str, shape: list[int]) -> np.ndarray[Any, Any]:
    dtype = np.uint16 if key == "depth" else np.uint8
    if not path:
        # Nothing was seen yet.
        return np.zeros((*shape[:2], 1 if key == "depth" else 3), dtype=dtype)
    array = np.asarray(Image.open(root / path)).astype(dtype)
    return array[:, :, None] if array.ndim == 2 else array


def read_json(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text())
    return content


def convert(root: Path, out: Path, repo_id: str, videos: bool = False, only_success: bool = False) -> LeRobotDataset:
    """Writes the data set of a folder that ``orchard demos`` has finished."""
    if not (root / "summary.json").is_file():
        raise SystemExit(f"{root}: has no summary.json, so it is no finished folder of `orchard demos`")
    meta = read_json(root / "meta.json")
    if meta["format"] != "orchard-demos" or abs(meta["depth_unit_m"] - MILLIMETRE) > 1e-12:
        raise SystemExit(f"{root}: holds {meta['format']} with a depth unit of {meta['depth_unit_m']} m; orchard-demos in millimetres is needed")
    records = [read_json(path) for path in sorted((root / "episodes").glob("*.json"))]
    demonstrations = [record["demonstration"] for record in records if record["demonstration"]]
    kept = [d for d in demonstrations if d["success"] or not only_success]
    if not kept:
        raise SystemExit(f"{root}: has no episode to convert")
    dataset = LeRobotDataset.create(
        repo_id=repo_id,
        fps=meta["control_hz"],
        features=features_of(meta, videos),
        root=out,
        robot_type=meta["scenario"]["robot"],
        use_videos=videos,
    )
    splits: dict[str, str] = {}
    done = 0
    for split in SPLITS:
        chosen = [d for d in kept if d["split"] == split]
        for demonstration in chosen:
            for frame in frames_of(root, meta, demonstration):
                dataset.add_frame(frame)
            dataset.save_episode()
            done += 1
            print(f"{done}/{len(kept)} {demonstration['steps']['path']}", file=sys.stderr)
        if chosen:
            splits[split] = f"{done - len(chosen)}:{done}"
    dataset.finalize()
    # LeRobot knows one split while it writes.
    dataset.meta.info.splits = splits
    write_info(dataset.meta.info, dataset.root)
    shutil.copyfile(root / "meta.json", Path(dataset.root) / "meta" / "orchardbench.json")
    return dataset


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m orchardbench.lerobot", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", help="folder that `orchard demos` wrote")
    parser.add_argument("out", type=Path, nargs="?", help="new folder of the data set")
    parser.add_argument("--repo-id", default="local/orchardbench", help="name of the data set [default: %(default)s]")
    parser.add_argument("--videos", action="store_true", help="store colour as video, which loses details; depth never is")
    parser.add_argument("--only-success", action="store_true", help="leave out episodes in which the task was not done")
    parser.add_argument("--check", action="store_true", help="only check that LeRobot is there")
    args = parser.parse_args()
    if args.check:
        return
    if args.folder is None or args.out is None:
        parser.error("FOLDER and OUT are needed")
    if args.out.exists():
        parser.error(f"{args.out} exists; LeRobot writes into a new folder")
    dataset = convert(args.folder, args.out, args.repo_id, args.videos, args.only_success)
    print(f"{dataset.meta.total_episodes} episodes, {dataset.meta.total_frames} frames: {args.out}")


if __name__ == "__main__":
    main()
