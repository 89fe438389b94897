"""Choice of the reporter that prints a session on the console."""

import os
from collections.abc import Mapping
from typing import TextIO

from simscen.report.styled_line import TerminalStyle, detect_style
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
