"""Resolves relative paths in YAML files and paths on the command line, and derives ids of scenarios from paths."""

import errno
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from simscen.assets.folders import INVALID_IN_PATHS
from simscen.core.errors import Problem
from simscen.loading.schema.messages import did_you_mean, quoted
from simscen.loading.yaml.textfile import os_error_reason
from simscen.loading.yaml.tree import Position

MODEL_SCHEME = "model://"
"""Scheme of URIs for models in Gazebo."""

_SCENARIO_SUFFIXES = (".scenario.yaml", ".scenario.yml", ".yaml", ".yml")
"""Suffixes that are not part of the id of a scenario."""


@dataclass(frozen=True)
class PathSandbox:
    """Folders from which a scenario may read files: `root`, and `world_path`, the folders of `--world-path`."""

    root: Path
    world_path: tuple[Path, ...] = ()

    @classmethod
    def around(cls, root: Path, world_path: Sequence[Path] = ()) -> "PathSandbox":
        """Return the sandbox of these folders, as absolute paths with symbolic links resolved."""
        return cls(_resolved(root), tuple(_resolved(folder) for folder in world_path))

    def find(self, path_text: str, folder: Path, position: Position) -> Path | Problem:
        """Return the existing file or folder with the path `path_text`, or a problem at `position`.

        The path is relative to `folder`, the folder of the YAML file with the path. If there is no such file, or the
        path leads out of the sandbox, the path is searched in the folders of `--world-path`. A path `model://name/…` is
        only searched in these folders.
        """
        if problem := _form_problem(path_text, position):
            return problem
        if path_text.startswith(MODEL_SCHEME):
            message = f"{quoted(path_text)} was not found in any folder of --world-path"
            hint = "" if self.world_path else "allow its folder with --world-path"
            missing = Problem(*position, "SC023", message, hint)
            return self._in_world_path(path_text.removeprefix(MODEL_SCHEME)) or missing
        path = _resolved(folder / path_text)
        if not self.contains(path):
            hint = "choose the root with --root, or allow a folder with --world-path"
            outside = Problem(*position, "SC020", f"{quoted(path_text)} is outside the scenario root", hint)
            return self._in_world_path(path_text) or outside
        try:
            path.stat()
        except OSError as error:
            code = "SC022" if error.errno == errno.ELOOP else "SC023"
            message = f"{os_error_reason(error)}: {quoted(path_text)}"
            missing = Problem(*position, code, message, _similar_name_hint(path))
            return self._in_world_path(path_text) or missing
        return path

    def resolve_argument(self, path: Path) -> Path | Problem:
        """Return the `absolute_path` of a file on the command line, existing or not; or a problem."""
        file = absolute_path(path)
        if self.contains(file):
            return _name_problem(path, self.display_name(file)) or file
        return Problem(str(path), 0, 0, "SC020", "the file is outside the scenario root", "choose the root with --root")

    def contains(self, path: Path) -> bool:
        """Return whether a path, with symbolic links resolved, is in one of the folders."""
        real = _resolved(path)
        return any(real.is_relative_to(allowed) for allowed in (self.root, *self.world_path))

    def display_name(self, path: Path) -> str:
        """Return the path of a file for messages: relative to the root if it is inside, else absolute."""
        return path_in_messages(path, self.root)

    def _in_world_path(self, path_text: str) -> Path | None:
        """Return the first existing file or folder with this path relative to a folder of `--world-path`, or None."""
        if ".." in PurePosixPath(path_text).parts:
            return None
        candidates = ((folder, _resolved(folder / path_text)) for folder in self.world_path)
        return next((found for folder, found in candidates if found.is_relative_to(folder) and exists(found)), None)


def absolute_path(path: Path) -> Path:
    """Return the absolute path of a file or folder with symbolic links resolved, except a link to a file itself."""
    return _resolved(path) if is_folder(path) else _resolved(path.parent) / path.name


def path_in_messages(path: Path, root: Path) -> str:
    """Return a path for messages: relative to `root` if it is inside, else absolute."""
    return path.relative_to(root).as_posix() if path.is_relative_to(root) else str(path)


def exists(path: Path) -> bool:
    """Return whether a path exists. Returns False for an invalid path, for which Path.exists raises an error."""
    return os.path.exists(path)  # noqa: PTH110


def is_file(path: Path) -> bool:
    """Return whether a path is a regular file. Returns False for an invalid path, for which Path.is_file raises."""
    return os.path.isfile(path)  # noqa: PTH113


def is_folder(path: Path) -> bool:
    """Return whether a path is a folder. Returns False for an invalid path, for which Path.is_dir raises an error."""
    return os.path.isdir(path)  # noqa: PTH112


def _form_problem(path_text: str, position: Position) -> Problem | None:
    """Return a problem if a path is not relative, or has invalid characters; else None."""
    if INVALID_IN_PATHS.search(path_text):
        return Problem(*position, "SC017", f"control character in the path {quoted(path_text)}")
    if path_text.startswith(("/", "~")) or (len(path_text) > 1 and path_text[1] == ":"):
        return Problem(*position, "SC021", f"{quoted(path_text)} is an absolute path", "write it relative to this file")
    if "://" in path_text and not path_text.startswith(MODEL_SCHEME):
        return Problem(*position, "SC021", f"{quoted(path_text)} is a URL", "use a relative path or model://name")
    return None


def _name_problem(path: Path, name: str) -> Problem | None:
    """Return a problem if `name`, the path of the file in messages, has invalid characters; else None."""
    character = INVALID_IN_PATHS.search(name)
    if character is None:
        return None
    code = ord(character[0])
    is_invalid_utf8 = 0xD800 <= code < 0xE000  # Python decodes invalid bytes as surrogates
    control_character = f"control character U+{code:04X} in the file name"
    message = "the file name is not valid UTF-8" if is_invalid_utf8 else control_character
    return Problem(str(path), 0, 0, "SC017", message, "rename the file")


def _resolved(path: Path) -> Path:
    """Return the absolute path with symbolic links resolved. A loop of links is no error, unlike in Path.resolve."""
    return Path(os.path.realpath(path))


def _similar_name_hint(missing: Path) -> str:
    """Return "did you mean …?" if the folder of a missing file has a file with a similar name; else ""."""
    try:
        names = sorted(entry.name for entry in os.scandir(missing.parent))
    except OSError:
        return ""
    return did_you_mean(missing.name, names)


def is_unusable_name(name: str) -> bool:
    """Return whether the name cannot be the name of an output folder."""
    return name in ("", ".", "..")


def scenario_id(file: Path, root: Path) -> str:
    """Return the id of a scenario: its path relative to the root, without suffix; outside the root, its file name."""
    name = file.relative_to(root).as_posix() if file.is_relative_to(root) else file.name
    return next((name.removesuffix(suffix) for suffix in _SCENARIO_SUFFIXES if name.endswith(suffix)), name)
