"""What an action is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from simscen.core.stage import Stage


class Action(ABC):
    """Something a scenario does to the running world."""

    @abstractmethod
    def perform(self, stage: Stage) -> None:
        """Do it now. Everything it does is in the log by way of the stage."""
