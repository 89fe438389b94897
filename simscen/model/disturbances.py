"""Events and faults as a scenario lists them: something happens when a trigger fires."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import Discriminator, Field, Tag, model_validator

from simscen.actions.registry import AnyAction
from simscen.faults.registry import AnyFault
from simscen.spec.base import Spec
from simscen.spec.places import Name
from simscen.spec.quantities import PositiveDuration
from simscen.triggers.registry import Trigger


def _one_or_several(value: Any) -> str:
    return "several" if isinstance(value, list) else "one"


Actions = Annotated[
    Annotated[AnyAction, Tag("one")]
    | Annotated[Annotated[list[AnyAction], Field(min_length=1, max_length=50)], Tag("several")],
    Discriminator(_one_or_several),
]


class StepEntry(Spec):
    """A step of a story: it is waited for only once the step before it has happened.

    What it waits for counts from there: `time` and `for` are seconds since then, `travelled` is the way since then, and
    of goals, replans, recoveries, collisions and events only those since then count.
    """

    name: Name | None = None
    """What reports and other triggers call it; default: that of its event with `then 1`, `then 2`, …"""
    when: Trigger | None = None
    """What it waits for; default: it happens at once."""
    do: Actions | None = None
    """One action, or several in order; default: the next step waits from here."""
    required: bool | None = None
    """Whether the run fails when this never happened; default: as the step before it."""

    @model_validator(mode="after")
    def _waits_or_does(self) -> "StepEntry":
        if self.when is None and self.do is None:
            raise ValueError("expected when, do, or both")
        if self.when is not None and self.when.times > 1:
            raise ValueError("a step of a story happens once: `times` has no place in it")
        return self


class EventEntry(Spec):
    """Something that happens in the world: `do` it `when` the trigger fires, `then` go on with the story."""

    name: Name | None = None
    """What reports and other triggers call it; default: event-1, event-2, …"""
    when: Trigger
    """What it waits for."""
    do: Actions | None = None
    """One action, or several in order; may be left out before `then`."""
    then: Annotated[list[StepEntry], Field(max_length=50)] = []
    """What happens after it, step by step: each is waited for only once the one before it has happened."""
    required: bool = True
    """Whether the run fails when this never happened: its trigger never fired, an action of it changed nothing, or
    its `probability` was not drawn. `false` where it may stay away."""

    @model_validator(mode="after")
    def _something_happens(self) -> "EventEntry":
        if self.do is None and not self.then:
            raise ValueError("expected do, or then")
        if self.then and self.when.times > 1:
            raise ValueError("a story is told once: `times` and `then` exclude each other")
        return self


@dataclass(frozen=True)
class Step:
    """An event, or a step of its story, as the run takes it: `after` is the number of the step that it waits for.

    `keys` are where it stands in the scenario.
    """

    name: str
    keys: tuple[str | int, ...]
    entry: EventEntry | StepEntry
    required: bool
    after: int | None = None

    @property
    def when(self) -> Trigger | None:
        """What it waits for; None: nothing but the step before it."""
        return self.entry.when

    @property
    def actions(self) -> list[AnyAction]:
        """What to do, in order."""
        return [action for _, action in self.placed()]

    def placed(self) -> Iterator[tuple[tuple[str | int, ...], AnyAction]]:
        """The actions in order, each with where it stands."""
        if isinstance(self.entry.do, list):
            yield from (((*self.keys, "do", number), action) for number, action in enumerate(self.entry.do))
        elif self.entry.do is not None:
            yield (*self.keys, "do"), self.entry.do


def steps_of(events: Sequence[EventEntry]) -> list[Step]:
    """Each event, and after it the steps of its story."""
    steps: list[Step] = []
    for index, event in enumerate(events):
        name = event.name or f"event-{index + 1}"
        steps.append(Step(name, ("events", index), event, event.required))
        for number, entry in enumerate(event.then):
            required = steps[-1].required if entry.required is None else entry.required
            called = entry.name or f"{name} then {number + 1}"
            steps.append(Step(called, ("events", index, "then", number), entry, required, len(steps) - 1))
    return steps


class FaultEntry(AnyFault):
    """Something that goes wrong with a sensor, the base, the localizer or the map."""

    modifiers: ClassVar[frozenset[str]] = frozenset({"sensor", "when", "for_", "name", "required"})

    sensor: Name
    """What it affects: a sensor, by its name in the robot's `sensors`; `cmd_vel`, `wheels`, `localizer` or `map`."""
    name: Name | None = None
    """What reports and criteria call it; default: `<sensor>.<fault>`, e.g. `lidar.off`."""
    when: Trigger | None = None
    """When it begins; default: at the start."""
    for_: PositiveDuration | None = Field(default=None, alias="for")
    """How long it lasts; default: to the end."""
    required: bool = True
    """Whether the run fails when this never happened: its trigger never fired, its `probability` was not drawn, or it
    was over before it changed a message or a command. `false` where it may stay away."""

    @property
    def label(self) -> str:
        """Its name in events and criteria."""
        return self.name or f"{self.sensor}.{self.kind}"
