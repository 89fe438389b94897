"""Test of the advanced stack in narrow fields with odometry drift."""

from pathlib import Path

import pytest

from simscen.bench.navigation.obstacle_fields import write_narrow_fields
from simscen.core.records.events import EventKind
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import PreparedScenario, prepare
from simscen.run.simulate import simulate

ADVANCED = """\
simscen: 1
extends: {field}
stack: {{profile: advanced}}
"""
SLIP = "faults: [{sensor: odom, slip: {left: 12 %, right: 6 %}}]\n"


def duration_s(prepared: PreparedScenario, seed: int) -> float:
    """Return the duration of a run that reaches its goal without a collision."""
    trace = simulate(prepared, seed).trace
    kinds = [event.kind for event in trace.events]
    assert EventKind.GOAL_REACHED in kinds
    assert EventKind.COLLISION_STARTED not in kinds
    return trace.seconds(trace.end)


@pytest.mark.slow
def test_odometry_drift_of_a_meter_hardly_slows_narrow_fields(tmp_path: Path) -> None:
    """The sums of six drives are compared, because the durations of single drives vary."""
    _, experiment, _ = write_narrow_fields(tmp_path, [9101, 9102, 9103])
    without_slip_s = with_slip_s = 0.0
    for drive in experiment.drives:
        field = drive.file.name
        plain_file, slip_file = (drive.file.with_name(f"{name}_{field}") for name in ("plain", "slipping"))
        plain_file.write_text(ADVANCED.format(field=field))
        slip_file.write_text(ADVANCED.format(field=field) + SLIP)
        without_slip_s += 2 * duration_s(prepare(load_scenario(plain_file, tmp_path)), 1)
        with_slip = prepare(load_scenario(slip_file, tmp_path))
        with_slip_s += duration_s(with_slip, 2) + duration_s(with_slip, 5)
    assert with_slip_s < 1.3 * without_slip_s
