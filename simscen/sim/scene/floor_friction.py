"""How well wheels hold on the floor, place by place.

The engine multiplies the frictions of what touches: a wheel has 1, so that a surface's own is that of the contact. The
floor is one plane; where a patch lies on it, the wheels that are there get its friction instead. On a ramp with a
friction of its own, a patch multiplies it.
"""

from simscen.core.environment.world_model import Patch
from simscen.core.geometry.polygons import polygon_contains


class FloorFriction:
    """Patches of the floor by name; one that is laid later lies upon the others."""

    def __init__(self) -> None:
        self._patches: dict[str, tuple[Patch, tuple[float, float, float, float]]] = {}
        self._over = False

    def __bool__(self) -> bool:
        """Whether there has ever been one, so that wheels have to be looked after."""
        return bool(self._patches) or self._over

    def lay(self, name: str, patch: Patch) -> None:
        """Make a piece of floor slippery, or dry again; a patch of the same name is replaced."""
        xs, ys = zip(*patch.outline, strict=True)
        self._patches.pop(name, None)
        self._patches[name] = patch, (min(xs), min(ys), max(xs), max(ys))

    def pass_time(self, tick: int) -> None:
        """What is over by now dries up."""
        for name in [name for name, (patch, _) in self._patches.items() if patch.until <= tick]:
            self._over = True
            del self._patches[name]

    def friction(self, x: float, y: float) -> float:
        """At a place: that of the uppermost patch there, else 1."""
        found = 1.0
        for patch, (left, low, right, high) in self._patches.values():
            if left <= x <= right and low <= y <= high and polygon_contains(patch.outline, (x, y)):
                found = patch.friction
        return found
