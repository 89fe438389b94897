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
    """Compare sums, because single drives vary. With samples everywhere, six drives take 1.7 times as long."""
    _, twenty_centimeters, _ = write_narrow_fields(tmp_path, [9101, 9102, 9103])
    without_slip = slipping = 0.0
    for drive in twenty_centimeters.drives:
        field = drive.file.name
        plain, slips = (drive.file.with_name(f"{name}_{field}") for name in ("plain", "slipping"))
        plain.write_text(ADVANCED.format(field=field))
        slips.write_text(ADVANCED.format(field=field) + SLIP)
        without_slip += 2 * duration_s(prepare(load_scenario(plain, tmp_path)), 1)
        drifting = prepare(load_scenario(slips, tmp_path))
        slipping += duration_s(drifting, 2) + duration_s(drifting, 5)
    assert slipping < 1.3 * without_slip
