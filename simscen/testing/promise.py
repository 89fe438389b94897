"""Promises, and how they are checked: what the contracts of this kit are made of."""

from __future__ import annotations

import random
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any, ClassVar, TypeVar

import numpy as np

LIMIT = 60.0
"""Seconds of wall time after which a promise counts as broken because its component does not come to an end."""

T = TypeVar("T")


class PromiseBroken(AssertionError):
    """A component does not keep what its protocol promises; the message says what was seen."""


def demand(kept: object, seen: str) -> None:
    """Raise PromiseBroken, with what was seen, unless `kept`."""
    if not kept:
        raise PromiseBroken(seen)


@dataclass(frozen=True)
class Promise:
    """One promise of one subject: `str(promise)` is a sentence, `check()` raises PromiseBroken where it is not kept."""

    role: str
    subject: str
    name: str
    keep: Callable[[], None]

    def __str__(self) -> str:
        return f"{self.subject} {self.name}" if self.subject else self.name

    def check(self, limit: float = LIMIT) -> None:
        """Try it, with global random generators in a state that no other try has."""
        disturb_global_chance()
        with ending_within(limit):
            self.keep()


def promise(method: Callable[[T], None]) -> Callable[[T], None]:
    """Marks a method of a contract as one of its promises; its name is the sentence, its docstring given … then …."""
    method.__is_promise__ = True  # type: ignore[attr-defined]
    return method


class Contract:
    """The promises of one role, for one subject. Each is tried on components that are built anew."""

    role: ClassVar[str]
    subject: str = ""

    def promises(self) -> list[Promise]:
        """All of them, in the order of the contract."""
        names = [n for kind in reversed(type(self).__mro__) for n, v in vars(kind).items() if _is_promise(v)]
        return [Promise(self.role, self.subject, n.replace("_", " "), getattr(self, n)) for n in dict.fromkeys(names)]


def _is_promise(value: Any) -> bool:
    return getattr(value, "__is_promise__", False)


_turn = 0


def disturb_global_chance() -> None:
    """Put the global generators of Python and numpy into a state of their own: who draws from them shows it."""
    global _turn  # noqa: PLW0603
    _turn += 1
    random.seed(_turn)
    np.random.seed(_turn)  # noqa: NPY002


@contextmanager
def ending_within(seconds: float) -> Iterator[None]:
    """Raise PromiseBroken in what does not come to an end. Only the main thread can be interrupted."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def give_up(_number: int, frame: FrameType | None) -> None:
        where = f", at {frame.f_code.co_filename}:{frame.f_lineno}" if frame else ""
        raise PromiseBroken(f"does not come to an end within {seconds:g} s{where}")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
