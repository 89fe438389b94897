"""Specification of conditions: comparisons of signals, combined by operators of signal temporal logic (STL)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from simscen.criteria.trace_signals.catalog import SIGNALS, Signal, SignalName
from simscen.spec.base import Spec
from simscen.spec.extensible_union import BehaviorName
from simscen.spec.places import DisturbanceName, EventName, GoalName, MoverName, ObjectName, PlaceOrPoint, RegionName
from simscen.spec.quantities import UNITS, AnyQuantity, Duration, PositiveDuration, Quantity

Op = Literal[">=", ">", "<=", "<"]
OPERATORS = ("signal", "all", "any", "not_", "always", "eventually", "until", "whenever")
"""Fields of a condition. Exactly one of them must be given."""
ARGUMENT_KEYS = ("object", "point", "goal", "region", "fault", "event", "recovery", "with_")
"""Fields of a condition that contain arguments of the signal."""


class Condition(Spec):
    """Statement that is true or false at each time of a run: a comparison of a signal, or a combination of conditions.

    Exactly one of the keys signal, all, any, not, always, eventually, until, and whenever must be given. `then` belongs
    to whenever; all other keys belong to signal.
    """

    signal: SignalName | None = None
    """Name of a signal; `simscen explain signals` lists them."""
    op: Op | None = None
    """Comparison of the signal with `value`; omitted for a yes-or-no signal."""
    value: Annotated[float, AnyQuantity()] | None = None
    """Bound, with a unit or in SI units."""
    scale: Annotated[float, AnyQuantity()] | None = None
    """Divisor of the margins of this signal. It makes signals with different units comparable."""
    object: MoverName | None = None
    """Movable object to which the signal `distance_to` is measured."""
    point: PlaceOrPoint | None = None
    """Point to which the signal `distance_to` is measured: x and y in meters, or a place by name."""
    goal: GoalName | None = None
    """Goal for the signals `distance_to` and `goal_active`."""
    region: RegionName | None = None
    """Region for the signal `in_region`."""
    fault: DisturbanceName | None = None
    """Fault for the signals `fault_active` and `started`, e.g. `lidar.off`."""
    event: EventName | None = None
    """Event for the signals `event_active` and `started`."""
    recovery: BehaviorName | None = None
    """Recovery behavior for the signal `recovery_active`."""
    with_: ObjectName | None = Field(default=None, alias="with")
    """Object for the signal `in_collision`."""
    all: Annotated[list[Condition], Field(min_length=1, max_length=50)] | None = None
    """True while all conditions of this list are true."""
    any: Annotated[list[Condition], Field(min_length=1, max_length=50)] | None = None
    """True while at least one condition of this list is true."""
    not_: Condition | None = Field(default=None, alias="not")
    """True while the given condition is false."""
    always: WindowedCondition | None = None
    """True if the given condition is true at all times of its window."""
    eventually: WindowedCondition | None = None
    """True if the given condition is true at least once in its window."""
    until: UntilOperands | None = None
    """True if `release` becomes true in its window, and `hold` is true until then."""
    whenever: Condition | None = None
    """True if the condition `then` is true at all times at which the given condition is true, until the end of the run.
    Undecided if the given condition is never true."""
    then: Condition | None = None
    """Condition that must be true at all times at which the condition of `whenever` is true."""

    @field_validator("op", mode="before")
    @classmethod
    def _check_operator(cls, op: Any) -> Any:
        if op in ("==", "=", "!="):
            raise ValueError(f"`{op}` is unsuitable for measured values; use `<=` and `>=` around the value")
        return op

    @field_validator("value", "scale", mode="before")
    @classmethod
    def _parse_value(cls, value: Any, info: ValidationInfo) -> Any:
        name = info.data.get("signal")
        dimension = SIGNALS[name].dimension if name else _dimension_of(value)  # a misspelled signal is reported once
        return Quantity(dimension).parse(value) if dimension in UNITS else value

    @model_validator(mode="after")
    def _check_keys(self) -> Condition:
        given = [name.rstrip("_") for name in OPERATORS if getattr(self, name) is not None]
        if not given:
            raise ValueError(f"expected one of: {', '.join(name.rstrip('_') for name in OPERATORS)}")
        if len(given) > 1:
            raise ValueError(f"only one of {', '.join(given)} may be given here")
        if (self.whenever is None) != (self.then is None):
            raise ValueError("`whenever` and `then` must be given together")
        if self.signal is None:
            wrong = [name for name in ("op", "value", "scale", *ARGUMENT_KEYS) if getattr(self, name) is not None]
            if wrong:
                raise ValueError(f"`{wrong[0].rstrip('_')}` belongs to a signal, not to `{given[0]}`")
        else:
            _check_signal(self, self.signal, SIGNALS[self.signal])
        return self

    @property
    def definition(self) -> Signal:
        """Definition of the compared signal. Raises AssertionError if the condition is not a comparison."""
        assert self.signal is not None
        return SIGNALS[self.signal]

    @property
    def arguments(self) -> dict[str, Any]:
        """The arguments of the signal, by YAML key."""
        return {name.rstrip("_"): value for name in ARGUMENT_KEYS if (value := getattr(self, name)) is not None}

    def comparisons(self) -> Iterator[Condition]:
        """Yield all comparisons in this condition; the condition itself if it is a comparison."""
        if self.signal is not None:
            yield self
        for part in self.parts():
            yield from part.comparisons()

    def parts(self) -> list[Condition]:
        """Return the operands of this condition; empty for a comparison."""
        until = () if self.until is None else (self.until.hold, self.until.release)
        single = (self.not_, self.always, self.eventually, *until, self.whenever, self.then)
        return [*(self.all or ()), *(self.any or ()), *(part for part in single if part is not None)]


class Window(Spec):
    """Interval of time in which a condition is evaluated. Without any key, the window lasts to the end of the run.

    The times of a window count from the start of the run or, in a nested condition, from the time at which the
    condition around it is evaluated.
    """

    within: PositiveDuration | None = None
    """Length of the window, which begins at the start of the run (in a nested condition: at its evaluation)."""
    after: PositiveDuration | None = None
    """Time from the start of the run (in a nested condition: from its evaluation) to the start of the window. Such a
    window lasts until the end of the run."""
    between: Annotated[list[Duration], Field(min_length=2, max_length=2)] | None = None
    """Times from the start of the run (in a nested condition: from its evaluation) to the start and to the end of the
    window."""

    @model_validator(mode="after")
    def _check_interval(self) -> Window:
        given = [name for name in ("within", "after", "between") if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"only one of {', '.join(given)} may be given here")
        if self.between is not None and self.between[0] >= self.between[1]:
            raise ValueError(f"the window from {self.between[0]:g} s to {self.between[1]:g} s is empty")
        return self

    @property
    def interval(self) -> tuple[float, float | None]:
        """Start and end of the window in s after the evaluation. An end of None is the end of the run."""
        if self.between is not None:
            return self.between[0], self.between[1]
        return self.after or 0.0, self.within


class WindowedCondition(Window, Condition):
    """Condition, and the window in which it is evaluated."""


class Whenever(WindowedCondition):
    """Whenever one condition (the premise) is true, another condition (the response, `then`) is true as well.

    For a response within some seconds, write `then: {eventually: {…, within: 2 s}}`.

    What is measured: the distance of each signal from its bound, at each sample of the truth. At each sample, the larger
        of two margins counts: the margin of the response and the margin of the negated premise. The margin of the
        criterion is the smallest of these values.
    When it fails: at a sample, the premise was true and the response was false.
    Why this: a robot that is lost, blind, or too close to something must react in time, and each time.
    Source: the bounded response pattern of Dwyer, Avrunin and Corbett 1999; robust semantics of Donzé and Maler 2010.

    Inconclusive if the run ended while a response was still due. Also inconclusive if the premise was never true,
    because nothing was tested; with `required: false`, such a run passes.

    Example: `{whenever: {signal: scan_age, op: ">", value: 0.3 s}, then: {eventually: {signal: speed, op: "<", value: 1 cm/s, within: 1 s}}}`
    """  # noqa: E501 (an example is on one line)

    required: bool = True
    """Whether the premise must be true at least once. With `false`, a run passes if the premise was never true."""


class UntilOperands(Window):
    """Operands of `until`: `hold` must be true until `release` becomes true, which must happen in the window."""

    hold: Condition
    """Condition that must be true at all times before the release."""
    release: Condition
    """Condition that must become true. From then on, `hold` may be false."""


def _dimension_of(value: Any) -> str:
    """Return the dimension of the unit at the end of a text, e.g. "length" for "2 m"; "" if the unit is unknown."""
    *_, unit = ("", *str(value).split(maxsplit=1))
    return next((dimension for dimension, units in UNITS.items() if unit in units), "")


def _check_signal(condition: Condition, name: str, signal: Signal) -> None:
    """Raise ValueError if the keys of a comparison do not match the signal, or if the result is always the same."""
    arguments = condition.arguments
    unknown = [key for key in arguments if key not in (*signal.alternative_arguments, *signal.optional_arguments)]
    if unknown:
        raise ValueError(f"`{name}` takes no `{unknown[0]}`")
    if signal.alternative_arguments and len(arguments) != 1:
        raise ValueError(f"`{name}` needs exactly one of: {', '.join(signal.alternative_arguments)}")
    if signal.is_boolean:
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
    """Raise ValueError if a comparison is true, or false, for all values between minimum and maximum of the signal."""
    minimum, maximum, unit = signal.minimum, signal.maximum, f" {signal.unit}".rstrip()
    never_below = {">=": value <= minimum, ">": value < minimum, "<": value <= minimum, "<=": value < minimum}[op]
    never_above = {"<=": value >= maximum, "<": value > maximum, ">": value >= maximum, ">=": value > maximum}[op]
    if never_below or never_above:
        where = f"below {minimum:g}{unit}" if never_below else f"above {maximum:g}{unit}"
        frequency = "always" if (op in (">=", ">")) == never_below else "never"
        raise ValueError(f"`{name}` is never {where}, so `{op} {value:g}{unit}` is {frequency} true")


for _model in (Condition, WindowedCondition, Whenever, UntilOperands):
    _model.model_rebuild()  # the models refer to each other, and criteria in other modules derive from them


def decision_horizon(condition: Condition, holds: bool = True) -> float:
    """Return the earliest time at which a condition can be known to be true, in s after the start of its evaluation.

    If `holds` is False, return the earliest time at which the condition can be known to be false. A window that lasts
    to the end of the run counts only with its start.
    """
    if condition.all is not None or condition.any is not None:
        needs_all = (condition.all is not None) == holds
        times = [decision_horizon(part, holds) for part in condition.all or condition.any or ()]
        return max(times) if needs_all else min(times)
    if condition.not_ is not None:
        return decision_horizon(condition.not_, not holds)
    if condition.always is not None:
        return _window_horizon(condition.always, condition.always, holds, needs_whole_window=holds)
    if condition.eventually is not None:
        return _window_horizon(condition.eventually, condition.eventually, holds, needs_whole_window=not holds)
    if condition.until is not None:
        return condition.until.interval[0] + decision_horizon(condition.until.release) if holds else 0.0
    if isinstance(condition.whenever, Whenever) and condition.then is not None:
        response = _window_horizon(condition.then, condition.whenever, holds, needs_whole_window=holds)
        if condition.whenever.required or not holds:
            return response
        return min(response, _window_horizon(condition.whenever, condition.whenever, False, needs_whole_window=True))
    return 0.0


def _window_horizon(part: Condition, window: Window, holds: bool, needs_whole_window: bool) -> float:
    """Return the end of the window, or its start if one sample can decide, plus the `decision_horizon` of `part`."""
    begin, end = window.interval
    return (end if needs_whole_window and end is not None else begin) + decision_horizon(part, holds)
