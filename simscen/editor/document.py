"""Reading and saving of the edited file, with a check for changes by other programs."""

import hashlib
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from simscen.core.errors import InvalidInput, Problem, UsageError
from simscen.loading.files.paths import PathSandbox
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.textfile import decode, read_bytes
from simscen.run.sessions.output_folder import write_atomically


@dataclass(frozen=True)
class EditedFile:
    """The edited file, and the folders whose files it may refer to.

    Attributes:
        path: Absolute path of the file.
        kind: "scenario" or "world".
        root: Folder that all files of the scenario must lie in.
        world_path: Additional folders with worlds and maps.
    """

    path: Path
    kind: str
    root: Path
    world_path: tuple[Path, ...] = ()

    @property
    def display_name(self) -> str:
        """Name of the file in messages: its path relative to `root` or to a folder of `world_path`."""
        return PathSandbox.around(self.root, self.world_path).display_name(self.path)

    def library(self, text: str) -> Library:
        """Return a reader of the files in these folders, which reads `text` instead of the edited file."""
        return Library(PathSandbox.around(self.root, self.world_path), unsaved={self.path: text})


BYTE_ORDER_MARK = b"\xef\xbb\xbf"
NEW_FILE_VERSION = ""
"""Version of a file that does not exist yet."""


class Content(NamedTuple):
    """Text of a file with \\n as line breaks, and the version of the file.

    The version is a hash of all bytes, or NEW_FILE_VERSION if there is no file.
    """

    text: str
    version: str


class FileChanged(Exception):
    """The file was changed, created, or deleted after the editor read it. `content` is the content of the file now."""

    def __init__(self, message: str, content: Content) -> None:
        super().__init__(message)
        self.content = content


@dataclass
class Document:
    """Reads and saves a text file. Line breaks (\\n or \\r\\n) and a byte order mark are preserved.

    `display_name` is the name of the file in messages.
    """

    path: Path
    display_name: str
    _line_break: str = "\n"
    _mark: bytes = b""

    def read(self) -> Content:
        """Return the content of the file. Raises InvalidInput if the file is not text or mixes kinds of line breaks."""
        raw = read_bytes(self.path, self.display_name)
        if isinstance(raw, Problem):
            raise InvalidInput([raw])
        text = decode(raw, self.display_name)
        if isinstance(text, Problem):
            raise InvalidInput([text])
        breaks = {"\r\n": raw.count(b"\r\n"), "\n": raw.count(b"\n") - raw.count(b"\r\n")}
        if (breaks["\r\n"] and breaks["\n"]) or raw.count(b"\r") > breaks["\r\n"]:
            hint = "convert the file to one kind, for example with dos2unix"
            raise InvalidInput([Problem(self.display_name, 0, 0, "SC002", "the file mixes kinds of line breaks", hint)])
        self._line_break = "\r\n" if breaks["\r\n"] else "\n"
        self._mark = BYTE_ORDER_MARK if raw.startswith(BYTE_ORDER_MARK) else b""
        return Content(text, _version(raw))

    def save(self, text: str, version: str, overwrite: bool = False) -> str:
        """Replace the content of the file atomically and return its new version.

        `version` is the version that was edited. Raises FileChanged if the file now has another version and
        `overwrite` is False. Raises UsageError if the file cannot be written, or the text is not valid Unicode.
        """
        if not overwrite:
            self._require_version(version)
        try:
            data = self._mark + text.replace("\n", self._line_break).encode()
        except UnicodeEncodeError as error:
            character = f"U+{ord(error.object[error.start]):04X}"
            message = f"{self.display_name}: cannot be written: {character} is not a valid character; remove it"
            raise UsageError(message) from error
        try:
            mode = stat.S_IMODE(self.path.stat().st_mode) if self.path.exists() else None
            write_atomically(self.path, data)
            if mode is not None:
                self.path.chmod(mode)
        except OSError as error:
            raise UsageError(f"{self.display_name}: cannot be written: {error.strerror or error}") from error
        return _version(data)

    def _require_version(self, version: str) -> None:
        """Raise FileChanged if the file has another version, and UsageError if the file cannot be read."""
        try:
            raw = self.path.read_bytes()
            current = _version(raw)
        except (FileNotFoundError, NotADirectoryError):
            raw, current = b"", NEW_FILE_VERSION
        except OSError as error:
            raise UsageError(f"{self.display_name}: cannot be read: {error.strerror or error}") from error
        if current == version:
            return
        text = decode(raw, self.display_name)
        if version == NEW_FILE_VERSION:
            change = "was created"
        else:
            change = "was deleted" if current == NEW_FILE_VERSION else "was changed by another program"
        hint = "reload it, or overwrite it with your text"
        message = f"{self.display_name} {change} since it was opened here; {hint}"
        raise FileChanged(message, Content(text if isinstance(text, str) else "", current))


def _version(raw: bytes) -> str:
    return hashlib.sha256(raw).hexdigest()
