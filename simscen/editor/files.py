"""The file that is edited, its kind, and the folders that it may refer to."""

from dataclasses import dataclass
from pathlib import Path

from simscen.loading.files.paths import PathSandbox
from simscen.loading.yaml.library import Library


@dataclass(frozen=True)
class EditedFile:
    """A scenario or world file: absolute path, `kind` ("scenario" or "world"), root, and additional folders.

    `shown` is its name in problems: the path relative to the root.
    """

    path: Path
    kind: str
    root: Path
    world_path: tuple[Path, ...] = ()

    @property
    def display_name(self) -> str:
        """Name of the file in problems."""
        return PathSandbox.around(self.root, self.world_path).display_name(self.path)

    def library(self, text: str) -> Library:
        """Return a reader of files that has `text` in the place of the content of this file."""
        return Library(PathSandbox.around(self.root, self.world_path), unsaved={self.path: text})
