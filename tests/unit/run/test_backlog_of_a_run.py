"""Test that the moments of a run with plug-ins are recorded immediately."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from simscen.core.records.trace import Moment
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate
from simscen.spec.registry import RegisteredType

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 3, y: 3}}]
stack: {localizer: {type: ground_truth}}
time_limit: 0.5 s
pass: [collisions: {max: 0}]
"""


class RecordingLag:
    """Listener that measures how many ticks the recording in the trace is behind the listeners."""

    def __init__(self) -> None:
        self.max_lag = self.recorded_tick = 0

    def attach(self, rig: Any, listeners: Any) -> Any:
        (trace,) = listeners
        write = trace.append

        def append(moment: Moment) -> None:
            self.recorded_tick = moment.tick
            write(moment)

        trace.append = append
        return (self,)

    def append(self, moment: Moment) -> None:
        self.max_lag = max(self.max_lag, moment.tick - self.recorded_tick)


@pytest.mark.parametrize("has_plugins", [False, True])
def test_moments_are_recorded_immediately_if_a_run_has_plugins(tmp_path: Path, has_plugins: bool) -> None:
    file = tmp_path / "short.scenario.yaml"
    file.write_text(SCENARIO)
    package = RegisteredType("planner", "theirs", "theirs:Planner", distribution="theirs", version="1.0")
    prepared = replace(prepare(load_scenario(file, tmp_path)), plugins=(package,) if has_plugins else ())
    lag = RecordingLag()
    run = simulate(prepared, attach=lag.attach)
    assert (lag.max_lag == 0) == has_plugins
    assert run.trace.truth.ticks[-1] == run.trace.end
