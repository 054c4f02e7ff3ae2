"""Draws learning curves: success of the episodes that ended, over the steps of training.

    pip install matplotlib
    python plot_curves.py curves/reach-*.jsonl --out curves.png
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("curves", nargs="+", type=pathlib.Path)
    parser.add_argument("--out", required=True)
    args = parser.parse_args()
    figure, axes = plt.subplots(figsize=(7.5, 4.2), layout="constrained")
    for number, path in enumerate(args.curves):
        rows = [json.loads(line) for line in path.read_text().splitlines()]
        rows = [row for row in rows if row.get("episodes")]
        steps = np.array([row["taught"] + row["steps"] for row in rows]) / 1e6
        ended = np.array([row["episodes"] for row in rows], float)
        done = ended * np.array([row["success"] for row in rows])
        window = np.ones(ROUNDS)
        share = np.convolve(done, window, "valid") / np.convolve(ended, window, "valid")
        line = axes.plot(steps[ROUNDS - 1 :], share, label=f"training seed {number + 1}")[0]
        axes.plot(steps, done / ended, ".", markersize=3, alpha=0.35, color=line.get_color())
    taught = max(row["taught"] for row in rows) / 1e6
    axes.axvline(taught, color="0.5", linestyle=":")
    axes.text(taught, 0.52, "  PPO from here", color="0.35")
    axes.text(taught, 0.52, "the rule teaches  ", color="0.35", ha="right")
    axes.set(xlabel="steps of training, millions", ylabel="success in Reach-v1, with exploration", ylim=(0.5, 1.0))
    axes.legend(loc="lower right")
    axes.grid(alpha=0.3)
    figure.savefig(args.out, dpi=110)


if __name__ == "__main__":
    main()
