"""What was seen before odometry drifted lies beside what is seen now: no reason to swing between two ways."""

from pathlib import Path

from simscen.core.events import EventKind
from simscen.loading.scenario import load_scenario
from simscen.run.prepare import Prepared, prepare
from simscen.run.simulate import simulate
from simscen.study.experiments import narrow_fields

SLIPPING = """\
simscen: 1
extends: {field}
faults:
  - {{sensor: odom, slip: {{left: 12 %, right: 6 %}}}}
"""


def seconds(prepared: Prepared, seed: int) -> float:
    """Until the robot was through."""
    trace = simulate(prepared, seed).trace
    kinds = [event.kind for event in trace.events]
    assert EventKind.GOAL_REACHED in kinds
    assert EventKind.COLLISION_STARTED not in kinds
    return trace.seconds(trace.end)


def test_a_narrow_field_takes_hardly_longer_with_odometry_that_drifts_a_metre(tmp_path: Path) -> None:
    _, twenty_centimetres, _ = narrow_fields(tmp_path, [9102])
    field = twenty_centimetres.drives[0].file
    slipping = field.with_name("slipping.scenario.yaml")
    slipping.write_text(SLIPPING.format(field=field.name))
    true = seconds(prepare(load_scenario(field, tmp_path)), 1)
    drifting = prepare(load_scenario(slipping, tmp_path))
    for seed in (2, 5):
        assert seconds(drifting, seed) < 1.5 * true
