"""Choice of the console reporter (live progress, color, or plain), and printing of lines outside of a session."""

import os
from collections.abc import Iterable
from typing import TextIO

from simscen.report.display_text import StyledLine, TerminalStyle, detect_style
from simscen.report.reporters import PlainReporter, Reporter


def text_reporter(out: TextIO, live: bool | None = None, slow: int | None = None) -> Reporter:
    """Return a reporter with live progress on a terminal, plain lines elsewhere, and color where it is supported.

    `live` enables or disables live progress; None detects a terminal. `slow` is the number of slowest runs to list at
    the end (0: all runs, None: no list).
    """
    style = detect_style(out, os.environ)
    if live is not None:
        style = TerminalStyle(live or style.has_color, live, style.is_terminal)
    if style.has_live_progress:
        from simscen.report.live_console import LiveReporter  # rich is slow to import

        return LiveReporter(out, style, slow)
    return _line_reporter(out, style, slow)


def print_lines(lines: Iterable[StyledLine], out: TextIO) -> None:
    """Print lines, with color if `out` supports it, wrapped to the width of the terminal."""
    _line_reporter(out, detect_style(out, os.environ)).print_lines(lines)


def _line_reporter(out: TextIO, style: TerminalStyle, slow: int | None = None) -> PlainReporter:
    if not style.has_color:
        return PlainReporter(out, style, slow)
    from simscen.report.live_console import ColorReporter

    return ColorReporter(out, style, slow)
