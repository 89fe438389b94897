"""PyBullet clients, collision shapes, and bodies. Importing `pybullet` from here suppresses its start-up message."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["pybullet"]


@contextmanager
def _discarded_stderr() -> Iterator[None]:
    """Discard everything that is written to stderr, also by C code."""
    try:
        saved = os.dup(2)
    except OSError:  # stderr is closed
        yield
        return
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 2)
    try:
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(null)


with _discarded_stderr():  # PyBullet prints its build time
    import pybullet
