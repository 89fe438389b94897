"""Comparison of localizers on sparse logs: generated logs with a scan only every 1 m or 0.5 rad, as in public logs."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from simscen.advanced.spec import ScanMatchingAmcl
from simscen.bench.localization.campaign import localize_in_log
from simscen.bench.localization.generated_logs import Log, generate_log
from simscen.core.geometry import Pose2, wrap
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.model.localizers import Amcl, AmclParameters
from simscen.record.localization_logs.read import LocalizationLog

RECOVERY_PARAMETERS = {"recovery_alpha_slow": 0.001, "recovery_alpha_fast": 0.1}
"""Parameters that let AMCL add random particles. The values are those of nav2_amcl's documentation."""
LOCALIZERS: Mapping[str, AmclParameters] = {
    "likelihood_field": Amcl(laser_model_type="likelihood_field"),
    "likelihood_field, recovery": Amcl.model_validate({"laser_model_type": "likelihood_field", **RECOVERY_PARAMETERS}),
    "amcl": Amcl(),
    "amcl, recovery": Amcl.model_validate(RECOVERY_PARAMETERS),
    "scan_matching_amcl": ScanMatchingAmcl(),
}
"""Variants of AMCL to compare, by name."""
SEED_COUNT = 5
"""Number of seeds with which each localizer runs on each log."""
MIN_SCAN_SPACING_M, MIN_SCAN_SPACING_RAD = 1.0, 0.5
"""Minimum translation, or minimum rotation, between two scans of a sparse log."""
DURATION_S = 180.0
"""Duration of a log before it is shortened to end after a turn."""
MIN_END_TURN_RAD = 1.0
"""Minimum rotation over the last three scans of a log that ends after a turn."""
MISSED_TURN_FRACTION, MISSED_TURN_STD_RAD = 0.05, 0.6
"""Fraction of the scans after which odometry misses a turn, and standard deviation of the missed angle.

The odometry of the public log MIT CSAIL has such errors.
"""
MISSED_TURNS_KIND = "as mapped, turns that odometry misses"
"""Kind of the logs in which odometry misses turns."""
KINDS: Mapping[str, tuple[str, bool]] = {
    "as mapped, slipping wheels": ("slipping", False),
    MISSED_TURNS_KIND: ("slipping", False),
    "people, moved furniture, glass": ("tracked", False),
    "the same, ends after a turn": ("tracked", True),
    "half rebuilt": ("outdated", False),
    "half a map": ("half", False),
}
"""Kinds of sparse logs by name: circumstance (a key of CIRCUMSTANCES), and whether the log ends after a turn."""


@dataclass(frozen=True)
class SparseTrial:
    """Result of one localizer with one seed on one log. The names of the fields are keys of the JSON output.

    `kind` is a key of KINDS, `localizer` a key of LOCALIZERS. `median` is the median position error in m, and `end` is
    the last position error in m. `lost` is true if any position error exceeded LOST_ERROR_M of campaign.py.
    """

    kind: str
    localizer: str
    building: int
    seed: int
    median: float
    end: float
    lost: bool


def thin_scans(log: Log, ends_after_turn: bool) -> Log:
    """Return the log with fewer scans, at least MIN_SCAN_SPACING_M or MIN_SCAN_SPACING_RAD apart.

    With `ends_after_turn`, the log ends at the last scan that follows a turn of MIN_END_TURN_RAD. Without such a turn,
    the log is not shortened.
    """
    readings: list[Odometry | Scan] = []
    selected: list[tuple[int, Pose2]] = []  # tick and odometry of each selected scan
    odometry, end = Pose2(0.0, 0.0, 0.0), 0
    for reading in log.recording.readings:
        if isinstance(reading, Odometry):
            odometry = reading.pose
        elif isinstance(reading, Scan):
            if selected:
                last = selected[-1][1]
                turned = abs(wrap(odometry.yaw - last.yaw))
                if last.distance(odometry) < MIN_SCAN_SPACING_M and turned < MIN_SCAN_SPACING_RAD:
                    continue
            selected.append((reading.tick, odometry))
            if len(selected) > 2 and abs(wrap(odometry.yaw - selected[-3][1].yaw)) > MIN_END_TURN_RAD:
                end = reading.tick
        readings.append(reading)
    if not ends_after_turn or not end:
        return replace(log, recording=replace(log.recording, readings=readings))
    until_end = log.recording.ticks <= end
    recording = LocalizationLog(
        [reading for reading in readings if reading.tick <= end],
        log.recording.ticks[until_end],
        log.recording.truth[until_end],
    )
    return replace(log, recording=recording)


def with_missed_turns(log: Log) -> Log:
    """Return the log with odometry that misses a random turn after some scans (see MISSED_TURN_FRACTION)."""
    rng = Streams(log.building).generator("missed turns")
    readings: list[Odometry | Scan] = []
    previous, reported, turn = Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0), 0.0
    for reading in log.recording.readings:
        if isinstance(reading, Odometry):
            step, previous = previous.between(reading.pose), reading.pose
            reported, turn = reported.compose(Pose2(step.x, step.y, step.yaw + turn)), 0.0
            readings.append(replace(reading, pose=reported))
        elif isinstance(reading, Scan):
            turn = float(rng.normal(0.0, MISSED_TURN_STD_RAD)) if rng.random() < MISSED_TURN_FRACTION else 0.0
            readings.append(reading)
    return replace(log, recording=replace(log.recording, readings=readings))


def generate_sparse_log(kind: str, building: int) -> Log:
    """Generate the sparse log of a kind (a key of KINDS) in a building. The result depends on the arguments only."""
    circumstance, ends_after_turn = KINDS[kind]
    log = thin_scans(generate_log(building, building, circumstance, DURATION_S), ends_after_turn)
    return with_missed_turns(log) if kind == MISSED_TURNS_KIND else log


def run_sparse_logs(buildings: Sequence[int], workers: int) -> Iterator[Sequence[SparseTrial]]:
    """Run all localizers on sparse logs of all KINDS in all buildings. Yield the trials of one log after the other."""
    logs = [(kind, building) for kind in KINDS for building in buildings]
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(run_sparse_log, *zip(*logs, strict=True))


def run_sparse_log(kind: str, building: int) -> Sequence[SparseTrial]:
    """Run all LOCALIZERS with all seeds on one sparse log."""
    log = generate_sparse_log(kind, building)
    trials = []
    for name, localizer in LOCALIZERS.items():
        for seed in range(1, SEED_COUNT + 1):
            _, errors = localize_in_log(log, localizer, seed)
            figures, lost = errors.figures(), bool(errors.lost)
            trials.append(SparseTrial(kind, name, building, seed, figures["median"], figures["final"], lost))
    return trials


def sparse_table(trials: Sequence[SparseTrial]) -> list[tuple[str, ...]]:
    """Return a table with a header row, a row for each kind of log, and a column for each localizer.

    A cell has the number of lost trials, and the medians over all trials of the median error and of the final error.
    """
    rows = [("log", *LOCALIZERS)]
    for kind in KINDS:
        groups = [[trial for trial in trials if (trial.kind, trial.localizer) == (kind, name)] for name in LOCALIZERS]
        rows.append((kind, *map(_cell, groups)))
    return rows


def _cell(trials: Sequence[SparseTrial]) -> str:
    lost = sum(trial.lost for trial in trials)
    median, end = (float(np.median([getattr(trial, name) for trial in trials])) for name in ("median", "end"))
    return f"{lost} of {len(trials)}, {median:.2f} m, {end:.2f} m"
