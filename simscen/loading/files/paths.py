"""Resolve paths inside files: they must be relative, and inside the root or a folder allowed on the command line."""

import errno
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from simscen.core.errors import Problem
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.yaml.textfile import os_error_reason

MODEL_SCHEME = "model://"

_INVALID_IN_NAMES = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")
"""Control and bidirectional characters, and surrogates for bytes that are not UTF-8 (PEP 383)."""


@dataclass(frozen=True)
class PathSandbox:
    """Folders that a scenario may read from: `root`, and those of `--world-path`, which are searched in order."""

    root: Path
    world_path: tuple[Path, ...] = ()

    @classmethod
    def around(cls, root: Path, world_path: Sequence[Path] = ()) -> "PathSandbox":
        """Return the sandbox of these folders, as absolute paths with symbolic links resolved."""
        return cls(_resolved(root), tuple(_resolved(folder) for folder in world_path))

    def find(self, written: str, folder: Path) -> "Path | PathProblem":
        """Return the existing file or folder for a path written in a file in `folder`.

        The path is resolved relative to `folder` first, and must stay inside the root. `model://name/…` and relative
        paths are then searched in the folders of `--world-path`. Problems do not reveal which files exist outside.
        """
        if problem := _invalid_form(written):
            return problem
        if written.startswith(MODEL_SCHEME):
            message = f"{quoted(written)} was not found in any folder of --world-path"
            missing = PathProblem("SC023", message, _world_path_hint(self))
            return self._in_world_path(written.removeprefix(MODEL_SCHEME)) or missing
        inside = _resolved(folder / written)
        if self.contains(inside):
            try:
                inside.stat()
            except OSError as error:
                problem = _unusable(error, written, inside)
            else:
                return inside
        return self._in_world_path(written) or problem or _outside(written)

    def resolve_argument(self, path: Path) -> Path | Problem:
        """Return the absolute path of a file named on the command line; a problem if it is outside the sandbox."""
        file = _resolved(path.parent) / path.name
        if self.contains(file):
            return _name_problem(path, self.display_name(file)) or file
        return Problem(str(path), 0, 0, "SC020", "the file is outside the scenario root", "choose the root with --root")

    def contains(self, path: Path) -> bool:
        """Return whether a file, with symbolic links resolved, is inside the root or an allowed folder."""
        real = _resolved(path)
        return any(real.is_relative_to(allowed) for allowed in (self.root, *self.world_path))

    def display_name(self, path: Path) -> str:
        """Return the name of a file in messages: relative to the root if it is inside."""
        return path.relative_to(self.root).as_posix() if path.is_relative_to(self.root) else str(path)

    def _in_world_path(self, written: str) -> Path | None:
        if ".." in PurePosixPath(written).parts:
            return None
        candidates = ((folder, _resolved(folder / written)) for folder in self.world_path)
        return next((found for folder, found in candidates if found.is_relative_to(folder) and exists(found)), None)


def exists(path: Path) -> bool:
    """Return whether a path exists; False for invalid names, for which Path.exists raises."""
    return os.path.exists(path)  # noqa: PTH110


def is_folder(path: Path) -> bool:
    """Return whether a path is a folder; False for invalid names, for which Path.is_dir raises."""
    return os.path.isdir(path)  # noqa: PTH112


@dataclass(frozen=True)
class PathProblem:
    """Reason why a path in a file cannot be used."""

    code: str
    message: str
    hint: str = ""


def _invalid_form(written: str) -> PathProblem | None:
    if any(not c.isprintable() for c in written):
        return PathProblem("SC017", f"control character in the path {quoted(written)}")
    if written.startswith(("/", "~")) or (len(written) > 1 and written[1] == ":"):
        return PathProblem("SC021", f"{quoted(written)} is an absolute path", "write it relative to this file")
    if "://" in written and not written.startswith(MODEL_SCHEME):
        return PathProblem("SC021", f"{quoted(written)} is a URL", "use a relative path or model://name")
    return None


def _name_problem(path: Path, name: str) -> Problem | None:
    """Return a problem if the name of a file cannot be a scenario id, which appears in folder names and XML."""
    character = _INVALID_IN_NAMES.search(name)
    if character is None:
        return None
    code = ord(character[0])
    bad_bytes = 0xD800 <= code < 0xE000
    message = "the file name is not valid UTF-8" if bad_bytes else f"control character U+{code:04X} in the file name"
    return Problem(str(path), 0, 0, "SC017", message, "rename the file")


def _resolved(path: Path) -> Path:
    """Return the path with symbolic links resolved; Path.resolve raises RuntimeError on a loop."""
    return Path(os.path.realpath(path))


def _outside(written: str) -> PathProblem:
    hint = "choose the root with --root, or allow a folder with --world-path"
    return PathProblem("SC020", f"{quoted(written)} is outside the scenario root", hint)


def _unusable(error: OSError, written: str, path: Path) -> PathProblem:
    code = "SC022" if error.errno == errno.ELOOP else "SC023"
    return PathProblem(code, f"{os_error_reason(error)}: {quoted(written)}", _sibling(path))


def _world_path_hint(sandbox: PathSandbox) -> str:
    return "" if sandbox.world_path else "allow its folder with --world-path"


def _sibling(missing: Path) -> str:
    try:
        names = sorted(entry.name for entry in os.scandir(missing.parent))
    except OSError:
        return ""
    hint = suggestion(missing.name, names)
    return hint if hint.startswith("did") else ""
