"""Property tests: a run is bit-identical until a fault or event starts."""

import random
import re
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simscen.actions.base import AnyAction
from simscen.core.records.disturbances import KIND_BY_TARGET_NAME, MAP
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Moment
from simscen.faults.base import AnyFault
from simscen.loading.checks.faults import fault_targets, unknown_sensors, unsuitable_faults
from simscen.loading.checks.registry import NameScope
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate
from simscen.spec.base import annotation_of
from simscen.spec.choice import Choice

ROBOT = """\
simscen: 1
name: observer
mass: 2 kg
radius: 0.2 m
body: [{cylinder: [0.2, 0.1], z: 0.03}]
drive: {type: differential, wheel_radius: 0.033, wheel_separation: 0.287, wheel_width: 0.018}
limits: {linear: 0.5, angular: 2.0, linear_acceleration: 1.0, angular_acceleration: 3.2}
sensors:
  lidar: {lidar: {rate: 10 Hz, beams: 90, max_range: 8, mount: {z: 0.18}}}
  odom: {odometry: {rate: 40 Hz}}
  imu: {imu: {rate: 40 Hz}}
  bumper: {bumper: {rate: 40 Hz}}
  camera: {camera: {rate: 5 Hz, width: 8, height: 8}}
"""
SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: east wall, points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]
  objects:
    - {name: cart, box: [0.3, 0.3, 0.5], pose: {x: 4, y: 3.2}}
    - {name: pallet, box: [0.3, 0.3, 0.3], pose: {x: 5.2, y: 3.4}}
  regions:
    hall: [[0, 0], [6, 0], [6, 4], [0, 4]]
    wet floor: [[2, 2], [3, 2], [3, 3], [2, 3]]
    crossing: [[4, 0], [5, 0], [5, 2], [4, 2]]
  doors: [{name: door meeting room, points: [[0.4, 3.95], [0.9, 3.95]], closed: %s}]
robot: {model: observer.robot.yaml, pose: {x: 1, y: 1, yaw: 0.4}}
goals: [{name: end, pose: {x: 5, y: 1}}]
time_limit: %s
faults:%s
events:%s
pass: [{collisions: {max: 5}}]
"""
NEVER = "when: {time: 1 s, probability: 0}, required: false"
UNDISTURBED_S = 2.5
"""Duration of the run without disturbances that all others are compared with."""

FAULT_VALUES = {
    ("noise", "Odometry"): "{linear: 5 cm, angular: 5 deg}",
    ("noise", "Imu"): "{gyro: 0.1 rad/s, accelerometer: 0.5}",
    ("noise", "Image"): "{std: 5 cm, colour: 10 %}",
    ("noise", "Belief"): "{linear: 5 cm, angular: 2 deg}",
    ("bias", "Scan"): "{range: 5 cm}",
    ("bias", "Imu"): "{gyro: 0.05 rad/s}",
    ("bias", "Image"): "{range: 5 cm, brightness: 10 %}",
    ("drift", "Scan"): "{range: 5 cm/s}",
    ("drift", "Image"): "{range: 5 cm/s}",
    ("drift", "Odometry"): "{linear: 2 cm/s}",
    ("drift", "Belief"): "{linear: 5 cm/s}",
    ("extrinsic", "Imu"): "{pitch: 3 deg}",
    ("gain", "Command"): "{linear: 80 %}",
    ("saturation", "Command"): "{linear: 0.2 m/s, angular_acceleration: 0.5}",
}
"""Values of faults whose docstring has an example only for another kind of target."""
ACTIONS: dict[str, str] = {}
"""Values of `do` for actions whose docstring example does not fit the world of SCENARIO."""


def example(choice: type[Choice], key: str) -> str:
    """Return the example in the docstring of a type."""
    text = re.search(r"Example: `(.+)`", annotation_of(choice.model_fields[choice.choices()[key]]).__doc__ or "")
    assert text, f"`{key}` has no example"
    return text[1]


def fault_example(key: str, kind: str) -> str:
    """Return example values of a fault for a kind of target."""
    if (key, kind) in FAULT_VALUES:
        return FAULT_VALUES[key, kind]
    _, _, text = example(AnyFault, key).partition(f"{key}: ")
    depth = [text[: k + 1].count("{") - text[: k + 1].count("}") for k in range(len(text))]
    return text[: depth.index(0) + 1]


def kinds_of(key: str) -> list[str]:
    """Return the kinds of targets that a fault can affect, except the map."""
    affects = annotation_of(AnyFault.model_fields[AnyFault.choices()[key]]).affects
    return sorted(affects - {MAP})  # a fault of the map lasts for the whole run


NAMES = {kind: name for name, kind in KIND_BY_TARGET_NAME.items()}
NAMES |= {"Scan": "lidar", "Odometry": "odom", "Imu": "imu", "Bump": "bumper", "Image": "camera"}
FAULTS = [
    (f"{key} on {NAMES[kind]}", f"{{sensor: {NAMES[kind]}, {key}: {fault_example(key, kind)}, WHEN}}")
    for key in AnyFault.choices()
    for kind in kinds_of(key)
]
EVENTS = [(key, f"{{name: {key}, WHEN, {ACTIONS.get(key) or example(AnyAction, key)}}}") for key in AnyAction.choices()]


@pytest.fixture(scope="module")
def play(tmp_path_factory):
    folder = tmp_path_factory.mktemp("nothing")
    (folder / "observer.robot.yaml").write_text(ROBOT)
    file = folder / "own.scenario.yaml"

    def play(faults: list[str], events: list[str], seconds: float, is_closed: bool = True) -> list[Moment]:
        lists = ["".join(f"\n  - {entry}" for entry in entries) or " []" for entries in (faults, events)]
        file.write_text(SCENARIO % (str(is_closed).lower(), f"{seconds:.3f} s", *lists))
        loaded = load_scenario(file, Path(folder))
        scope = NameScope(loaded)
        assert [*unknown_sensors(scope), *unsuitable_faults(scope)] == []
        log = MomentLog()
        simulate(prepare(loaded), 3, attach=lambda rig, logs: [log])
        return log.moments

    return play


class MomentLog:
    """A log that keeps all moments in memory."""

    def __init__(self) -> None:
        self.moments: list[Moment] = []

    def append(self, moment: Moment) -> None:
        self.moments.append(moment)


@pytest.fixture(scope="module")
def undisturbed(play):
    """Return the moments of runs without disturbances, by whether the door is closed at the start."""
    return {is_closed: play([], [], UNDISTURBED_S, is_closed) for is_closed in (True, False)}


def is_identical(first: Any, second: Any) -> bool:
    """Return whether two objects are bit-identical."""
    if type(first) is not type(second):
        return False
    if isinstance(first, np.ndarray):
        return first.dtype == second.dtype and first.shape == second.shape and first.tobytes() == second.tobytes()
    if isinstance(first, Moment):  # compare samples that are computed on first access by their values
        first, second = (replace(each, sample=each.truth) for each in (first, second))
    if is_dataclass(first):
        return all(is_identical(getattr(first, field.name), getattr(second, field.name)) for field in fields(first))
    if isinstance(first, list | tuple):
        return len(first) == len(second) and all(map(is_identical, first, second))
    if isinstance(first, dict):
        return list(first) == list(second) and all(is_identical(first[key], second[key]) for key in first)
    return repr(first) == repr(second)


def first_tick_of(moments: list[Moment], kind: EventKind) -> int:
    """Return the tick of the first event of a kind."""
    return next(event.tick for moment in moments for event in moment.events if event.kind is kind)


def random_time(name: str) -> float:
    """Return a random time in s for a name, which is the same in each test run."""
    return round(random.Random(name).uniform(0.6, 1.4), 3)


def trigger_at(seconds: float) -> str:
    return f"when: {{time: {seconds} s}}"


def assert_identical_until(moments: list[Moment], undisturbed: list[Moment], tick: int) -> None:
    before = [moment for moment in undisturbed if moment.tick < tick]
    assert before
    for moment, expected in zip(moments, before, strict=False):
        assert is_identical(moment, expected), f"tick {moment.tick}"


@pytest.mark.sample(5)
@pytest.mark.parametrize(("name", "fault"), FAULTS, ids=[name for name, _ in FAULTS])
def test_run_is_unchanged_until_a_fault_starts(play, undisturbed, name: str, fault: str) -> None:
    start = random_time(name)
    moments = play([fault.replace("WHEN", trigger_at(start))], [], start + 0.3)
    assert_identical_until(moments, undisturbed[True], first_tick_of(moments, EventKind.FAULT_STARTED))


@pytest.mark.sample(6)
@pytest.mark.parametrize(("name", "event"), EVENTS, ids=[name for name, _ in EVENTS])
def test_run_is_unchanged_until_an_event_starts(play, undisturbed, name: str, event: str) -> None:
    start, is_closed = random_time(name), name != "close"
    moments = play([], [event.replace("WHEN", trigger_at(start))], start + 0.1, is_closed)
    assert_identical_until(moments, undisturbed[is_closed], first_tick_of(moments, EventKind.EVENT_STARTED))


def test_entries_that_never_start_do_not_change_the_run(play, undisturbed) -> None:
    moments = play(
        [fault.replace("WHEN", NEVER) for _, fault in FAULTS],
        [event.replace("WHEN", NEVER) for _, event in EVENTS],
        UNDISTURBED_S,
    )
    assert len(moments) == len(undisturbed[True])
    for moment, expected in zip(moments, undisturbed[True], strict=True):
        assert is_identical(moment, expected), f"tick {moment.tick}"


MAPS = [
    key for key in AnyFault.choices() if MAP in annotation_of(AnyFault.model_fields[AnyFault.choices()[key]]).affects
]


@pytest.mark.parametrize("key", MAPS)
def test_map_fault_applies_from_the_first_cycle(play, undisturbed, key: str) -> None:
    moments = play([f"{{sensor: map, {key}: {fault_example(key, MAP)}}}"], [], 0.2)
    assert first_tick_of(moments, EventKind.FAULT_STARTED) == first_tick_of(moments, EventKind.FAULT_TOOK_EFFECT) == 0


def test_fault_without_messages_leaves_the_run_unchanged(play) -> None:
    """A delay at a time at which no message is due leaves the run bit-identical."""
    fault = "{sensor: lidar, delay: {latency: 50 ms}, when: {time: 1.01 s}, for: 0.02 s, required: false}"
    plain, late = play([], [], 2.0), play([fault], [], 2.0)
    without_fault_events = [
        replace(moment, events=tuple(e for e in moment.events if not e.kind.startswith("fault."))) for moment in late
    ]
    assert all(map(is_identical, without_fault_events, plain))


def test_every_fault_is_tested_on_each_target(play, tmp_path: Path) -> None:
    (tmp_path / "observer.robot.yaml").write_text(ROBOT)
    file = tmp_path / "own.scenario.yaml"
    file.write_text(SCENARIO % ("true", "1 s", " []", " []"))
    loaded = load_scenario(file, tmp_path)
    assert loaded.robot.spec is not None
    target_kinds = {instance.kind for instance in fault_targets(loaded, loaded.robot.spec).values()}
    affected = {kind for key in AnyFault.choices() for kind in kinds_of(key)}
    assert affected == target_kinds - {MAP}
