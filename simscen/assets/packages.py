"""Where ROS packages are looked for: only in folders that files may lie in, and nothing that is installed."""

from collections.abc import Iterator, Sequence
from pathlib import Path


def is_package_name(name: str) -> bool:
    """Whether a ROS package can be called so (REP 144): it can then be no path."""
    return name.replace("_", "").replace("-", "").isalnum()


def places_of(name: str, near: Path, roots: Sequence[Path]) -> Iterator[Path]:
    """Folders that may be the package, for a file in the folder `near`: around it, in the roots, up to two below them.

    A workspace holds repositories, and these hold packages, perhaps in a folder for some that belong together.
    """
    for folder in (near, *near.parents):
        if folder.name == name:
            yield folder
        yield folder / name
        if folder in roots:
            break
    yield from (root if root.name == name else root / name for root in roots)
    for pattern in (f"*/{name}", f"*/*/{name}"):
        for root in roots:
            yield from sorted(root.glob(pattern))
