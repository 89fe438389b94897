"""What `--watch` knows: which files each scenario is made of, and how it came out last."""

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TextIO

from simscen.core.errors import Exit, SimscenError
from simscen.core.problems import Problem
from simscen.core.sessionevents import RunFinished, SessionEvent
from simscen.loading.loaded import LoadedScenario
from simscen.run.filesof import files_of

Stamps = dict[Path, tuple[int, int, int] | None]


def stamps_of(files: Iterable[Path]) -> Stamps:
    """What changes when a file is saved, of each; None = it is not there."""
    return {file: _stamp(file) for file in files}


def _stamp(file: Path) -> tuple[int, int, int] | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


class Report:
    """Listens to a session and writes down for the one that watches what it is made of and how it comes out."""

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._files: dict[str, str] = {}

    def loaded(self, scenarios: Sequence[LoadedScenario]) -> None:
        """Write down the files of each."""
        made_of: dict[str, set[Path]] = {}
        for scenario in scenarios:
            self._files[scenario.id] = str(scenario.file)
            made_of.setdefault(str(scenario.file), set()).update(files_of(scenario))
        for file, others in made_of.items():
            self._write({"scenario": file, "files": sorted(map(str, others))})

    def mistakes(self, problems: Iterable[Problem]) -> None:
        """Write down which files keep the session from running."""
        self._write({"mistaken": sorted({str(Path(problem.path).absolute()) for problem in problems})})

    def __call__(self, event: SessionEvent) -> None:
        """Write down how a run came out."""
        if isinstance(event, RunFinished):
            self._write({"scenario": self._files[event.key.scenario], "good": event.outcome.good})

    def _write(self, message: dict[str, Any]) -> None:
        self._out.write(json.dumps(message) + "\n")
        self._out.flush()


class Watching:
    """The scenarios that `found` finds below `paths`, the files of each, and those that did not pass.

    A session that a mistake in some file kept from running is not done: any change of a file lets it try again.
    """

    def __init__(self, found: Callable[[], Sequence[Path]], paths: Iterable[Path]) -> None:
        self._found = found
        self._folders = {path.absolute() for path in paths if path.is_dir()}
        self._files: dict[Path, set[Path]] = {file: {file} for file in self._discovered()}
        self._bad: set[Path] = set()
        self._mistaken: set[Path] = set()
        self._asked: Sequence[Path] = ()
        self._unfinished: Sequence[Path] = ()

    @property
    def scenarios(self) -> list[Path]:
        """All that there are."""
        return sorted(self._files)

    @property
    def failed(self) -> list[Path]:
        """Those with a run that did not pass when it was made last."""
        return sorted(self._bad & self._files.keys())

    @property
    def files(self) -> list[Path]:
        """What to look at: files, and the folders in which new scenarios may appear."""
        return sorted({*self._folders, *self._mistaken, *(file for files in self._files.values() for file in files)})

    def begin(self, paths: Sequence[Path]) -> None:
        """A session of these begins."""
        self._asked, self._mistaken = paths, set()
        self._bad -= {file for path in paths for file in self._below(path)}

    def learn(self, line: str) -> None:
        """Take a line of a session's report."""
        message = json.loads(line)
        if "mistaken" in message:
            self._mistaken = set(map(Path, message["mistaken"]))
            return
        scenario = Path(message["scenario"])
        if "files" in message:
            self._files[scenario] = {Path(file) for file in message["files"]}
            self._folders |= {scenario.parent}
        elif not message["good"]:
            self._bad.add(scenario)

    def end(self, code: int) -> None:
        """The session has ended so; after a mistake in a file it is still to be done."""
        self._unfinished = self._asked if code == Exit.USAGE else ()

    def touched(self, changed: set[Path]) -> Sequence[Path]:
        """The scenarios to run now that these files have changed."""
        unfinished = {file for path in self._unfinished for file in self._below(path)}
        known = set(self._files)
        there = set(self._discovered()) if changed & self._folders else known
        self._files = {file: self._files.get(file, {file}) for file in sorted(there)}
        new = there - known
        touched = {file for file, files in self._files.items() if files & changed}
        return sorted((touched | new | unfinished) & there)

    def _below(self, path: Path) -> list[Path]:
        return [file for file in self._files if file.is_relative_to(path.absolute())]

    def _discovered(self) -> Sequence[Path]:
        """None where they cannot be told apart: the session will say why."""
        try:
            return self._found()
        except SimscenError:
            return ()
