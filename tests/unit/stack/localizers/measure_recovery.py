"""Measure the effect of the recovery threshold of AMCL: `python tests/unit/stack/localizers/measure_recovery.py`.

Random particles are added only if at least this fraction of random poses explains recent scans better.
"""

import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from estimate_drives import BUILDINGS, Case, case

from simscen.core.geometry import Array
from simscen.stack.localizers import augmented_mcl

RECOVERING = {"max_particles": 5000, "recovery_alpha_slow": 0.001, "recovery_alpha_fast": 0.1}
THRESHOLDS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4)
FOUND_M, FINAL_ROWS = 0.5, 50
"""A robot is found if its error stays below this distance in the last rows (tenths of a second) of a drive."""


def position_errors(drive: Case) -> Array:
    """Return the distances (k,) in m of the belief from the true position."""
    localizer, beliefs = drive.localizer(), []
    for odometry, scan in drive.readings():
        localizer.on_odometry(odometry)
        localizer.on_scan(scan)
        beliefs.append(localizer.belief.pose)
    error: Array = np.hypot(*(np.array(beliefs) - drive.recording.truth)[:, :2].T)
    return error


def drives(circumstance: str, model: str, seeds: Iterable[int], buildings: Sequence[str] = BUILDINGS) -> list[Case]:
    """Return a drive for each building and seed, for a localizer with recovery."""
    cases = [case(name, circumstance, model, seed) for name in buildings for seed in seeds]
    return [replace(drive, spec=drive.spec.model_copy(update=RECOVERING)) for drive in cases]


def main() -> None:
    """Print for each threshold how many lost robots are found, and the errors of robots with a known start."""
    for model in ("likelihood_field", "likelihood_field_prob"):
        sets = {name: drives(name, model, range(11, 15)) for name in ("kidnapped", "unknown", "crowded")}
        for threshold in THRESHOLDS:
            with mock.patch.object(augmented_mcl, "MIN_BETTER_FRACTION", threshold):
                found = {
                    name: sum(bool((position_errors(drive)[-FINAL_ROWS:] < FOUND_M).all()) for drive in sets[name])
                    for name in ("kidnapped", "unknown")
                }
                errors = [position_errors(drive) for drive in sets["crowded"]]
            rmse = np.array([np.sqrt(np.mean(error**2)) for error in errors])
            print(f"{model}, {threshold:.0%}: kidnapped {found['kidnapped']}, unknown {found['unknown']} of "
                  f"{len(errors)} found; among people RMSE {rmse.mean():.3f} m (worst {rmse.max():.2f}), "
                  f"{sum(error.max() > 1 for error in errors)} ever more than 1 m off", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
