"""Tests that each numeric constant of the reference stack has a docstring."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

import simscen.stack

ROOT = Path(simscen.stack.__file__).parent


class Constant(NamedTuple):
    """Constants of one assignment at the top of a module, with the docstring below the assignment."""

    module: str
    names: tuple[str, ...]
    text: str


def constants() -> Iterator[Constant]:
    """Yield the public constants whose value is a number or a tuple of numbers."""
    for path in sorted(ROOT.rglob("*.py")):
        body = ast.parse(path.read_text(encoding="utf-8")).body
        for statement, next_statement in zip(body, [*body[1:], None], strict=True):
            if not isinstance(statement, ast.Assign) or not is_number(statement.value):
                continue
            names = tuple(ast.unparse(statement.targets[0]).strip("()").split(", "))
            if names[0].isupper() and not names[0].startswith("_"):
                yield Constant(path.relative_to(ROOT).as_posix(), names, docstring(next_statement))


def is_number(value: ast.expr) -> bool:
    try:
        literal = ast.literal_eval(value)
    except (ValueError, TypeError):
        return False
    parts = literal if isinstance(literal, tuple) else (literal,)
    return all(isinstance(part, int | float) and not isinstance(part, bool) for part in parts)


def docstring(statement: ast.stmt | None) -> str:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return str(statement.value.value)
    return ""


CONSTANTS = list(constants())


def test_numeric_constants_are_found() -> None:
    assert len(CONSTANTS) > 100


@pytest.mark.parametrize("constant", CONSTANTS, ids=lambda constant: f"{constant.module}:{constant.names[0]}")
def test_every_numeric_constant_is_documented(constant: Constant) -> None:
    assert len(constant.text) >= 15
