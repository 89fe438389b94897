"""How a stream wants to be written to: what it is, and what the environment says of colors."""

from collections.abc import Mapping
from dataclasses import dataclass
from shutil import get_terminal_size
from typing import TextIO


@dataclass(frozen=True)
class Look:
    """Whether to write in `color`, with `live` progress below the lines, and as if for a `terminal`."""

    color: bool
    live: bool
    terminal: bool

    @property
    def columns(self) -> int | None:
        """How wide the terminal is now; None = lines are as long as they are, for programs and for searching."""
        return get_terminal_size().columns if self.terminal else None


def look_of(out: TextIO, environ: Mapping[str, str]) -> Look:
    """What suits `out`. NO_COLOR wins over FORCE_COLOR and CLICOLOR_FORCE, these over TERM=dumb and CLICOLOR=0."""
    terminal = out.isatty()
    able = terminal and environ.get("TERM") not in ("dumb", "unknown")
    if environ.get("NO_COLOR"):
        color = False
    elif any(environ.get(name, "") not in ("", "0") for name in ("FORCE_COLOR", "CLICOLOR_FORCE")):
        color = True
    else:
        color = able and environ.get("CLICOLOR") != "0"
    return Look(color and can_encode(out), able and can_encode(out), terminal)


def can_encode(out: TextIO) -> bool:
    """Whether `out` takes the signs that we use; others get ASCII, and nothing that moves a cursor."""
    try:
        "✓✗·≤≥°".encode(getattr(out, "encoding", None) or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True
