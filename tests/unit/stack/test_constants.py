"""Tests that each numeric constant of the reference stack states what it is."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

import simscen.stack

ROOT = Path(simscen.stack.__file__).parent


class Constant(NamedTuple):
    """A constant at the top of a module, with the text below it."""

    module: str
    names: tuple[str, ...]
    text: str


def constants() -> Iterator[Constant]:
    """Return the public constants whose value is a number or a tuple of numbers."""
    for path in sorted(ROOT.rglob("*.py")):
        body = ast.parse(path.read_text(encoding="utf-8")).body
        for statement, after in zip(body, [*body[1:], None], strict=True):
            if not isinstance(statement, ast.Assign) or not is_number(statement.value):
                continue
            names = tuple(ast.unparse(statement.targets[0]).strip("()").split(", "))
            if names[0].isupper() and not names[0].startswith("_"):
                yield Constant(path.relative_to(ROOT).as_posix(), names, docstring(after))


def is_number(value: ast.expr) -> bool:
    try:
        found = ast.literal_eval(value)
    except (ValueError, TypeError):
        return False
    parts = found if isinstance(found, tuple) else (found,)
    return all(isinstance(part, int | float) and not isinstance(part, bool) for part in parts)


def docstring(statement: ast.stmt | None) -> str:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return str(statement.value.value)
    return ""


CONSTANTS = list(constants())


def test_numeric_constants_are_found() -> None:
    assert len(CONSTANTS) > 100


@pytest.mark.parametrize("constant", CONSTANTS, ids=lambda each: f"{each.module}:{each.names[0]}")
def test_every_numeric_constant_is_documented(constant: Constant) -> None:
    assert len(constant.text) >= 15
