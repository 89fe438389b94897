"""What an action is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from simscen.core.stage import Effect, Stage


class Action(ABC):
    """Something a scenario does to the running world."""

    @property
    def of_a_robot(self) -> bool:
        """Whether it depends on which of several robots it is about."""
        return True

    @abstractmethod
    def perform(self, stage: Stage) -> Effect:
        """Do it now, and say what came of it. Everything it does is in the log by way of the stage."""
