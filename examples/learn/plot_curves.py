"""Draws learning curves over the steps of training: success of the episodes that ended, or fruit a harvest.

    pip install matplotlib
    python plot_curves.py curves/reach-*.jsonl --out reach.png
    python plot_curves.py curves/harvest-*.jsonl --out harvest.png
    python plot_curves.py --wall curves/device-*.jsonl --out device.png
"""

import argparse
import json
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

# Episodes of neighbouring rounds that are averaged; our own choice.
ROUNDS = 5


def means(rows, name, rounds):
    """Means of a figure over the episodes of a few neighbouring points of a curve, and at each point."""
    ended = np.array([row["episodes"] for row in rows], float)
    total = ended * np.array([row[name] for row in rows])
    window = np.ones(rounds)
    return np.convolve(total, window, "valid") / np.convolve(ended, window, "valid"), total / ended


def draw_wall(axes, curves, names):
    for name, rows in zip(names, curves):
        minutes = np.array([row["seconds"] for row in rows]) / 60
        each, begins = np.array([row["success"] for row in rows]), [row["stage"] for row in rows].index("ppo")
        line = axes.plot(minutes[:begins], each[:begins], ".:", alpha=0.4)[0]
        axes.plot(minutes[begins:], each[begins:], "o-", color=line.get_color(), label=f"{name}: PPO")
    axes.axhline(0.8, color="0.5", linestyle="--", linewidth=1)
    axes.set(xlabel="minutes of training", ylabel="success in Reach-v1, with exploration", ylim=(0.5, 1.02))


def draw_success(axes, curves):
    for number, rows in enumerate(curves):
        steps = np.array([row["taught"] + row["steps"] for row in rows]) / 1e6
        share, each = means(rows, "success", ROUNDS)
        line = axes.plot(steps[ROUNDS - 1 :], share, label=f"training seed {number + 1}")[0]
        axes.plot(steps, each, ".", markersize=3, alpha=0.35, color=line.get_color())
    taught = max(row["taught"] for rows in curves for row in rows) / 1e6
    axes.axvline(taught, color="0.5", linestyle=":")
    axes.text(taught, 0.52, "  PPO from here", color="0.35")
    axes.text(taught, 0.52, "the rule teaches  ", color="0.35", ha="right")
    axes.set(ylabel="success in Reach-v1, with exploration", ylim=(0.5, 1.0))


def draw_harvest(axes, curves):
    for number, rows in enumerate(curves):
        steps = np.array([row["steps"] for row in rows]) / 1e6
        line = axes.plot(steps, means(rows, "deposited", 1)[1], "o-", label=f"deposited, seed {number + 1}")[0]
        axes.plot(steps, means(rows, "dropped", 1)[1], "x:", alpha=0.7, color=line.get_color(), label=f"dropped, seed {number + 1}")
    axes.set(ylabel="fruit an episode of Harvest-v1 (75 s)", ylim=(0, 2.4))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("curves", nargs="+", type=pathlib.Path)
    parser.add_argument("--wall", action="store_true", help="over minutes instead of steps, dotted while the rule teaches")
    parser.add_argument("--out", required=True)
    args = parser.parse_args()
    curves = [[json.loads(line) for line in path.read_text().splitlines()] for path in args.curves]
    curves = [[row for row in rows if row.get("episodes")] for rows in curves]
    figure, axes = plt.subplots(figsize=(7.5, 4.2), layout="constrained")
    draw = draw_success if "success" in curves[0][0] else draw_harvest
    if args.wall:
        draw_wall(axes, curves, [path.stem for path in args.curves])
    else:
        draw(axes, curves)
        axes.set_xlabel("steps of training, millions")
    axes.legend(loc="lower right" if draw is draw_success else "upper left", ncols=1 if draw is draw_success else 3, fontsize="small")
    axes.grid(alpha=0.3)
    figure.savefig(args.out, dpi=110)


if __name__ == "__main__":
    main()
