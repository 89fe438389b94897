"""Decorators that register components and scenario entries that break a promise."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from typing import Any

from simscen.spec.base import Spec

COUNT = count()


@dataclass(frozen=True)
class Case:
    """A broken component.

    name: class name of the component
    spec: specification of the component
    promise: start of the name of the promise that the component breaks
    message: part of the error message
    """

    name: str
    spec: Any
    promise: str
    message: str


CASES: list[Case] = []


class Wrapper:
    """A component that forwards all calls to another one; subclasses change some of them."""

    def __init__(self, inner: Any, setting: Any) -> None:
        self.inner, self.setting = inner, setting

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)


def breaks(spec: Any, promise: str, message: str) -> Callable[[type[Wrapper]], type[Wrapper]]:
    """Register a wrapper with which the component of `spec` breaks a promise; the error contains `message`."""

    def add(wrapper: type[Wrapper]) -> type[Wrapper]:
        def build(inner: Any, setting: Any) -> Any:
            return wrapper(type(spec).implementation()(inner, setting), setting)

        kind = type(wrapper.__name__, (type(spec),), {"implementation": classmethod(lambda cls: build)})
        CASES.append(Case(wrapper.__name__, kind.model_construct(**dict(spec)), promise, message))
        return wrapper

    return add


def breaks_contract(promise: str, message: str) -> Callable[[type[Spec]], type[Spec]]:
    """Register a criterion, fault, trigger, action, or metric that breaks a promise."""

    def add(kind: type[Spec]) -> type[Spec]:
        CASES.append(Case(kind.__name__, kind(), promise, message))
        return kind

    return add
