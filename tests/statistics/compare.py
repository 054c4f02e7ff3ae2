"""Computes what crates/statistics computed, with scipy, scikit-learn and numpy, and compares."""

import json
import sys
import warnings

import numpy as np
import scipy
from scipy import stats
from sklearn import calibration, metrics

# Relative to the figure. Both sides carry some 1e-13 of rounding, of numbers of order 1 to 100: figures below FLOOR are as good as 0.
TOLERANCE = 1e-6
FLOOR = 1e-6


def same(ours, theirs, where):
    assert ours is not None, f"{where}: we have none, scipy has {theirs}"
    # p-values come from no cancellation and are compared to the last.
    scale = abs(theirs) if where.endswith("p-value") else max(FLOOR, abs(theirs))
    assert abs(ours - theirs) <= TOLERANCE * scale, f"{where}: {ours}, scipy {theirs}"


def wilcoxon(case, where):
    method = {"exact": "exact", "normal": "approx"}[case["method"]]
    with warnings.catch_warnings():
        # Of small samples in the normal approximation, which ties leave no way around.
        warnings.simplefilter("ignore")
        theirs = stats.wilcoxon(case["differences"], zero_method="wilcox", correction=True, method=method)
    same(case["statistic"], theirs.statistic, f"{where}: statistic")
    same(case["p_value"], theirs.pvalue, f"{where}: p-value")


def permutation(case, where):
    differences = np.array(case["differences"])
    theirs = stats.permutation_test(
        (differences,), np.mean, permutation_type="samples", n_resamples=np.inf, alternative="two-sided"
    )
    same(case["statistic"], theirs.statistic, f"{where}: mean")
    if case["method"] == "exact":
        same(case["p_value"], theirs.pvalue, f"{where}: p-value")
    else:
        # Drawn by other random numbers: within five standard errors of the exact one, and the one that the sample itself adds.
        error = np.sqrt(theirs.pvalue * (1 - theirs.pvalue) / case["patterns"])
        difference = abs(case["p_value"] - theirs.pvalue)
        assert difference < 5 * error + 1 / case["patterns"], f"{where}: {case['p_value']}, scipy {theirs.pvalue}"


def effects(case, where):
    differences = np.array(case["differences"])
    t = stats.ttest_1samp(differences, 0.0).statistic
    same(case["cohens_dz"], t / np.sqrt(len(differences)), f"{where}: d_z")
    changed = differences[differences != 0]
    signed = stats.rankdata(np.abs(changed)) * np.sign(changed)
    same(case["rank_biserial"], signed.sum() / np.abs(signed).sum(), f"{where}: rank-biserial")


def holm(case, where):
    p = np.array(case["p_values"])
    for ours, own in zip(case["adjusted"], p):
        # The largest of m - j + 1 times the j-th smallest, over all that are no larger.
        theirs = max((np.sum(p >= smaller)) * smaller for smaller in p[p <= own])
        same(ours, min(1.0, theirs), where)


def components(case, where):
    """By projections: mean squares are quadratic forms, and their expectations are traces."""
    rows = [row for row in case["values"] if row["value"] is not None]
    y = np.array([row["value"] for row in rows])
    seeds = np.array([row["seed"] for row in rows])
    trees = np.array([1000 * row["seed"] + row["tree"] for row in rows])

    def indicator(labels):
        return (labels[:, None] == np.unique(labels)[None, :]).astype(float)

    def projection(z):
        return z @ np.linalg.pinv(z)

    za, zb = indicator(seeds), indicator(trees)
    p1, pa, pb = projection(np.ones((len(y), 1))), projection(za), projection(zb)
    forms = [pa - p1, pb - pa, np.eye(len(y)) - pb]
    squares = np.array([y @ q @ y for q in forms])
    expected = np.array([[np.trace(z.T @ q @ z) for z in (za, zb, np.eye(len(y)))] for q in forms])
    for name, theirs in zip(("between_seeds", "between_trees", "within_tree"), np.linalg.solve(expected, squares)):
        same(case["components"][name]["raw"], theirs, f"{where}: {name}")
        same(case["components"][name]["variance"], max(0.0, theirs), f"{where}: {name}")


def one_way(case, where):
    """One tree a group: the analysis of variance is that of scipy."""
    groups = {}
    for row in case["values"]:
        groups.setdefault(row["tree"], []).append(row["value"])
    sizes = {len(group) for group in groups.values()}
    assert len(sizes) == 1, f"{where}: not balanced"
    within, between = (case["components"][name]["raw"] for name in ("within_tree", "between_trees"))
    same((within + sizes.pop() * between) / within, stats.f_oneway(*groups.values()).statistic, f"{where}: F")


def bootstrap(case, where):
    shares = np.array(case["trees"])
    ratios = np.array([np.divide(*shares[drawn].sum(axis=0)) for drawn in case["resamples"]])
    tail = (1 - case["confidence"]) / 2
    for ours, theirs in zip(case["interval"], np.quantile(ratios, [tail, 1 - tail])):
        same(ours, theirs, where)


def percentile(case, where):
    """One seed, a mean: scipy's own percentile interval, by its own random numbers."""
    values = np.array(case["trees"])[:, 0]
    theirs = stats.bootstrap(
        (values,), np.mean, n_resamples=20000, confidence_level=case["confidence"], method="percentile", rng=1
    )
    # Ends of 20,000 and of 10,000 resamples each stray by sqrt(p (1 - p) / N) / density: 0.019 and 0.027 standard errors. Five of both.
    slack = 5 * np.hypot(0.019, 0.027) * theirs.standard_error
    for ours, end in zip(case["interval"], theirs.confidence_interval):
        assert abs(ours - end) < slack, f"{where}: {ours}, scipy {end} +- {slack}"


def ranked(case, where):
    scores = np.array([score for score, _ in case["predictions"]])
    right = np.array([truth for _, truth in case["predictions"]])
    # scikit-learn knows only positives with a prediction; those without lower every recall by the same factor.
    found = right.sum() / case["positives"]
    same(case["average_precision"], found * metrics.average_precision_score(right, scores), f"{where}: AP")
    precision, recall, thresholds = metrics.precision_recall_curve(right, scores)
    theirs = {score: (p, found * r) for score, p, r in zip(thresholds, precision, recall)}
    for point in case["curve"]:
        for ours, own in zip((point["precision"], point["recall"]), theirs[point["score"]]):
            same(ours, own, f"{where}: curve at {point['score']}")
    share, mean = calibration.calibration_curve(right, scores, n_bins=len(case["bins"]), strategy="uniform")
    filled = [row for row in case["bins"] if row["n"]]
    # On the edge of two bins scikit-learn takes the lower one: scores there are left out.
    if not np.isin(np.round(scores * len(case["bins"]), 9) % 1, [0]).any():
        assert len(filled) == len(share), f"{where}: {len(filled)} bins, scikit-learn {len(share)}"
        for row, own_share, own_mean in zip(filled, share, mean):
            same(row["right"], own_share, f"{where}: share right")
            same(row["mean_score"], own_mean, f"{where}: mean score")


KINDS = {
    "wilcoxon": wilcoxon,
    "permutation": permutation,
    "effects": effects,
    "holm": holm,
    "components": components,
    "one_way": one_way,
    "bootstrap": bootstrap,
    "percentile": percentile,
    "ranked": ranked,
}


def main():
    for file in sys.argv[1:]:
        with open(file, encoding="utf-8") as text:
            cases = json.load(text)
        for kind, compare in KINDS.items():
            assert cases[kind], f"{file}: no case of {kind}"
            for i, case in enumerate(cases[kind]):
                compare(case, f"{kind} {i}")
        assert set(cases) == set(KINDS), f"{file}: {set(cases) ^ set(KINDS)} is not compared"
        print(f"{sum(len(cases[kind]) for kind in KINDS)} cases agree with scipy {scipy.__version__}")


main()
