"""One scenario said once and run for many values: `variations:`."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, StringConstraints, Tag, model_validator

from simscen.spec.base import Spec, Value
from simscen.spec.choice import Choice
from simscen.spec.quantities import AnyAmount

MOST = 1000
"""Variations of one scenario."""

ValuePath = Annotated[str, StringConstraints(min_length=1, max_length=500)]
"""Where a value of the scenario stands: `robot.pose.x`, `goals[0].pose`, `goals.shelf.pose`."""
Values = Annotated[list[Any], Field(min_length=1, max_length=MOST)]
Interval = Annotated[tuple[AnyAmount, AnyAmount], Field(strict=False)]


class Normal(Spec):
    """Values around a mean, as tolerances and noise are spread.

    Example: `normal: {mean: 0.5 m/s, std: 5 cm/s, min: 0.3 m/s}`
    """

    mean: AnyAmount
    """The middle."""
    std: AnyAmount
    """The standard deviation."""
    min: AnyAmount | None = None
    """Nothing below this is drawn; the shape above stays as it is."""
    max: AnyAmount | None = None
    """Nothing above this is drawn."""


class Uniform(Value[Interval]):
    """Any value between two, each as likely as the other.

    Example: `uniform: [0.5 m, 1.5 m]`
    """


class LogUniform(Value[Interval]):
    """Any value between two, each order of magnitude as likely as the other.

    Example: `log_uniform: [1 mm, 1 m]`
    """


class Integer(Value[Annotated[tuple[int, int], Field(strict=False)]]):
    """A whole number from the first to the last, both included.

    Example: `integer: [1, 6]`
    """


class OneOf(Value[Values]):
    """One of these, each as likely as the other.

    Example: `choice: [turtlebot, amr]`
    """


class Draw(Choice):
    """How a value is drawn."""

    uniform: Uniform | None = None
    log_uniform: LogUniform | None = None
    normal: Normal | None = None
    integer: Integer | None = None
    choice: OneOf | None = None


class Sampled(Spec):
    """Values that are drawn, the same ones every time.

    The k-th value of a path depends on the seed, the path and k alone: more of them, or another path, change none that
    were there. Numbers are rounded to six digits.
    """

    count: Annotated[int, Field(ge=1, le=MOST)]
    """How many variations."""
    seed: Annotated[int, Field(ge=1, le=2**32 - 1)] = 1
    """Of these draws alone; the runs keep the scenario's."""
    method: Literal["random", "latin_hypercube"] = "random"
    """`latin_hypercube` spreads each path's values evenly over its range; another `count` then changes all of them."""
    values: Annotated[dict[ValuePath, Draw], Field(min_length=1, max_length=50)]
    """How the value of each path is drawn."""


class VariationBlock(Spec):
    """Values to run a scenario with, by their paths.

    Several of these kinds side by side are combined, each of one with each of the others.
    """

    grid: Annotated[dict[ValuePath, Values] | None, Field(min_length=1, max_length=50)] = None
    """Every combination of the values of each path."""
    pairs: Annotated[dict[ValuePath, Values] | None, Field(min_length=1, max_length=50)] = None
    """The first values of all paths together, then the second ones, and so on: lists of the same length."""
    list_: Annotated[list[dict[str, Any]] | None, Field(min_length=1, max_length=MOST, alias="list")] = None
    """Each variation as a mapping from paths to values, with a `name` if you like."""
    sampled: Sampled | None = None
    """Values that are drawn from ranges."""

    @model_validator(mode="after")
    def _something(self) -> "VariationBlock":
        if self.grid is None and self.pairs is None and self.list_ is None and self.sampled is None:
            raise ValueError("expected one of: grid, pairs, list, sampled")
        return self


class Variations(
    Value[
        Annotated[
            Annotated[VariationBlock, Tag("one")]
            | Annotated[Annotated[list[VariationBlock], Field(max_length=50)], Tag("several")],
            Discriminator(lambda value: "several" if isinstance(value, list) else "one"),
        ]
    ]
):
    """Values to run the scenario with, each a run of its own; a list of such blocks is run one after the other.

    `[]` is none, whatever a file that is extended has.
    """

    @property
    def blocks(self) -> list[VariationBlock]:
        """One after the other."""
        return self.root if isinstance(self.root, list) else [self.root]


class VariedSpec(Spec):
    """What a scenario says of its variations, apart from all else."""

    variations: Variations
