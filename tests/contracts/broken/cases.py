"""How a component or a word of the language that breaks a promise becomes a case."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from typing import Any

from simscen.spec.base import Spec

COUNT = count()


@dataclass(frozen=True)
class Case:
    name: str
    spec: Any
    promise: str
    seen: str


CASES: list[Case] = []


class Wrapper:
    """A component that does as the one it wraps, but for what a subclass does otherwise."""

    def __init__(self, inner: Any, setting: Any) -> None:
        self.inner, self.setting = inner, setting

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)


def breaks(spec: Any, promise: str, seen: str) -> Callable[[type[Wrapper]], type[Wrapper]]:
    """Adds a case: the component of `spec` in this wrapper breaks a promise, and `seen` is said of it."""

    def add(wrapper: type[Wrapper]) -> type[Wrapper]:
        def made(inner: Any, setting: Any) -> Any:
            return wrapper(type(spec).implementation()(inner, setting), setting)

        kind = type(wrapper.__name__, (type(spec),), {"implementation": classmethod(lambda cls: made)})
        CASES.append(Case(wrapper.__name__, kind.model_construct(**dict(spec)), promise, seen))
        return wrapper

    return add


def word(promise: str, seen: str) -> Callable[[type[Spec]], type[Spec]]:
    """Adds a case: a criterion, fault, trigger or action that breaks a promise."""

    def add(kind: type[Spec]) -> type[Spec]:
        CASES.append(Case(kind.__name__, kind(), promise, seen))
        return kind

    return add
