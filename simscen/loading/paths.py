"""Paths inside files: relative, and inside the root or the folders that the command line allows."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from simscen.loading.messages import quoted, suggestion
from simscen.loading.source import reason

MODEL = "model://"


@dataclass(frozen=True)
class Fence:
    """Where a scenario may read from: `root`, and the folders of `--world-path`, searched in order."""

    root: Path
    world_path: tuple[Path, ...] = ()

    @classmethod
    def around(cls, root: Path, world_path: Sequence[Path] = ()) -> "Fence":
        """Folders as given, made absolute with symbolic links followed."""
        return cls(root.resolve(), tuple(folder.resolve() for folder in world_path))

    def find(self, written: str, folder: Path) -> "Path | Refusal":
        """The existing file or folder that `written` means in a file that lies in `folder`.

        A path is taken relative to `folder` first and must stay inside the root; `model://name/…` and bare relative
        paths are then looked up in the folders of `--world-path`. Whether something outside exists is not told.
        """
        if refusal := _refused_form(written):
            return refusal
        if written.startswith(MODEL):
            return self._in_world_path(
                written.removeprefix(MODEL), f"{quoted(written)} is in no folder of --world-path"
            )
        try:
            inside = _real(folder / written)
        except OSError as error:
            return Refusal("SC022", f"{reason(error)}: {quoted(written)}")
        contained = any(inside.is_relative_to(allowed) for allowed in (self.root, *self.world_path))
        if contained and inside.exists():
            return inside
        elsewhere = self._in_world_path(written, "")
        if isinstance(elsewhere, Path):
            return elsewhere
        if not contained:
            hint = "choose the root with --root, or allow a folder with --world-path"
            return Refusal("SC020", f"{quoted(written)} is outside the scenario root", hint)
        return Refusal("SC023", f"no such file or directory: {quoted(written)}", _sibling(inside))

    def holds(self, path: Path) -> bool:
        """Whether a file, with symbolic links followed, is inside the root or an allowed folder."""
        real = Path(os.path.realpath(path))
        return any(real.is_relative_to(allowed) for allowed in (self.root, *self.world_path))

    def shown(self, path: Path) -> str:
        """How messages name a file: relative to the root where it is inside."""
        return path.relative_to(self.root).as_posix() if path.is_relative_to(self.root) else str(path)

    def _in_world_path(self, written: str, message: str) -> "Path | Refusal":
        if ".." not in PurePosixPath(written).parts:
            for folder in self.world_path:
                found = Path(os.path.realpath(folder / written))
                if found.is_relative_to(folder) and found.exists():
                    return found
        return Refusal("SC023", message)


@dataclass(frozen=True)
class Refusal:
    """Why a path in a file cannot be used."""

    code: str
    message: str
    hint: str = ""


def _refused_form(written: str) -> Refusal | None:
    if any(not c.isprintable() for c in written):
        return Refusal("SC017", f"control character in the path {quoted(written)}")
    if written.startswith(("/", "~")) or (len(written) > 1 and written[1] == ":"):
        return Refusal("SC021", f"{quoted(written)} is an absolute path", "write it relative to this file")
    if "://" in written and not written.startswith(MODEL):
        return Refusal("SC021", f"{quoted(written)} is a URL", "only relative paths and model://name are read")
    return None


def _real(path: Path) -> Path:
    """`path` with symbolic links followed. Raises OSError with ELOOP on a loop, ENAMETOOLONG on an impossible name."""
    real = Path(os.path.realpath(path))
    try:
        real.stat()
    except FileNotFoundError:
        return real
    except PermissionError:
        return real
    return real


def _sibling(missing: Path) -> str:
    try:
        names = sorted(entry.name for entry in os.scandir(missing.parent))
    except OSError:
        return ""
    hint = suggestion(missing.name, names)
    return hint if hint.startswith("did") else ""
