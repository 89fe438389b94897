"""Where a way leads between two fixed things."""

import math
from dataclasses import dataclass

Point = tuple[float, float]


@dataclass(frozen=True)
class Passage:
    """A line across the shortest way to a goal, from one fixed solid to another, in the world frame.

    Who takes that way has to cross the line, so what stands on it is in the way. `between` are the names of the two
    solids; "" for one without a name.
    """

    goal: str
    ends: tuple[Point, Point]
    between: tuple[str, str] = ("", "")

    @property
    def width(self) -> float:
        """Metres from solid to solid."""
        return math.dist(*self.ends)

    @property
    def middle(self) -> Point:
        """The point halfway."""
        (ax, ay), (bx, by) = self.ends
        return (ax + bx) / 2, (ay + by) / 2

    @property
    def told(self) -> str:
        """In words: "the passage of 0.90 m between `wall 3` and `wall 4` at (9.00, 5.75)"."""
        one, other = self.between
        between = f" between `{one}` and `{other}`" if one and other and one != other else ""
        return f"the passage of {self.width:.2f} m{between} at ({self.middle[0]:.2f}, {self.middle[1]:.2f})"
