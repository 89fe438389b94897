"""The parameters of a stack, without a scenario around them."""

from typing import Annotated

from pydantic import Field

from simscen.model.anystack import AnyStack
from simscen.spec.base import LanguageVersion, Spec
from simscen.spec.places import Name


class StackFileSpec(Spec):
    """A stack that `--stack NAME=FILE` runs scenarios with: a `stack:` section as a scenario has it.

    It is the whole stack: what it does not say is at its default, whatever the scenarios say. Only what is asked of any
    stack is the scenario's, in its own `stack:` section: keepout regions, speed zones, filter masks, and tolerances of
    goals where it gives them.
    """

    simscen: LanguageVersion
    """Version of this language."""
    name: Name | None = None
    """For people."""
    description: Annotated[str, Field(max_length=10_000)] = ""
    """What is special about it."""
    stack: AnyStack
    """The stack's parameters, as in a scenario."""
