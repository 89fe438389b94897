"""Compare pose estimates computed from the same particles: `python tests/unit/stack/localizers/measure_estimates.py`.

All estimators use the particles of one filter, because the estimate has no effect on the filter.
"""

import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from unittest import mock

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from estimate_drives import CIRCUMSTANCES, Case, case

from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers import particle_filter
from simscen.stack.localizers.particles import Particles, cluster_labels, pose_errors, summarize
from simscen.stack.localizers.resampling import bin_keys

TUNING_WORLDS = ("house", "corridor", "pillars", "symmetric")
"""Worlds on which the shipped estimator was tuned."""
TEST_WORLDS = ("office", "warehouse", "clutter", "house coarse")
Estimator = Callable[[Particles], Pose2]


def mean_near_best(particles: Particles) -> Pose2:
    """Return the mean of the particles within 0.25 m and 10° of the best one of a cluster (Rekleitis 2004)."""
    labels = cluster_labels(bin_keys(particles.poses))
    heaviest = labels == np.bincount(labels, weights=particles.weights).argmax()
    center = particles.poses[np.where(heaviest, particles.weights, -1.0).argmax()]
    errors = pose_errors(center, particles.poses)
    is_near = heaviest & (np.hypot(errors[:, 0], errors[:, 1]) <= 0.25) & (np.abs(errors[:, 2]) <= np.deg2rad(10))
    return Pose2(*(center + particles.weights[is_near] @ errors[is_near] / particles.weights[is_near].sum()))


def heaviest_mean(power: float) -> Estimator:
    """Return the estimator that weights the heaviest cluster by the weights to this power; nav2_amcl uses 1."""

    def estimate(particles: Particles) -> Pose2:
        labels = cluster_labels(bin_keys(particles.poses))
        is_heaviest = labels == np.bincount(labels, weights=particles.weights).argmax()
        x, y, yaw = particles.poses[is_heaviest].T
        weights = (particles.weights[is_heaviest] / particles.weights[is_heaviest].max()) ** power
        weights /= weights.sum()
        return Pose2(weights @ x, weights @ y, np.arctan2(weights @ np.sin(yaw), weights @ np.cos(yaw)))

    return estimate


def shipped(peak_power: float) -> Estimator:
    """Return simscen's estimator with this parameter."""
    return lambda particles: summarize(particles, peak_power)[0]


ESTIMATORS: Mapping[str, Estimator] = {
    "near the best": mean_near_best,
    "mean": heaviest_mean(1),
    "power 16": heaviest_mean(16),
    "shipped, power 4": shipped(4),
    "shipped, power 8": shipped(8),
    "shipped, power 16": shipped(16),
    "shipped, power 24": shipped(24),
}


def beliefs(drive: Case, estimators: Mapping[str, Estimator]) -> dict[str, Array]:
    """Return the poses (k, 3) of each estimator during a drive: the last estimate, moved by the odometry since then."""
    localizer, latest, is_corrected = drive.localizer(), {}, False

    def apply_estimators(particles: Particles, peak_power: float) -> tuple[Pose2, Array]:
        nonlocal is_corrected, latest
        is_corrected, latest = True, {name: estimate(particles) for name, estimate in estimators.items()}
        return summarize(particles, peak_power)

    poses_by_name: dict[str, list[Pose2]] = {name: [] for name in estimators}
    anchors: dict[str, Pose2] = {}
    with mock.patch.object(particle_filter, "summarize", apply_estimators):
        for odometry, scan in drive.readings():
            localizer.on_odometry(odometry)
            localizer.on_scan(scan)
            if is_corrected:
                anchors = {name: pose.compose(odometry.pose.inverse()) for name, pose in latest.items()}
                is_corrected = False
            for name, anchor in anchors.items():
                poses_by_name[name].append(anchor.compose(odometry.pose))
    return {name: np.array(poses) for name, poses in poses_by_name.items()}


def figures(estimates: Array, truth: Array) -> tuple[float, float, float]:
    """Return the RMSE in m, the largest error in m, and the number of jumps of the estimate by more than 1 m."""
    distance = np.hypot(*(estimates - truth)[:, :2].T)
    jumps = np.hypot(*np.diff(estimates[:, :2], axis=0).T) > 1
    return float(np.sqrt(np.mean(distance**2))), float(distance.max()), float(jumps.sum())


def measure(worlds: Iterable[str], circumstance: str, model: str, seeds: Iterable[int]) -> dict[str, Array]:
    """Return the figures (drives, 3) of each estimator for drives in all worlds with all seeds."""
    rows: dict[str, list[tuple[float, float, float]]] = {name: [] for name in ESTIMATORS}
    for world in worlds:
        for seed in seeds:
            drive = case(world, circumstance, model, seed)
            for name, estimates in beliefs(drive, ESTIMATORS).items():
                rows[name].append(figures(estimates, drive.recording.truth))
    return {name: np.array(row) for name, row in rows.items()}


def main() -> None:
    """Print the figures for the worlds on which the estimator was tuned, and for other worlds."""
    for worlds in (TUNING_WORLDS, TEST_WORLDS):
        for model in ("likelihood_field", "likelihood_field_prob", "beam"):
            for circumstance in CIRCUMSTANCES:
                print(f"\n{', '.join(worlds)}: {model}, {circumstance}")
                for name, rows in measure(worlds, circumstance, model, range(1, 2 if model == "beam" else 5)).items():
                    (rmse, largest, _), worst = rows.mean(axis=0), rows[:, 1].max()
                    print(f"  {name:14} RMSE {rmse:.3f} m, largest error {largest:.2f} m (worst drive {worst:.2f}), "
                          f"{np.sum(rows[:, 1] > 1)} of {len(rows)} ever more than 1 m off, {rows[:, 2].sum():.0f} "
                          "jumps of more than 1 m", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
