"""What mesh files are made of, whatever their format."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array

MOST_FACES = 1_000_000


class UnusableMesh(Exception):
    """Why a mesh file cannot be used."""


@dataclass(frozen=True, eq=False)
class Part:
    """A named part of a mesh: `vertices` (n, 3) in metres, `faces` (m, 3); `names` is what a submesh may call it."""

    names: tuple[str, ...]
    vertices: Array
    faces: npt.NDArray[np.int64]


def limit(faces: int) -> None:
    """Raise UnusableMesh when there are too many triangles."""
    if faces > MOST_FACES:
        raise UnusableMesh(f"more than {MOST_FACES} triangles")
