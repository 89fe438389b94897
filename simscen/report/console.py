"""Choice of the reporter that prints a session."""

import os
from collections.abc import Mapping
from typing import TextIO

from simscen.report.styled_line import TerminalStyle, detect_style
from simscen.report.text_reporters import PlainReporter, Reporter


def text_reporter(
    out: TextIO, live: bool | None = None, slow: int | None = None, environ: Mapping[str, str] = os.environ
) -> Reporter:
    """Return a reporter that is live on a terminal, writes plain lines elsewhere, and uses color where possible.

    `live` overrides what is detected for `out`. `slow` is the number of slowest runs to list at the end; 0 lists all.
    """
    look = detect_style(out, environ)
    if live is not None:
        look = TerminalStyle(live or look.color, live, look.terminal)
    if not look.live and not look.color:
        return PlainReporter(out, look, slow)
    from simscen.report.live_console import ColorReporter, LiveReporter  # rich is slow to import

    return LiveReporter(out, look, slow) if look.live else ColorReporter(out, look, slow)
