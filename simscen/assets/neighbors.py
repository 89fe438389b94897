"""What lies where a missing file was looked for: files are published with the wrong case or the wrong suffix."""

from pathlib import Path, PurePath

MESHES = (".dae", ".stl", ".obj")


def neighbor(folder: Path, path: Path) -> str | None:
    """Return the file or folder below `folder` that `path` probably means, relative to it, or None.

    Symbolic links are not followed, so that messages do not reveal names outside the folder.
    """
    here, parts = folder, path.relative_to(folder).parts if path.is_relative_to(folder) else ("..",)
    for part in parts:
        found = None if part == ".." else _spelled(here, part)
        if found is None or (here / found).is_symlink():
            return None
        here /= found
    return here.relative_to(folder).as_posix()


def _spelled(folder: Path, name: str) -> str | None:
    """Return the entry of a folder with this name, or with other capitalization, or the mesh in another format."""
    try:
        entries = sorted(entry.name for entry in folder.iterdir())
    except OSError:
        return None
    if name in entries:
        return name
    wanted = PurePath(name.casefold())
    meant = [wanted.name]
    if wanted.suffix in MESHES:
        meant += [wanted.with_suffix(suffix).name for suffix in MESHES]
    return next((entry for spelling in meant for entry in entries if entry.casefold() == spelling), None)
