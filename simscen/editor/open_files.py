"""The files that one server edits: the file of the command, and the world files that it names, each on its own page."""

import re
import threading
from dataclasses import replace
from pathlib import Path

from simscen.core.errors import InvalidInput
from simscen.editor.session import EditorSession

_WORLD_PAGE = re.compile(r"world-([0-9]{1,4})")


class OpenFiles:
    """The sessions of a server. The page of the n-th world file is below `world-n/`; its session starts with its page.

    The number of a world file never changes, so that a page cannot save into another file when the scenario names
    another world.
    """

    def __init__(self, main: EditorSession) -> None:
        self.main = main
        self._worlds: dict[Path, int] = {}
        self._sessions: dict[int, EditorSession] = {}
        self._lock = threading.Lock()
        main.world_page = self._page_of

    def resolve(self, name: str) -> tuple[EditorSession, str] | None:
        """Return the session of a requested path, and the path within it; None if there is no such world file."""
        first, slash, rest = name.partition("/")
        match = _WORLD_PAGE.fullmatch(first) if slash else None
        if match is None:
            return self.main, name
        session = self._session(int(match[1]))
        return None if session is None else (session, rest)

    def close(self) -> None:
        """End all sessions."""
        for session in (self.main, *self._sessions.values()):
            session.runs.close()

    def _page_of(self, world: Path) -> str:
        with self._lock:
            return f"world-{self._worlds.setdefault(world, len(self._worlds) + 1)}/"

    def _session(self, number: int) -> EditorSession | None:
        with self._lock:
            if number not in self._sessions:
                path = next((path for path, known in self._worlds.items() if known == number), None)
                if path is None:
                    return None
                try:
                    self._sessions[number] = self.main.other(replace(self.main.file, path=path, kind="world"))
                except InvalidInput:
                    return None
            return self._sessions[number]
