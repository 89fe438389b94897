"""Whether a scenario is still what it was: all that its runs depend on, as one number."""

import hashlib
from pathlib import Path

from simscen import __version__
from simscen.loading.loaded import LoadedScenario


def digest(loaded: LoadedScenario) -> str:
    """SHA-256 over this version, the texts of all files that were read, and the bytes of those they name.

    Meshes that an SDF or URDF file includes are not among them. Raises OSError.
    """
    sha = hashlib.sha256(__version__.encode())
    for name, text in sorted(loaded.sources.items()):
        _take(sha, name, text.encode())
    for file in _named(loaded):
        _take(sha, file.name, file.read_bytes())
    _take(sha, "lenient", str(loaded.lenient).encode())
    return sha.hexdigest()


def _named(loaded: LoadedScenario) -> list[Path]:
    """Map images, SDF and URDF files."""
    maps = [loaded.world.map, *([] if loaded.map is None or loaded.map == "none" else [loaded.map])]
    return [
        *(found.image for found in maps if found),
        *(file for file in (loaded.world.sdf, loaded.robot.urdf) if file),
    ]


def _take(sha: "hashlib._Hash", name: str, data: bytes) -> None:
    sha.update(f"{name}\0{len(data)}\0".encode())
    sha.update(data)
