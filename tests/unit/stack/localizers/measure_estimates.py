"""Measures what a cloud of particles is best summed up as: `python tests/unit/stack/localizers/measure_estimates.py`.

The same particles are summed up in several ways, for the estimate does not change what the filter does next.
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
from simscen.stack.localizers.resampling import bins

CHOSEN_ON = ("house", "corridor", "pillars", "symmetric")
HELD_OUT = ("office", "warehouse", "clutter", "house coarse")
Estimator = Callable[[Particles], Pose2]


def near_the_best(particles: Particles) -> Pose2:
    """The mean of the particles within 0.25 m and 10° of the best one of the heaviest cluster (Rekleitis 2004)."""
    labels = cluster_labels(bins(particles.poses))
    heaviest = labels == np.bincount(labels, weights=particles.weights).argmax()
    center = particles.poses[np.where(heaviest, particles.weights, -1.0).argmax()]
    near = pose_errors(center, particles.poses)
    kept = heaviest & (np.hypot(near[:, 0], near[:, 1]) <= 0.25) & (np.abs(near[:, 2]) <= np.deg2rad(10))
    return Pose2(*(center + particles.weights[kept] @ near[kept] / particles.weights[kept].sum()))


def heaviest_mean(power: float) -> Estimator:
    """The mean of the heaviest cluster with weights to this power; 1 is nav2_amcl's."""

    def estimate(particles: Particles) -> Pose2:
        labels = cluster_labels(bins(particles.poses))
        kept = labels == np.bincount(labels, weights=particles.weights).argmax()
        x, y, yaw = particles.poses[kept].T
        weights = (particles.weights[kept] / particles.weights[kept].max()) ** power
        weights /= weights.sum()
        return Pose2(weights @ x, weights @ y, np.arctan2(weights @ np.sin(yaw), weights @ np.cos(yaw)))

    return estimate


def both(peak_power: float) -> Estimator:
    """The shipped one."""
    return lambda particles: summarize(particles, peak_power)[0]


ESTIMATORS: Mapping[str, Estimator] = {
    "near the best": near_the_best,
    "mean": heaviest_mean(1),
    "power 16": heaviest_mean(16),
    "both, power 4": both(4),
    "both, power 8": both(8),
    "both, power 16": both(16),
    "both, power 24": both(24),
}


def beliefs(drive: Case, estimators: Mapping[str, Estimator]) -> dict[str, Array]:
    """What each estimator believes (k, 3) all along a drive: its last estimate, carried on by odometry."""
    subject, latest, corrected = drive.localizer(), {}, False

    def summed_up(particles: Particles, peak_power: float) -> tuple[Pose2, Array]:
        nonlocal corrected, latest
        corrected, latest = True, {name: estimate(particles) for name, estimate in estimators.items()}
        return summarize(particles, peak_power)

    found: dict[str, list[Pose2]] = {name: [] for name in estimators}
    anchors: dict[str, Pose2] = {}
    with mock.patch.object(particle_filter, "summarize", summed_up):
        for odometry, scan in drive.readings():
            subject.on_odometry(odometry)
            subject.on_scan(scan)
            if corrected:
                anchors = {name: pose.compose(odometry.pose.inverse()) for name, pose in latest.items()}
                corrected = False
            for name, anchor in anchors.items():
                found[name].append(anchor.compose(odometry.pose))
    return {name: np.array(poses) for name, poses in found.items()}


def figures(believed: Array, truth: Array) -> tuple[float, float, float]:
    """RMSE, largest error, and how often the belief jumped by more than a meter between two beats."""
    off = np.hypot(*(believed - truth)[:, :2].T)
    jumps = np.hypot(*np.diff(believed[:, :2], axis=0).T) > 1
    return float(np.sqrt(np.mean(off**2))), float(off.max()), float(jumps.sum())


def measured(worlds: Iterable[str], circumstance: str, model: str, seeds: Iterable[int]) -> dict[str, Array]:
    """Figures (drives, 3) of each estimator."""
    rows: dict[str, list[tuple[float, float, float]]] = {name: [] for name in ESTIMATORS}
    for world in worlds:
        for seed in seeds:
            drive = case(world, circumstance, model, seed)
            for name, believed in beliefs(drive, ESTIMATORS).items():
                rows[name].append(figures(believed, drive.way.truth))
    return {name: np.array(row) for name, row in rows.items()}


def main() -> None:
    """Prints a table for the worlds that the power was chosen on, and one for those that it was not."""
    for worlds in (CHOSEN_ON, HELD_OUT):
        for model in ("likelihood_field", "likelihood_field_prob", "beam"):
            for circumstance in CIRCUMSTANCES:
                print(f"\n{', '.join(worlds)}: {model}, {circumstance}")
                for name, rows in measured(worlds, circumstance, model, range(1, 2 if model == "beam" else 5)).items():
                    (rmse, most, _), worst = rows.mean(axis=0), rows[:, 1].max()
                    print(f"  {name:14} RMSE {rmse:.3f} m, largest error {most:.2f} m (worst drive {worst:.2f}), "
                          f"{np.sum(rows[:, 1] > 1)} of {len(rows)} ever more than 1 m off, {rows[:, 2].sum():.0f} "
                          "jumps of more than 1 m", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
