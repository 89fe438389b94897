"""Test of narrow fields with odometry drift."""

from pathlib import Path

import pytest

from simscen.bench.navigation.experiments import write_narrow_fields
from simscen.core.records.events import EventKind
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import PreparedScenario, prepare
from simscen.run.simulate import simulate

SLIPPING = """\
simscen: 1
extends: {field}
faults:
  - {{sensor: odom, slip: {{left: 12 %, right: 6 %}}}}
"""


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
        slips = drive.file.with_name(f"slipping_{drive.file.name}")
        slips.write_text(SLIPPING.format(field=drive.file.name))
        without_slip += 2 * duration_s(prepare(load_scenario(drive.file, tmp_path)), 1)
        drifting = prepare(load_scenario(slips, tmp_path))
        slipping += duration_s(drifting, 2) + duration_s(drifting, 5)
    assert slipping < 1.3 * without_slip
