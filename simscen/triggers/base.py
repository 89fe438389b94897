"""Base class of trigger conditions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from simscen.core.stage import Situation


class Condition(ABC):
    """Condition on the state of the run.

    *Given* the same situation *then* the result is the same: a condition keeps no state and draws no random numbers.
    """

    is_robot_specific: ClassVar[bool] = True
    """Whether the result depends on which of several robots the condition is for."""

    @abstractmethod
    def holds(self, now: Situation) -> bool:
        """Return whether the condition is true at this beat."""
