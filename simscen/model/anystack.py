"""The stacks that a scenario may name: simscen's own, or a process that speaks the stack protocol."""

from typing import Annotated, Any

from pydantic import Discriminator, StringConstraints, Tag

from simscen.model.stack import InProcessStack, StackSpec
from simscen.model.stackbase import StackBase
from simscen.spec.bytype import ByType

_TAG = "an external stack"
"""No key of a stack: problems are told by keys and tags in one path."""
StackName = Annotated[str, StringConstraints(min_length=1, max_length=60, pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$")]


class ExternalStackSpec(StackBase):
    """A stack in a process of its own, in any language, in lockstep with the simulation.

    A scenario only names it. What the name runs is told on the command line (`--stack mine='COMMAND'`) or in the
    user's own configuration, never in a scenario: a scenario stays data. Each of several robots has a process of
    its own.

    Example: `stack: {external: mine, controller_frequency: 10 Hz}`
    """

    external: StackName
    """What the command line and the user's configuration call it: letters, digits, `_`, `.` and `-`."""
    ground_truth: bool = False
    """Also tell it where it truly is, to tell faults of localization from faults of navigation."""

    @property
    def told_truth(self) -> bool:
        """Whether it is also told where it truly is."""
        return self.ground_truth


def _kind(value: Any) -> str:
    """Which stack a mapping means: an `external` one, or one by its `type`, which is left out for simscen's own."""
    if isinstance(value, dict):
        return _TAG if "external" in value and "type" not in value else str(value.get("type", "reference"))
    return _TAG if isinstance(value, ExternalStackSpec) else str(getattr(value, "type", "reference"))


_Stacks = Annotated[
    Annotated[StackSpec, Tag("reference")] | Annotated[ExternalStackSpec, Tag(_TAG)], Discriminator(_kind)
]
AnyStack = Annotated[InProcessStack | ExternalStackSpec, ByType("stack", _Stacks)]
