"""Meshes already read in this process, by what is in the file: worlds of a session share their slow ones.

Nothing is kept on disk, because running a scenario writes to its output folder only. The warm process reads a mesh
once and its forks inherit it.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict

from simscen.worlds.sdf.mesh_files import Part, read_parts

MOST_BYTES = 256 << 20
"""Of triangles kept; the mesh that was asked for longest ago goes first."""


class MeshCache:
    """Reads mesh files by content. What it hands out is shared; nobody writes into it."""

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._most = most_bytes
        self._parts: OrderedDict[str, tuple[Part, ...]] = OrderedDict()

    def read(self, data: bytes, suffix: str, name: str) -> tuple[Part, ...]:
        """The parts in a file's bytes; `name` is what a complaint calls it. Raises UnusableMesh, each time anew."""
        key = hashlib.sha256(suffix.encode() + b"\0" + data).hexdigest()
        if key not in self._parts:
            self._parts[key] = read_parts(data, suffix, name)
            while len(self._parts) > 1 and sum(map(_size, self._parts.values())) > self._most:
                self._parts.popitem(last=False)
        self._parts.move_to_end(key)
        return self._parts[key]


def _size(parts: tuple[Part, ...]) -> int:
    return sum(part.vertices.nbytes + part.faces.nbytes for part in parts)


READ = MeshCache()
"""The one of this process."""
