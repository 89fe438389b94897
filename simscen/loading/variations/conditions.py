"""Parsing and evaluation of conditions on varied values, such as `goals[0].pose.x > robot.pose.x + 1`.

Conditions are under the key `require`. They have the syntax of Python expressions, but they are parsed with `ast` and
never executed as Python. The function `value` takes a path as text: `pass.clearance.min` is not valid Python.
"""

import ast
import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from simscen.core.geometry import wrap
from simscen.loading.variations.options import Change
from simscen.loading.variations.paths import PathError, resolve_path
from simscen.loading.yaml.tree import Keys, MappingNode, existing_keys, node_at
from simscen.spec.quantities import si_number

# Operators and functions that conditions can contain, in addition to `and`, `or`, and `not`.
_COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne,
}  # fmt: skip
_OPERATORS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
}  # fmt: skip
_FUNCTIONS: dict[str, Callable[..., float]] = {
    "abs": abs, "min": lambda *numbers: min(numbers), "max": lambda *numbers: max(numbers), "hypot": math.hypot,
    "wrap": wrap,
}  # fmt: skip
GRAMMAR = (
    "comparisons such as `goals[0].pose.x > robot.pose.x + 1` with and, or, not, + - * /, abs, min, max, hypot, wrap; "
    "quantities in quotes: '50 cm'; value('pass.clearance.min') for paths with keywords of Python"
)
"""Hint that describes the syntax of conditions."""


class ConditionError(ValueError):
    """A condition is invalid, or cannot be evaluated with the values of a variation."""


@dataclass(frozen=True)
class Condition:
    """Condition on values: its text in the file, the parsed expression, and the paths in the expression."""

    text: str
    expression: ast.expr
    paths: tuple[str, ...]

    def holds(self, values: Mapping[str, Any]) -> bool:
        """Return whether the condition holds. `values` are the YAML data by path, with units. Raises ConditionError."""
        try:
            result = _evaluate(self.expression, values)
        except (TypeError, ValueError, ArithmeticError, RecursionError) as error:
            raise ConditionError(f"`{self.text}` cannot be evaluated: {error}") from error
        if not isinstance(result, bool):
            raise ConditionError(f"`{self.text}` is {result!r} instead of true or false")
        return result


def parse_condition(text: str) -> Condition:
    """Return the condition in a text. Raises ConditionError if it is invalid."""
    paths: dict[str, None] = {}
    try:
        expression = ast.parse(text.strip(), mode="eval").body
        _collect_paths(expression, text, paths)
    except ConditionError:
        raise
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise ConditionError(f"`{text}` is not a condition") from None
    return Condition(text, expression, tuple(paths))


def _collect_paths(node: ast.expr, text: str, paths: dict[str, None]) -> None:
    """Add the paths in an expression to the keys of `paths`. Raises ConditionError for invalid syntax."""
    match node:
        case ast.BoolOp(values=parts):
            pass
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
            parts = [operand]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            parts = [left, right]
        case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in _COMPARISONS for op in ops):
            parts = [left, *others]
        case ast.Constant(value=bool() | int() | float() | str()):
            parts = []
        case ast.Call(func=ast.Name(id=name), args=parts, keywords=[]) if name in _FUNCTIONS and parts:
            pass
        case ast.Call(func=ast.Name(id="value"), args=[ast.Constant(value=str(path))], keywords=[]):
            paths[path] = None
            parts = []
        case ast.Name() | ast.Attribute() | ast.Subscript():
            paths[_path_text(node, text)] = None
            parts = []
        case _:
            raise ConditionError(f"`{ast.unparse(node)}` cannot be used in a condition")
    for part in parts:
        _collect_paths(part, text, paths)


def _path_text(node: ast.expr, text: str) -> str:
    """Return the text of a path such as `goals[0].pose.x` in the condition `text`. Raises ConditionError."""
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(value=owner, attr=name):
            return f"{_path_text(owner, text)}.{name}"
        case ast.Subscript(value=owner, slice=ast.Constant(value=int(index))) if type(index) is int and index >= 0:
            return f"{_path_text(owner, text)}[{index}]"
        case ast.Subscript(value=owner, slice=ast.Constant(value=str(name))):
            return f'{_path_text(owner, text)}["{name}"]'
    raise ConditionError(f"`{ast.unparse(node)}` in `{text}` is not a path")


def _evaluate(node: ast.expr, values: Mapping[str, Any]) -> Any:
    """Return the value of an expression: a number in SI units, a text, or a boolean. `values` are values by path.

    Raises TypeError, ValueError, ArithmeticError, or RecursionError if the expression cannot be evaluated.
    """
    match node:
        case ast.BoolOp(op=ast.And(), values=parts):
            return all(_evaluate_boolean(part, values) for part in parts)
        case ast.BoolOp(values=parts):
            return any(_evaluate_boolean(part, values) for part in parts)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return not _evaluate_boolean(operand, values)
        case ast.UnaryOp(operand=operand):
            return -_evaluate_number(operand, values)
        case ast.BinOp(left=left, op=op, right=right):
            return _OPERATORS[type(op)](_evaluate_number(left, values), _evaluate_number(right, values))
        case ast.Compare(left=left, ops=ops, comparators=others):
            numbers = [_evaluate(part, values) for part in (left, *others)]
            return all(_COMPARISONS[type(op)](a, b) for op, a, b in zip(ops, numbers, numbers[1:], strict=False))
        case ast.Constant(value=value):
            return si_number(value)
        case ast.Call(func=ast.Name(id="value"), args=[ast.Constant(value=str(path))]):
            return si_number(values[path])
        case ast.Call(func=ast.Name(id=name), args=parts):
            return _FUNCTIONS[name](*[_evaluate_number(part, values) for part in parts])
    return si_number(values[_path_text(node, "")])


def _evaluate_boolean(node: ast.expr, values: Mapping[str, Any]) -> bool:
    """Return the boolean value of an expression. Raises the errors of `_evaluate`; TypeError also for other values."""
    result = _evaluate(node, values)
    if not isinstance(result, bool):
        raise TypeError(f"`{ast.unparse(node)}` is {result!r} instead of true or false")
    return result


def _evaluate_number(node: ast.expr, values: Mapping[str, Any]) -> float:
    """Return the number that an expression has as its value. Raises the errors of `_evaluate`."""
    result = _evaluate(node, values)
    if isinstance(result, bool) or not isinstance(result, int | float):
        raise TypeError(f"`{ast.unparse(node)}` is {result!r} instead of a number")
    return result


def all_hold(conditions: Sequence[Condition], tree: MappingNode, changes: Iterable[Change]) -> bool:
    """Return whether all conditions hold for the scenario `tree` with these changes. Raises ConditionError."""
    paths = {path for condition in conditions for path in condition.paths}
    changed = tree
    for change in changes if paths else ():
        changed = changed.with_value(change.target.keys, change.value, change.target.position)
    values = {path: _value(changed, condition_keys(tree, path)) for path in sorted(paths)}
    return all(condition.holds(values) for condition in conditions)


def condition_keys(tree: MappingNode, path: str) -> Keys:
    """Return the keys of a path in a condition on the scenario `tree`; () if the path leads to no value."""
    try:
        return resolve_path(path, tree.position, tree).keys
    except PathError:
        return ()


def written_value(tree: MappingNode, path: str) -> Any:
    """Return the YAML data at a path of the scenario; None if there is no value."""
    return _value(tree, condition_keys(tree, path))


def _value(tree: MappingNode, keys: Keys) -> Any:
    """Return the YAML data at these keys; None if there is no value."""
    return node_at(tree, keys).plain if keys and existing_keys(tree, keys) == keys else None
