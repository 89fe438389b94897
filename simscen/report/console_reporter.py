"""Choice of the reporter that prints a session on the console, and printing of single lines."""

import os
from collections.abc import Iterable, Mapping
from typing import TextIO

from simscen.report.display_text import ascii_only, escape_ci_commands
from simscen.report.styled_line import StyledLine, TerminalStyle, can_encode, detect_style, plain_text, wrap_line
from simscen.report.text_reporters import PlainReporter, Reporter


def text_reporter(
    out: TextIO, live: bool | None = None, slow: int | None = None, environ: Mapping[str, str] = os.environ
) -> Reporter:
    """Return a reporter with live progress on a terminal, plain lines elsewhere, and color where it is supported.

    `live` overrides the detection for `out`. `slow` is the number of slowest runs to list at the end; 0 lists all.
    """
    style = detect_style(out, environ)
    if live is not None:
        style = TerminalStyle(live or style.color, live, style.terminal)
    if not style.live and not style.color:
        return PlainReporter(out, style, slow)
    from simscen.report.live_console import ColorReporter, LiveReporter  # rich is slow to import

    return LiveReporter(out, style, slow) if style.live else ColorReporter(out, style, slow)


def print_lines(lines: Iterable[StyledLine], out: TextIO, environ: Mapping[str, str] = os.environ) -> None:
    """Print lines, with color where it is supported, wrapped to the width of a terminal."""
    style = detect_style(out, environ)
    wrapped = [part for line in lines for part in wrap_line(line, style.columns)]
    if style.color:
        from simscen.report.live_console import print_colored

        print_colored(wrapped, out, style)
        return
    for line in wrapped:
        text = escape_ci_commands(plain_text(line))
        out.write(f"{text if can_encode(out) else ascii_only(text)}\n")
