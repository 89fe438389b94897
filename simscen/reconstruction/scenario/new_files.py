"""Files that a reconstruction writes next to the scenario: map, robot file, or copy of a world."""

from pathlib import Path

from simscen.core.errors import UsageError


class NewFiles:
    """Files written next to the scenario, in order, which are removed again if the reconstruction fails."""

    def __init__(self) -> None:
        self.paths: list[Path] = []

    def add(self, *files: Path) -> None:
        """Add files before they are written. Raises UsageError if one exists."""
        for file in files:
            if file.exists():
                raise UsageError(f"{file} already exists; choose another name for the scenario, or remove the file")
        self.paths += files

    def remove(self) -> None:
        """Remove all files."""
        for file in self.paths:
            file.unlink(missing_ok=True)
