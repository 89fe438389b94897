"""Tests of the garbage collection threshold, which is higher during runs without plug-ins."""

import gc
from dataclasses import replace
from pathlib import Path

import pytest

from simscen.loading.scenario import load_scenario
from simscen.run import run_files
from simscen.run.preparation import prepare
from simscen.spec.registry import RegisteredType

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
stack: {localizer: {type: ground_truth}}
time_limit: 0.5 s
pass: [collisions: {max: 0}]
"""


class SimulationStarted(Exception):
    """Raised in place of the simulation; contains the threshold of the garbage collector."""


@pytest.fixture
def thresholds():
    before = gc.get_threshold()
    yield before
    gc.set_threshold(*before)


@pytest.mark.parametrize("has_plugins", [False, True])
def test_garbage_collection_threshold_is_not_changed_if_a_run_has_plugins(
    thresholds: tuple[int, int, int], has_plugins: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object, **__: object) -> None:
        raise SimulationStarted(gc.get_threshold()[0])

    monkeypatch.setattr(run_files, "simulate", stop)
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    package = RegisteredType("planner", "theirs", "theirs:Planner", distribution="theirs", version="1.0")
    prepared = replace(
        prepare(load_scenario(tmp_path / "a.scenario.yaml", tmp_path)), plugins=(package,) if has_plugins else ()
    )
    with pytest.raises(SimulationStarted) as raised:
        run_files.execute_run(prepared, 1, tmp_path, (), lambda *_: None)
    assert raised.value.args == ((thresholds[0] if has_plugins else run_files.GC_THRESHOLD),)
