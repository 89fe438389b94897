"""Property tests of the order in which events and faults start and end, against an evaluation of the whole history."""

from collections import defaultdict
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from simscen.core.clock import Clock
from simscen.core.geometry.kinematics import Twist
from simscen.core.random_streams import Streams
from simscen.core.records.disturbances import Disturbance
from simscen.core.records.events import Event
from simscen.judge.disturbances import disturbance_outcomes
from simscen.model.disturbances import EventEntry, FaultEntry, steps_of
from simscen.run.live_world.director import Director
from simscen.testing.fakes import FakeStage
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

BEAT_TICKS = 24
RARELY = st.sampled_from([False, False, False, True])
"""Whether a trigger has a modifier. With many modifiers, most steps of a sequence would never start."""
Scenario = tuple[list[dict[str, Any]], list[dict[str, Any]]]
"""Events and faults as in a scenario file."""
Drive = tuple[list[bool], list[float]]
"""For each beat, whether the robot is fast, and the driven distance in m."""
HALF_BEATS = st.integers(1, 8).map(lambda n: n / 20)
"""Durations in s, in steps of half a beat."""


@st.composite
def conditions(draw: Any, names: list[str], depth: int = 1) -> dict[str, Any]:
    """Return a condition, which can be a combination of other conditions, with or without `for`."""
    kinds = ["time", "travelled", "speed_above", "event"] + (["all", "any", "not"] if depth else [])
    condition: dict[str, Any]
    match kind := draw(st.sampled_from(kinds)):
        case "time":
            condition = {kind: draw(HALF_BEATS)}
        case "travelled":
            condition = {kind: draw(st.integers(0, 6)) / 4}
        case "speed_above":
            condition = {kind: 0.5}
        case "event":
            status = draw(st.sampled_from(["started", "ended"]))
            condition = {kind: {"name": draw(st.sampled_from(names)), "status": status}}
        case "not":
            condition = {kind: draw(conditions(names, depth - 1))}
        case _:
            condition = {kind: draw(st.lists(conditions(names, depth - 1), min_size=1, max_size=2))}
    return condition | ({"for": draw(HALF_BEATS)} if draw(RARELY) else {})


@st.composite
def triggers(draw: Any, names: list[str], may_repeat: bool) -> dict[str, Any]:
    """Return a trigger: a condition with or without an edge, a delay, and repetitions."""
    trigger = draw(conditions(names))
    if draw(RARELY):
        trigger["edge"] = "falling"
    if draw(RARELY):
        trigger["delay"] = draw(HALF_BEATS)
    if may_repeat and draw(st.booleans()):
        trigger["times"] = draw(st.integers(2, 3))
    return trigger


@st.composite
def scenarios(draw: Any) -> Scenario:
    """Return events with sequences, and faults, which can wait for each other."""
    lengths = draw(st.lists(st.integers(0, 3), min_size=1, max_size=3))
    names = [f"event-{k + 1}" for k in range(len(lengths))]
    names += [f"event-{k + 1} then {n + 1}" for k, length in enumerate(lengths) for n in range(length)]
    names += ["a mark", "lidar.off", "odom.off"]
    actions = st.sampled_from([{}, {"do": {"mark": {"name": "a mark"}}}])
    events = []
    for length in lengths:
        steps = []
        for _ in range(length):
            step = draw(actions)
            steps.append(
                {**step, **({"when": draw(triggers(names, False))} if not step or draw(st.booleans()) else {})}
            )
        mark = {} if steps else {"do": {"mark": {"name": "a mark"}}}
        events.append({"when": draw(triggers(names, not steps)), "then": steps, **mark, **draw(actions)})
    faults = [
        {"sensor": sensor, "off": {}, "when": draw(triggers(names, True)), "for": draw(HALF_BEATS)}
        for sensor in draw(st.sampled_from([[], ["lidar"], ["lidar", "odom"]]))
    ]
    return events, faults


@st.composite
def drives(draw: Any) -> Drive:
    """Return a drive of 10 to 25 beats."""
    fast = draw(st.lists(st.booleans(), min_size=10, max_size=25))
    steps = draw(st.lists(st.integers(0, 2), min_size=len(fast), max_size=len(fast)))
    return fast, [sum(steps[:k]) / 4 for k in range(len(fast))]


class RecordingStage(FakeStage):
    """A stage that adds recorded events to its events."""

    def record_event(self, event: Event) -> None:
        self.events += (replace(event, tick=self.tick),)

    record_world_event = record_event


@dataclass
class Entry:
    """An event, a step, or a fault of the oracle.

    first_beat: beat from which the entry is due (None: not due yet)
    first_line: length of the log when the entry became due
    """

    name: str
    trigger: dict[str, Any]
    first_beat: int | None = 0
    first_line: int = 0


class Oracle:
    """Computes the log of a scenario from the definitions in docs/guides/disturbances.md.

    It searches all beats for edges, instead of tracking a state. `visible` is the length of the log when an entry was
    evaluated at a beat.
    """

    def __init__(self, fast: list[bool], travelled: list[float]) -> None:
        self.fast, self.travelled = fast, travelled
        self.log: list[tuple[int, str, str]] = []
        self.visible: dict[tuple[str, int], int] = {}

    def run(self, events: list[dict[str, Any]], faults: list[dict[str, Any]]) -> list[tuple[int, str, str]]:
        sequences = []
        for number, event in enumerate(events):
            name = f"event-{number + 1}"
            sequence = [(Entry(name, event["when"]), event)]
            for n, step in enumerate(event["then"]):
                trigger = step.get("when", {"time": 0})
                sequence.append((Entry(f"{name} then {n + 1}", trigger, first_beat=None), step))
            sequences.append(sequence)
        fault_entries = [(Entry(f"{fault['sensor']}.off", fault["when"]), fault) for fault in faults]
        ends: dict[str, float] = {}
        for beat in range(len(self.fast)):
            for sequence in sequences:
                for position, (entry, fields) in enumerate(sequence):
                    for _ in range(self.firings(entry, beat)):
                        self.write(beat, "event.started", entry.name)
                        if "do" in fields:
                            self.write(beat, "mark", "a mark")
                        self.write(beat, "event.ended", entry.name)
                        for next_entry, _ in sequence[position + 1 : position + 2]:
                            next_entry.first_beat, next_entry.first_line = beat, len(self.log)
            for name in [f"{fault['sensor']}.off" for fault in faults]:
                if name in ends and beat * BEAT_TICKS >= ends[name]:
                    del ends[name]
                    self.write(beat, "fault.ended", name)
            for entry, fault in fault_entries:
                if self.firings(entry, beat) and entry.name not in ends:
                    ends[entry.name] = beat * BEAT_TICKS + fault["for"] * 240
                    self.write(beat, "fault.started", entry.name)
        return self.log

    def write(self, beat: int, kind: str, name: str) -> None:
        self.log.append((beat * BEAT_TICKS, kind, name))

    def firings(self, entry: Entry, beat: int) -> int:
        """Return how often the trigger fires at the beat: how many of the first `times` edges are `delay` ago."""
        if entry.first_beat is None:
            return 0
        self.visible[entry.name, beat] = len(self.log)
        is_rising, delay = entry.trigger.get("edge") != "falling", entry.trigger.get("delay", 0) * 240
        holds = [self.holds(entry.trigger, entry, k) for k in range(entry.first_beat, beat + 1)]
        edges = [k for k, now in enumerate(holds) if now == is_rising and now != (k > 0 and holds[k - 1])]
        first = [(entry.first_beat + edge) * BEAT_TICKS + delay for edge in edges[: entry.trigger.get("times", 1)]]
        return sum((beat - 1) * BEAT_TICKS < tick <= beat * BEAT_TICKS for tick in first)

    def holds(self, condition: dict[str, Any], entry: Entry, beat: int) -> bool:
        """Return whether the condition has been true for the time `for`."""
        assert entry.first_beat is not None
        start = beat + 1
        while start > entry.first_beat and self.is_true(condition, entry, start - 1):
            start -= 1
        return start <= beat and (beat - start) * BEAT_TICKS >= condition.get("for", 0) * 240

    def is_true(self, condition: dict[str, Any], entry: Entry, beat: int) -> bool:
        """Return whether the condition is true at the beat. Times and distances count from `entry.first_beat`."""
        assert entry.first_beat is not None
        match condition:
            case {"time": seconds}:
                return (beat - entry.first_beat) * BEAT_TICKS >= seconds * 240
            case {"travelled": length}:
                return self.travelled[beat] - self.travelled[entry.first_beat] >= length
            case {"speed_above": _}:
                return self.fast[beat]
            case {"event": {"name": name, "status": status}}:
                visible_lines = self.log[entry.first_line : self.visible[entry.name, beat]]
                kinds = {f"event.{status}", f"fault.{status}", "mark"}
                return any(kind in kinds and event_name == name for _, kind, event_name in visible_lines)
            case {"all": parts}:
                return all(self.holds(part, entry, beat) for part in parts)
            case {"any": parts}:
                return any(self.holds(part, entry, beat) for part in parts)
            case {"not": part}:
                return not self.holds(part, entry, beat)
        raise AssertionError(condition)


def play(scenario: Scenario, drive: Drive) -> RecordingStage:
    """Return the stage after the drive."""
    events, faults = scenario
    stage = RecordingStage(clock=Clock(240))
    injector: Any = SimpleNamespace(begin=lambda index: "Scan", end=lambda index: 1)
    director = Director(
        steps_of([EventEntry.model_validate(event) for event in events]),
        [FaultEntry.model_validate(fault) for fault in faults],
        Streams(1),
        stage,  # type: ignore[arg-type]
        injector,
    )
    for beat, (is_fast, travelled) in enumerate(zip(*drive, strict=True)):
        stage.tick, stage.twist, stage.travelled = beat * BEAT_TICKS, Twist(float(is_fast)), travelled
        director.process_beat()
    return stage


@settings(deadline=None, max_examples=300)
@given(scenarios(), drives())
def test_events_and_faults_start_and_end_as_the_guide_defines(scenario: Scenario, drive: Drive) -> None:
    log = [(event.tick, str(event.kind), event.name) for event in play(scenario, drive).events]
    assert log == Oracle(*drive).run(*scenario)


@settings(deadline=None)
@given(scenarios(), drives())
def test_event_has_happened_if_it_started_before_the_end(scenario: Scenario, drive: Drive) -> None:
    stage, starts = play(scenario, drive), defaultdict(list)
    for tick, kind, name in Oracle(*drive).run(*scenario):
        if kind == "event.started":
            starts[name].append(tick)
    steps = steps_of([EventEntry.model_validate(event) for event in scenario[0]])
    trace = replace(synthetic_trace({"seconds": 1, "truth": [[0, 0, 0]]}), events=stage.events, end=stage.tick)
    disturbances = tuple(Disturbance(step.name, "event", "time: 1", after=step.after) for step in steps)
    for outcome in disturbance_outcomes(trace, replace(synthetic_case({}), disturbances=disturbances)):
        ticks = starts[outcome.disturbance.name]
        assert list(outcome.fired) == ticks
        assert outcome.happened == any(tick < stage.tick for tick in ticks)
