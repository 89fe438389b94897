"""What a trigger is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from simscen.core.stage import Situation


class Condition(ABC):
    """A condition on the running scenario.

    *Given* the same situation *then* the same answer: a condition keeps no state and draws no chance.
    """

    of_a_robot: ClassVar[bool] = True
    """Whether it depends on which of several robots it is about."""

    @abstractmethod
    def holds(self, now: Situation) -> bool:
        """Whether it is true at this beat."""
