"""Whether wheels find no ground in a world but its floor, in plain numbers: most worlds are of walls."""

from collections.abc import Iterable

from simscen.core.environment.drivable_surfaces import FLOOR_HEIGHT_M
from simscen.core.geometry.shapes import Solid
from simscen.worlds.upright import upright


def is_flat(solids: Iterable[Solid], reach: float) -> bool:
    """Whether it is plain without a look at triangles that wheels get onto no solid."""
    prisms = [upright(solid) for solid in solids]
    return all(prism is not None and (prism.top > reach or prism.top <= FLOOR_HEIGHT_M) for prism in prisms)
