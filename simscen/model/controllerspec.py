"""What the parameters of all controllers have in common."""

from typing import Annotated

from pydantic import Field

from simscen.spec.component import Typed

Weight = Annotated[float, Field(ge=0, le=1e7)]
"""Of a critic, against other critics."""


class ControllerSpec(Typed):
    """What follows a path."""

    @property
    def looks_ahead(self) -> float:
        """Seconds for which it follows what it may command: the local costmap reaches so far."""
        return 2.0
