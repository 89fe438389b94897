"""Specification of variations (`variations:`): values of a scenario that are combined or drawn at random."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, StringConstraints, Tag, model_validator

from simscen.spec.base import Spec, Value, one_or_several
from simscen.spec.choice import Choice
from simscen.spec.quantities import AnyAmount

MAX_VARIATIONS = 1000
"""Maximum number of variations of a scenario, except in studies."""
MAX_DRAWS = 1_000_000
"""Maximum number of random variations of a scenario in a study."""

ValuePath = Annotated[str, StringConstraints(min_length=1, max_length=500)]
"""Path of a value in the scenario: `robot.pose.x`, `goals[0].pose`, `goals.shelf.pose`."""
Values = Annotated[list[Any], Field(min_length=1, max_length=MAX_VARIATIONS)]
Interval = Annotated[tuple[AnyAmount, AnyAmount], Field(strict=False)]


class Normal(Spec):
    """Normal distribution, optionally truncated.

    Example: `normal: {mean: 0.5 m/s, std: 5 cm/s, min: 0.3 m/s}`
    """

    mean: AnyAmount
    """Mean."""
    std: AnyAmount
    """Standard deviation."""
    min: AnyAmount | None = None
    """Lower bound of the values."""
    max: AnyAmount | None = None
    """Upper bound of the values."""


class Uniform(Value[Interval]):
    """Uniform distribution between two values.

    Example: `uniform: [0.5 m, 1.5 m]`
    """


class LogUniform(Value[Interval]):
    """Log-uniform distribution between two values: each order of magnitude is equally likely.

    Example: `log_uniform: [1 mm, 1 m]`
    """


class Integer(Value[Annotated[tuple[int, int], Field(strict=False)]]):
    """Uniform distribution of whole numbers, including both limits.

    Example: `integer: [1, 6]`
    """


class OneOf(Value[Values]):
    """Random choice of one of several values, which are equally likely.

    Example: `choice: [turtlebot, amr]`
    """


class Draw(Choice):
    """Distribution of a random value."""

    uniform: Uniform | None = None
    log_uniform: LogUniform | None = None
    normal: Normal | None = None
    integer: Integer | None = None
    choice: OneOf | None = None


class Sampled(Spec):
    """Reproducible random values of several paths.

    With `method: random`, value k of a path depends only on the seed, the path, and k. Numbers are rounded to six
    digits.
    """

    count: Annotated[int, Field(ge=1, le=MAX_DRAWS)]
    """Number of variations; more than 1000 only in `simscen study`."""
    seed: Annotated[int, Field(ge=1, le=2**32 - 1)] = 1
    """Seed of these values; the runs keep the seed of the scenario."""
    method: Literal["random", "latin_hypercube", "sobol"] = "random"
    """`random`: independent values, which an `acceptance` claim requires. `latin_hypercube`: the values of each path
    are evenly spread over its range; they change with `count`. `sobol`: the combinations of values are evenly spread (a
    Sobol sequence with a random shift); they change with the set of paths."""
    values: Annotated[dict[ValuePath, Draw], Field(min_length=1, max_length=50)]
    """Distribution of the value of each path."""


class VariationBlock(Spec):
    """Values of a scenario by path.

    If several kinds of values are given, such as `grid` and `pairs`, each variation of one kind is combined with each
    variation of the other kinds.
    """

    grid: Annotated[dict[ValuePath, Values] | None, Field(min_length=1, max_length=50)] = None
    """All combinations of the values of each path."""
    pairwise: Annotated[dict[ValuePath, Values] | None, Field(min_length=1, max_length=50)] = None
    """Few combinations that contain each pair of values of any two paths."""
    pairs: Annotated[dict[ValuePath, Values] | None, Field(min_length=1, max_length=50)] = None
    """Variation k combines value k of each path. All lists must have the same length."""
    list_: Annotated[list[dict[str, Any]] | None, Field(min_length=1, max_length=MAX_VARIATIONS, alias="list")] = None
    """Each variation as a mapping of paths to values, with an optional `name`."""
    sampled: Sampled | None = None
    """Random values."""
    require: Annotated[list[Annotated[str, StringConstraints(max_length=1000)]], Field(max_length=50)] = []
    """Conditions that all variations meet, such as `goals[0].pose.x > robot.pose.x + 1`. Other combinations are left
    out. If the only values are `sampled` with `method: random`, values are drawn until `count` variations meet the
    conditions. Paths may also lead to values that are not varied. Numbers are in SI units; quantities with a unit are
    written in quotes: `time_limit < '2 min'`."""

    @model_validator(mode="after")
    def _check_not_empty(self) -> "VariationBlock":
        if all(values is None for values in (self.grid, self.pairwise, self.pairs, self.list_, self.sampled)):
            raise ValueError("expected one of: grid, pairwise, pairs, list, sampled")
        return self

    @property
    def is_random(self) -> bool:
        """Whether the variations are independent random draws, without other kinds of values."""
        other_kinds = (self.grid, self.pairwise, self.pairs, self.list_)
        has_other_kinds = any(values is not None for values in other_kinds)
        return self.sampled is not None and self.sampled.method == "random" and not has_other_kinds


class Variations(
    Value[
        Annotated[
            Annotated[VariationBlock, Tag("one value")]
            | Annotated[Annotated[list[VariationBlock], Field(max_length=50)], Tag("several values")],
            Discriminator(one_or_several),
        ]
    ]
):
    """Values by path, as one block or a list of blocks. Each combination in a block is a separate run.

    An empty list (`[]`) removes the variations that a file inherits.
    """

    @property
    def blocks(self) -> list[VariationBlock]:
        """The blocks in order."""
        return self.root if isinstance(self.root, list) else [self.root]


class VariationsSection(Spec):
    """Scenario of which only the key `variations` is validated."""

    variations: Variations
