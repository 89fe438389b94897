"""Base classes of actions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from simscen.core.stage import Effect, Stage


class Action(ABC):
    """Change that an event of a scenario makes to the running world."""

    @property
    def is_robot_specific(self) -> bool:
        """Whether the effect depends on which of several robots the action is for."""
        return True

    @abstractmethod
    def perform(self, stage: Stage) -> Effect:
        """Perform the action and return its effect. Every change is made, and logged, through the stage."""


class WorldAction(Action):
    """Action that is the same for all robots."""

    @property
    def is_robot_specific(self) -> bool:
        """Always False."""
        return False
