"""Specifications of the events and faults of a scenario."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

from pydantic import Discriminator, Field, Tag, model_validator

from simscen.actions.base import AnyAction
from simscen.faults.base import AnyFault
from simscen.spec.base import Spec, one_or_several
from simscen.spec.places import Name
from simscen.spec.quantities import PositiveDuration
from simscen.triggers.base import Trigger

Actions = Annotated[
    Annotated[AnyAction, Tag("one value")]
    | Annotated[Annotated[list[AnyAction], Field(min_length=1, max_length=50)], Tag("several values")],
    Discriminator(one_or_several),
]


class StepEntry(Spec):
    """Step of the sequence (`then`) of an event. It becomes active when the previous step has happened.

    The trigger of a step measures `time`, `for`, and `travelled` from the previous step. Everything that was logged
    before the previous step, such as goals, replans, and reactions of pedestrians, does not count.
    """

    name: Name | None = None
    """Name in reports and other triggers; default: the name of the event with `then 1`, `then 2`, …"""
    when: Trigger | None = None
    """Trigger; default: the step happens immediately."""
    do: Actions | None = None
    """Action, or list of actions in order. Without actions, the step only waits for its trigger."""
    required: bool | None = None
    """Whether the run fails if this step never happens; default: as for the previous step."""

    @model_validator(mode="after")
    def _check_not_empty(self) -> "StepEntry":
        if self.when is None and self.do is None:
            raise ValueError("expected when, do, or both")
        if self.when is not None and self.when.times > 1:
            raise ValueError("a step of a sequence happens only once: `times` is not valid here")
        return self


class EventEntry(Spec):
    """Event: when the trigger (`when`) fires, the actions (`do`) happen, followed by the steps of `then`."""

    name: Name | None = None
    """Name in reports and other triggers; default: event-1, event-2, …"""
    when: Trigger
    """Trigger of the event."""
    do: Actions | None = None
    """Action, or list of actions in order; optional if there is `then`."""
    then: Annotated[list[StepEntry], Field(max_length=50)] = []
    """Sequence of further steps; each becomes active when the previous one has happened."""
    required: bool = True
    """Whether the run fails if this event never happens: its trigger does not fire, its `probability` prevents it, or
    one of its actions has no effect."""

    @model_validator(mode="after")
    def _check_not_empty(self) -> "EventEntry":
        if self.do is None and not self.then:
            raise ValueError("expected do, or then")
        if self.then and self.when.times > 1:
            raise ValueError("a sequence runs only once: `times` and `then` exclude each other")
        return self


@dataclass(frozen=True)
class SequenceStep:
    """Event, or step of the sequence (`then`) of an event.

    `keys` lead to the step in the scenario, e.g. ("events", 0, "then", 1). `after` is the index of the previous step of
    the sequence in the list that `steps_of` returns; None for an event.
    """

    name: str
    keys: tuple[str | int, ...]
    entry: EventEntry | StepEntry
    required: bool
    after: int | None = None

    @property
    def when(self) -> Trigger | None:
        """Trigger; None if the step happens immediately after the previous one."""
        return self.entry.when

    @property
    def actions(self) -> list["LocatedAction"]:
        """Actions in order."""
        do, keys = self.entry.do, (*self.keys, "do")
        if isinstance(do, list):
            return [LocatedAction(self, (*keys, number, action.kind), action) for number, action in enumerate(do)]
        return [] if do is None else [LocatedAction(self, (*keys, do.kind), do)]


class LocatedAction(NamedTuple):
    """Action of an event or step. `keys` lead to the specification of the action: ("events", 0, "do", "spawn").

    `choice` is the action with its key in YAML, e.g. `spawn: {…}`.
    """

    step: SequenceStep
    keys: tuple[str | int, ...]
    choice: AnyAction

    @property
    def kind(self) -> str:
        """Key of the action in YAML, e.g. "spawn"."""
        return self.choice.kind

    @property
    def spec(self) -> Any:
        """Specification under this key."""
        return self.choice.chosen


def steps_of(events: Sequence[EventEntry]) -> list[SequenceStep]:
    """Return the events of a scenario in order, each followed by the steps of its sequence."""
    steps: list[SequenceStep] = []
    for index, event in enumerate(events):
        name = event.name or f"event-{index + 1}"
        steps.append(SequenceStep(name, ("events", index), event, event.required))
        for number, entry in enumerate(event.then):
            required = steps[-1].required if entry.required is None else entry.required
            step_name = entry.name or f"{name} then {number + 1}"
            steps.append(SequenceStep(step_name, ("events", index, "then", number), entry, required, len(steps) - 1))
    return steps


class FaultEntry(AnyFault):
    """Fault of a sensor, the commands, the wheels, the localizer, or the map."""

    modifiers: ClassVar[frozenset[str]] = frozenset({"sensor", "when", "for_", "name", "required"})

    sensor: Name
    """Target of the fault: a sensor by its name in the robot's `sensors`, or `cmd_vel`, `wheels`, `localizer`, or
    `map`."""
    name: Name | None = None
    """Name in reports and criteria; default: `<sensor>.<fault>`, e.g. `lidar.off`."""
    when: Trigger | None = None
    """Trigger that starts the fault; default: the start of the run."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """Duration; default: until the end of the run."""
    required: bool = True
    """Whether the run fails if this fault has no effect: its trigger does not fire, its `probability` prevents it, or
    it ends before it changes a message or a command."""

    @property
    def label(self) -> str:
        """Name of the fault in events and criteria."""
        return self.name or f"{self.sensor}.{self.kind}"
