"""The console: plain lines when piped, colors and live progress on a terminal."""

import os
from collections.abc import Mapping
from typing import TextIO

from simscen.report.look import Look, look_of
from simscen.report.plain import PlainReporter, Reporter


def text_reporter(
    out: TextIO, live: bool | None = None, slow: int | None = None, environ: Mapping[str, str] = os.environ
) -> Reporter:
    """For people: live on a terminal, plain lines elsewhere, in color where that is wanted.

    `live` overrides what `out` says it is. `slow` is how many of the slowest runs to list in the end; 0 = all.
    """
    look = look_of(out, environ)
    if live is not None:
        look = Look(live or look.color, live, look.terminal)
    if not look.live and not look.color:
        return PlainReporter(out, look, slow)
    from simscen.report.live import ColorReporter, LiveReporter  # rich, which lists and pipes need not wait for

    return LiveReporter(out, look, slow) if look.live else ColorReporter(out, look, slow)
