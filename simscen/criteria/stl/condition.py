"""Conditions: comparisons of signals, combined by logic and by time, as a user writes them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from simscen.criteria.trace_signals.catalog import SIGNALS, Signal, SignalName
from simscen.spec.base import Spec
from simscen.spec.bytype import BehaviorName
from simscen.spec.named_places import PlaceOrPoint
from simscen.spec.quantities import UNITS, AnyQuantity, Duration, PositiveDuration, Quantity
from simscen.spec.references import EventName, GoalName, HappeningName, MoverName, ObjectName, RegionName

Op = Literal[">=", ">", "<=", "<"]
OPERATORS = ("signal", "all", "any", "not_", "always", "eventually", "until", "whenever")
SIGNAL_ARGUMENTS = ("object", "point", "goal", "region", "fault", "event", "recovery", "with_")


class Condition(Spec):
    """Something that holds or does not at each moment of a run: a signal against a bound, or conditions combined.

    Exactly one of signal, all, any, not, always, eventually, until, whenever; the other keys belong to a signal.
    """

    signal: SignalName | None = None
    """A named signal; `simscen explain signals` lists them."""
    op: Op | None = None
    """How it compares with `value`; left out for a signal that is yes or no."""
    value: Annotated[float, AnyQuantity()] | None = None
    """The bound, with a unit of the signal's dimension or in SI."""
    scale: Annotated[float, AnyQuantity()] | None = None
    """How much of it weighs as much as one scale of another signal; the margin then counts in scales."""
    object: MoverName | None = None
    """What `distance_to` is measured to: a thing that can move."""
    point: PlaceOrPoint | None = None
    """What `distance_to` is measured to: x and y in metres, or a place by name."""
    goal: GoalName | None = None
    """The goal that `distance_to` or `goal_active` is about."""
    region: RegionName | None = None
    """The region that `in_region` is about."""
    fault: HappeningName | None = None
    """The fault that `fault_active` or `started` is about, e.g. `lidar.off`."""
    event: EventName | None = None
    """The event that `event_active` or `started` is about."""
    recovery: BehaviorName | None = None
    """The recovery that `recovery_active` is about."""
    with_: ObjectName | None = Field(default=None, alias="with")
    """The thing that `in_collision` is about."""
    all: Annotated[list[Condition], Field(min_length=1, max_length=50)] | None = None
    """Holds while all of these do."""
    any: Annotated[list[Condition], Field(min_length=1, max_length=50)] | None = None
    """Holds while at least one of these does."""
    not_: Condition | None = Field(default=None, alias="not")
    """Holds while this does not."""
    always: Windowed | None = None
    """Holds when this does at every moment of the window from now on."""
    eventually: Windowed | None = None
    """Holds when this does at some moment of the window from now on."""
    until: Release | None = None
    """Holds when `hold` does from now on until `release` does."""
    whenever: Condition | None = None
    """With `then` beside it: holds when, from now on, `then` does at every moment at which this does."""
    then: Condition | None = None
    """What must hold whenever `whenever` does."""

    @field_validator("op", mode="before")
    @classmethod
    def _no_equality(cls, op: Any) -> Any:
        if op in ("==", "=", "!="):
            raise ValueError(f"`{op}` never holds for long for what is measured; use `<=` and `>=` around it")
        return op

    @field_validator("value", "scale", mode="before")
    @classmethod
    def _of_the_signals_dimension(cls, value: Any, info: ValidationInfo) -> Any:
        name = info.data.get("signal")
        dimension = SIGNALS[name].dimension if name else _dimension_of(value)  # a misspelt signal is one mistake
        return Quantity(dimension).parse(value) if dimension in UNITS else value

    @model_validator(mode="after")
    def _one_shape(self) -> Condition:
        given = [name.rstrip("_") for name in OPERATORS if getattr(self, name) is not None]
        if not given:
            raise ValueError(f"expected one of: {', '.join(name.rstrip('_') for name in OPERATORS)}")
        if len(given) > 1:
            raise ValueError(f"only one of {', '.join(given)} may be given here")
        if (self.whenever is None) != (self.then is None):
            raise ValueError("`whenever` and `then` belong together")
        if self.signal is None:
            self._no_keys_of_a_signal(given[0])
        else:
            _check_signal(self, self.signal, SIGNALS[self.signal])
        return self

    def _no_keys_of_a_signal(self, shape: str) -> None:
        wrong = [name for name in ("op", "value", "scale", *SIGNAL_ARGUMENTS) if getattr(self, name) is not None]
        if wrong:
            raise ValueError(f"`{wrong[0].rstrip('_')}` belongs to a signal, not to `{shape}`")

    @property
    def measured(self) -> Signal:
        """The signal that it compares. Raises AssertionError for conditions combined."""
        assert self.signal is not None
        return SIGNALS[self.signal]

    @property
    def about(self) -> dict[str, Any]:
        """What the signal is about, by key."""
        return {name.rstrip("_"): told for name in SIGNAL_ARGUMENTS if (told := getattr(self, name)) is not None}

    def comparisons(self) -> Iterator[Condition]:
        """Every comparison of a signal in it, in the order it is written."""
        if self.signal is not None:
            yield self
        for part in self.parts():
            yield from part.comparisons()

    def parts(self) -> list[Condition]:
        """The conditions it is made of."""
        until = () if self.until is None else (self.until.hold, self.until.release)
        single = (self.not_, self.always, self.eventually, *until, self.whenever, self.then)
        return [*(self.all or ()), *(self.any or ()), *(part for part in single if part is not None)]


class Window(Spec):
    """A stretch of time ahead; without any key, all that is left of the run."""

    within: PositiveDuration | None = None
    """From now until so many seconds ahead."""
    after: PositiveDuration | None = None
    """From so many seconds ahead to the end of the run."""
    between: Annotated[list[Duration], Field(min_length=2, max_length=2)] | None = None
    """From so many seconds ahead to so many."""

    @model_validator(mode="after")
    def _one_stretch(self) -> Window:
        given = [name for name in ("within", "after", "between") if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"only one of {', '.join(given)} may be given here")
        if self.between is not None and self.between[0] >= self.between[1]:
            raise ValueError(f"the window from {self.between[0]:g} s to {self.between[1]:g} s is empty")
        return self

    @property
    def stretch(self) -> tuple[float, float | None]:
        """Its begin and its end in seconds ahead; None = the end of the run."""
        if self.between is not None:
            return self.between[0], self.between[1]
        return self.after or 0.0, self.within


class Windowed(Window, Condition):
    """A condition and the stretch of time in which it is looked at."""


class Release(Window):
    """`hold` must hold until `release` does, and `release` must do so in the window."""

    hold: Condition
    """What must hold up to the moment before the release."""
    release: Condition
    """What ends that."""


def _dimension_of(value: Any) -> str:
    """The quantity whose unit a text ends with; "" for none."""
    unit = str(value).split(maxsplit=1)[-1]
    return next((dimension for dimension, units in UNITS.items() if unit in units), "")


def _check_signal(condition: Condition, name: str, signal: Signal) -> None:
    """Raise ValueError for a comparison that does not fit its signal, or that no run can decide either way."""
    about = condition.about
    unknown = [key for key in about if key not in (*signal.about, *signal.perhaps)]
    if unknown:
        raise ValueError(f"`{name}` is not about `{unknown[0]}`")
    if signal.about and len(about) != 1:
        raise ValueError(f"`{name}` needs exactly one of: {', '.join(signal.about)}")
    if signal.asks:
        plain = condition.op is None and condition.value is None
        if condition.scale is not None or not (plain or (condition.op == ">=" and condition.value == 1)):
            raise ValueError(f"`{name}` is yes or no: write it alone, or below `not`")
        return
    if condition.op is None or condition.value is None:
        raise ValueError(f"`{name}` needs `op` and `value`")
    if condition.scale is not None and condition.scale <= 0:
        raise ValueError("`scale` must be greater than 0")
    _check_decidable(condition.op, condition.value, name, signal)


def _check_decidable(op: Op, value: float, name: str, signal: Signal) -> None:
    least, most, unit = signal.least, signal.most, f" {signal.unit}".rstrip()
    never_below = {">=": value <= least, ">": value < least, "<": value <= least, "<=": value < least}[op]
    never_above = {"<=": value >= most, "<": value > most, ">": value >= most, ">=": value > most}[op]
    if never_below or never_above:
        where = f"below {least:g}{unit}" if never_below else f"above {most:g}{unit}"
        sure = "always" if (op in (">=", ">")) == never_below else "never"
        raise ValueError(f"`{name}` is never {where}, so `{op} {value:g}{unit}` {sure} holds")


for _model in (Condition, Windowed, Release):
    _model.model_rebuild()  # they name each other, and the criteria made of them are in other modules


# MERGED: How far ahead of a moment a condition must look before it can be decided.
def decision_horizon(condition: Condition, holds: bool = True) -> float:
    """The least seconds after which it can be known that it holds, or does not.

    A window without an end is decided by the end of the run, whenever that is.
    """
    if condition.all is not None or condition.any is not None:
        every = (condition.all is not None) == holds
        times = [decision_horizon(part, holds) for part in condition.all or condition.any or ()]
        return max(times) if every else min(times)
    if condition.not_ is not None:
        return decision_horizon(condition.not_, not holds)
    if condition.always is not None:
        return window_horizon("always", condition.always, condition.always, holds)
    if condition.eventually is not None:
        return window_horizon("eventually", condition.eventually, condition.eventually, holds)
    if condition.until is not None:
        return until_horizon(condition.until.release, condition.until) if holds else 0.0
    return 0.0


def window_horizon(operator: str, part: Condition, window: Window, holds: bool = True) -> float:
    """Of always or eventually: all of the window, or its first moment."""
    begin, end = window.stretch
    whole = (operator == "always") == holds
    return (begin if not whole or end is None else end) + decision_horizon(part, holds)


def until_horizon(release: Condition, window: Window) -> float:
    """Of a release in a window: its first moment."""
    return window.stretch[0] + decision_horizon(release)
