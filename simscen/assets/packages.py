"""Where ROS packages are looked for: only in folders that files may lie in, and nothing that is installed."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

MAX_MANIFEST_BYTES = 1 << 16
"""How much of a package.xml is read to find its `<name>`."""


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
    yield from _folders_by_manifest(name, near, roots)


def _folders_by_manifest(name: str, near: Path, roots: Sequence[Path]) -> Iterator[Path]:
    """Yield folders whose package.xml gives this package name; a folder may be called otherwise."""
    for folder in (near, *near.parents):
        if not any(folder.is_relative_to(root) for root in roots):
            break
        if _manifest_name(folder / "package.xml") == name:
            yield folder
    for pattern in ("package.xml", "*/package.xml", "*/*/package.xml"):
        for root in roots:
            yield from (path.parent for path in sorted(root.glob(pattern)) if _manifest_name(path) == name)


def _manifest_name(path: Path) -> str:
    """Return the package name in a package.xml; empty for symbolic links and for what cannot be read."""
    if path.is_symlink() or path.parent.is_symlink() or not path.is_file():
        return ""
    try:
        with path.open("rb") as file:
            text = file.read(MAX_MANIFEST_BYTES).decode("utf-8", "replace")
    except OSError:
        return ""
    match = re.search(r"<name>\s*([^\s<]+)\s*</name>", re.sub(r"<!--.*?(?:-->|\Z)", "", text, flags=re.DOTALL))
    return match[1] if match else ""
