"""Evaluates xacro expressions `${…}`: Python expressions with properties, functions, and methods."""

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any

from simscen.sim.urdf.xacro.functions import GLOBAL_FUNCTIONS, METHODS, NAMESPACES, PYTHON_TYPES, Function
from simscen.sim.urdf.xacro.limits import MAX_BITS, MAX_LENGTH, Budget, ExpansionError, Value, check_bounds, size

MAX_EXPRESSION_CHARACTERS = 1000
"""Maximum length of an expression."""

BINARY_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], object]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
}  # fmt: skip
UNARY_OPERATORS: dict[type[ast.unaryop], Callable[[Any], object]] = {
    ast.UAdd: operator.pos, ast.USub: operator.neg, ast.Not: operator.not_
}  # fmt: skip
COMPARISON_OPERATORS: dict[type[ast.cmpop], Callable[[Any, Any], object]] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt,
    ast.GtE: operator.ge, ast.Is: operator.is_, ast.IsNot: operator.is_not,
    ast.In: lambda value, container: value in container, ast.NotIn: lambda value, container: value not in container,
}  # fmt: skip
EXPRESSION_HINT = "use only numbers, texts, lists, comparisons, `a if b else c`, math functions, and properties"

PropertyLookup = Callable[[tuple[str, ...]], Value]
"""Returns the value of the property `a.b`, given as ("a", "b"); raises KeyError if it does not exist."""
Functions = Mapping[tuple[str, ...], Function]
"""Functions by dotted name, such as ("xacro", "load_yaml")."""


def evaluate(text: str, properties: PropertyLookup, budget: Budget, functions: Functions) -> Value:
    """Return the value of an expression, and count its steps in `budget`; raises ExpansionError.

    `functions` can be used in addition to the built-in ones.
    """
    if len(text) > MAX_EXPRESSION_CHARACTERS:
        raise ExpansionError(f"an expression is longer than {MAX_EXPRESSION_CHARACTERS} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError):  # the last two: deeply nested brackets
        raise ExpansionError("not an expression", EXPRESSION_HINT) from None
    return _Evaluation(properties, budget, functions).value(tree.body)


class _Evaluation:
    """Evaluation of one expression; see `evaluate` for the arguments."""

    def __init__(self, properties: PropertyLookup, budget: Budget, functions: Functions) -> None:
        self._properties, self._budget, self._functions = properties, budget, functions

    def value(self, node: ast.expr) -> Value:
        """Return the value of a node of the syntax tree; raises ExpansionError."""
        with self._budget:
            self._budget.spend()
            try:
                value = check_bounds(self._unchecked_value(node))
            except RecursionError:
                raise ExpansionError("the value is nested too deeply") from None
            except (ArithmeticError, TypeError, ValueError, LookupError) as error:
                raise ExpansionError(str(error)[:200] or type(error).__name__) from None
            self._budget.spend(size(value) // 16)
            return value

    def _unchecked_value(self, node: ast.expr) -> object:
        """Return the value of a node, whose type and size must still be checked."""
        match node:
            case ast.Constant(value):
                return value
            case ast.Attribute(mapping, key) if not _is_dotted_name(mapping):
                return lookup(self.value(mapping), key)
            case ast.Name() | ast.Attribute():
                return self._name(node)
            case ast.List(elts) | ast.Tuple(elts):
                return [self.value(each) for each in elts]
            case ast.BinOp(left, op, right) if type(op) in BINARY_OPERATORS:
                return _binary(type(op), self.value(left), self.value(right))
            case ast.UnaryOp(op, operand) if type(op) in UNARY_OPERATORS:
                return UNARY_OPERATORS[type(op)](self.value(operand))
            case ast.BoolOp(op, operands):
                return self._boolean(operands, isinstance(op, ast.Or))
            case ast.Compare(left, ops, comparators):
                return self._comparison(left, ops, comparators)
            case ast.IfExp(test, body, orelse):
                return self.value(body if self.value(test) else orelse)
            case ast.Subscript(container, index):
                return self._subscript(self.value(container), index)
            case ast.Call(function, arguments, keywords):
                return self._call(function, arguments, keywords)
            case _:
                raise ExpansionError(f"{_describe(node)} is not supported", EXPRESSION_HINT)

    def _name(self, node: ast.expr) -> object:
        path = _path(node)
        try:
            return self._properties(path)
        except KeyError:
            builtin = _find_builtin(path)
        if isinstance(builtin, int | float):
            return builtin
        raise ExpansionError(
            f"{'.'.join(path)[:60]!r} is not defined" if builtin is None else f"{path[-1]} is a function, not a value"
        )

    def _boolean(self, operands: list[ast.expr], is_or: bool) -> Value:
        """Return the value of `and` or `or`: the first operand that decides the result, or the last operand."""
        for operand in operands:
            value = self.value(operand)
            if bool(value) is is_or:
                break
        return value

    def _comparison(self, left: ast.expr, ops: list[ast.cmpop], comparators: list[ast.expr]) -> object:
        """Return the value of a chain of comparisons such as `a < b < c`."""
        left_value, result = self.value(left), True
        for op, right in zip(ops, comparators, strict=True):
            right_value = self.value(right)
            result = bool(COMPARISON_OPERATORS[type(op)](left_value, right_value))
            if not result:
                break
            left_value = right_value
        return result

    def _subscript(self, container: Any, index: ast.expr) -> object:
        if isinstance(index, ast.Slice):
            bounds = [None if bound is None else self.value(bound) for bound in (index.lower, index.upper, index.step)]
            return container[slice(*bounds)]
        return container[self.value(index)]

    def _call(self, function: ast.expr, arguments: list[ast.expr], keywords: list[ast.keyword]) -> object:
        match function:
            case ast.Name(name):
                path: tuple[str, ...] = (name,)
            case ast.Attribute(ast.Name(namespace), name) if namespace in NAMESPACES:
                path = (namespace, name)
            case _:
                path = ()
        if path in (("isinstance",), ("python", "isinstance")) and len(arguments) == 2:
            type_name = _path(arguments[1])[-1]
            if type_name not in PYTHON_TYPES:
                raise ExpansionError(f"isinstance() of {type_name[:60]!r} is not supported")
            return isinstance(self.value(arguments[0]), PYTHON_TYPES[type_name])
        found: Function | float | None
        if path:
            found, receiver = self._functions.get(path) or _find_builtin(path), []
        elif isinstance(function, ast.Attribute):
            value = self.value(function.value)
            found, receiver = METHODS.get((type(value), function.attr)), [value]
        else:
            found, receiver = None, []
        if not callable(found):
            raise ExpansionError(f"{ast.unparse(function)[:60]}() is not supported", EXPRESSION_HINT)
        named = {keyword.arg: self.value(keyword.value) for keyword in keywords if keyword.arg is not None}
        if keywords and (found is not dict or len(named) < len(keywords)):
            raise ExpansionError("arguments by name are not supported")
        return found(*receiver, *(self.value(each) for each in arguments), **named)


def _binary(operator_type: type[ast.operator], left: Any, right: Any) -> object:
    """Return the result of a binary operator; raises ExpansionError if the result would be too large."""
    if operator_type is ast.Mult and isinstance(left, str | list) != isinstance(right, str | list):
        sequence, count = (left, right) if isinstance(left, str | list) else (right, left)
        if isinstance(count, int) and size(sequence) * count > MAX_LENGTH:
            raise ExpansionError(f"the value is longer than {MAX_LENGTH}")
    is_integer_power = operator_type is ast.Pow and isinstance(left, int) and isinstance(right, int)
    if is_integer_power and left.bit_length() * right > MAX_BITS:
        raise ExpansionError("the number is too large")
    if operator_type is ast.Mod and isinstance(left, str):
        raise ExpansionError("formatting texts with % is not supported", "write ${…} between the words instead")
    return BINARY_OPERATORS[operator_type](left, right)


def _path(node: ast.expr) -> tuple[str, ...]:
    """Return the parts of a dotted name; raises ExpansionError for any other expression."""
    match node:
        case ast.Name(name):
            return (name,)
        case ast.Attribute(value, name):
            return (*_path(value), name)
        case _:
            raise ExpansionError(f"{_describe(node)} is not a name", EXPRESSION_HINT)


def _is_dotted_name(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) or (isinstance(node, ast.Attribute) and _is_dotted_name(node.value))


def lookup(mapping: Value, key: str) -> Value:
    """Return the value `mapping.key` of a dictionary; raises ExpansionError if there is no such value."""
    if not isinstance(mapping, dict) or key not in mapping:
        raise ExpansionError(f"there is no value {key[:60]!r}")
    return mapping[key]


def _find_builtin(path: tuple[str, ...]) -> Function | float | None:
    """Return the function or constant with a dotted name, or None."""
    match path:
        case (name,):
            return GLOBAL_FUNCTIONS.get(name)
        case (namespace, name):
            return NAMESPACES.get(namespace, {}).get(name)
        case _:
            return None


def _describe(node: ast.expr) -> str:
    """Return a description of an unsupported part of an expression for messages."""
    return {
        ast.Lambda: "a lambda", ast.ListComp: "a comprehension", ast.SetComp: "a comprehension", ast.Dict: "{…}",
        ast.DictComp: "a comprehension", ast.GeneratorExp: "a comprehension", ast.JoinedStr: "an f-string",
        ast.NamedExpr: ":=", ast.BinOp: "this operator", ast.UnaryOp: "this operator",
    }.get(type(node), "this expression")  # fmt: skip
