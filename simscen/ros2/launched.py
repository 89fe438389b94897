"""The nodes that a run starts for itself, kept by a process that ends them even when the adapter is killed."""

import subprocess
import sys
from pathlib import Path
from typing import Mapping, Optional

_KEEPER = str(Path(__file__).resolve().parent / "keeper.py")


class Launched:
    """A command of the user, running."""

    def __init__(self, command: str, environment: Mapping[str, str]) -> None:
        self.command = command
        self._keeper = subprocess.Popen(
            [sys.executable, _KEEPER, command], stdin=subprocess.PIPE, stdout=2, env=environment, start_new_session=True
        )

    @property
    def ended(self) -> Optional[str]:
        """How it ended; None while it runs."""
        code = self._keeper.poll()
        if code is None:
            return None
        return f"ended by signal {code - 128}" if code > 128 else f"ended with exit code {code}"

    def end(self) -> None:
        """End it and all that it started."""
        assert self._keeper.stdin is not None
        self._keeper.stdin.close()
        self._keeper.wait()
