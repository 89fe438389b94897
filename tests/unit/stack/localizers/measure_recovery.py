"""Measures what recovery's threshold finds and costs: `python tests/unit/stack/localizers/measure_recovery.py`."""

import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from estimate_drives import BUILDINGS, Case, case

from simscen.core.geometry import Array
from simscen.stack.localizers import resampling

RECOVERING = {"max_particles": 5000, "recovery_alpha_slow": 0.001, "recovery_alpha_fast": 0.1}
THRESHOLDS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4)
FOUND_WITHIN, LAST = 0.5, 50
"""Meters, and how many tenths of a second at the end of a drive."""


def off(drive: Case) -> Array:
    """Distances (k,) of the belief from the truth."""
    subject, beliefs = drive.localizer(), []
    for odometry, scan in drive.readings():
        subject.on_odometry(odometry)
        subject.on_scan(scan)
        beliefs.append(subject.belief.pose)
    error: Array = np.hypot(*(np.array(beliefs) - drive.way.truth)[:, :2].T)
    return error


def drives(circumstance: str, model: str, seeds: Iterable[int], buildings: Sequence[str] = BUILDINGS) -> list[Case]:
    """A drive of each building and seed, with recovery."""
    found = [case(name, circumstance, model, seed) for name in buildings for seed in seeds]
    return [replace(one, spec=one.spec.model_copy(update=RECOVERING)) for one in found]


def main() -> None:
    """Prints, for each threshold, how many kidnapped robots are found and what it does to others."""
    for model in ("likelihood_field", "likelihood_field_prob"):
        sets = {name: drives(name, model, range(11, 15)) for name in ("kidnapped", "unknown", "crowded")}
        for threshold in THRESHOLDS:
            with mock.patch.object(resampling, "MIN_BETTER_SHARE", threshold):
                found = {
                    name: sum(bool((off(one)[-LAST:] < FOUND_WITHIN).all()) for one in sets[name])
                    for name in ("kidnapped", "unknown")
                }
                errors = [off(one) for one in sets["crowded"]]
            rmse = np.array([np.sqrt(np.mean(error**2)) for error in errors])
            print(f"{model}, {threshold:.0%}: kidnapped {found['kidnapped']}, unknown {found['unknown']} of "
                  f"{len(errors)} found; among people RMSE {rmse.mean():.3f} m (worst {rmse.max():.2f}), "
                  f"{sum(error.max() > 1 for error in errors)} ever more than 1 m off", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
