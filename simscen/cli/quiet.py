"""Keeps what engines print on file descriptor 1 out of the command's own output."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def engine_output_on_stderr() -> Iterator[None]:
    """Bullet prints warnings from C on descriptor 1; send them to standard error meanwhile."""
    sys.stdout.flush()
    saved = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(saved, 1)
        os.close(saved)
