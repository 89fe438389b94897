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
    ast.In: lambda one, many: one in many, ast.NotIn: lambda one, many: one not in many,
}  # fmt: skip
EXPRESSION_HINT = "supported are numbers, texts, lists, comparisons, `a if b else c`, math functions, and properties"

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
            case ast.Attribute(whole, key) if not _is_dotted_name(whole):
                return item(self.value(whole), key)
            case ast.Name() | ast.Attribute():
                return self._name(node)
            case ast.List(elts) | ast.Tuple(elts):
                return [self.value(each) for each in elts]
            case ast.BinOp(left, kind, right) if type(kind) in BINARY_OPERATORS:
                return _binary(type(kind), self.value(left), self.value(right))
            case ast.UnaryOp(kind, operand) if type(kind) in UNARY_OPERATORS:
                return UNARY_OPERATORS[type(kind)](self.value(operand))
            case ast.BoolOp(kind, values):
                return self._boolean(values, isinstance(kind, ast.Or))
            case ast.Compare(left, kinds, others):
                return self._comparison(left, kinds, others)
            case ast.IfExp(test, body, orelse):
                return self.value(body if self.value(test) else orelse)
            case ast.Subscript(whole, index):
                return self._subscript(self.value(whole), index)
            case ast.Call(function, arguments, keywords):
                return self._call(function, arguments, keywords)
            case _:
                raise ExpansionError(f"{_describe(node)} is not supported", EXPRESSION_HINT)

    def _name(self, node: ast.expr) -> object:
        path = _path(node)
        try:
            return self._properties(path)
        except KeyError:
            known = _find_builtin(path)
        if isinstance(known, int | float):
            return known
        raise ExpansionError(
            f"{'.'.join(path)[:60]!r} is not defined" if known is None else f"{path[-1]} is a function, not a value"
        )

    def _boolean(self, values: list[ast.expr], is_or: bool) -> Value:
        """Return the value of `and` or `or`: the first operand that decides it, or the last one."""
        for each in values:
            value = self.value(each)
            if bool(value) is is_or:
                break
        return value

    def _comparison(self, left: ast.expr, kinds: list[ast.cmpop], others: list[ast.expr]) -> object:
        before, result = self.value(left), True
        for kind, other in zip(kinds, others, strict=True):
            after = self.value(other)
            result = bool(COMPARISON_OPERATORS[type(kind)](before, after))
            if not result:
                break
            before = after
        return result

    def _subscript(self, whole: Any, index: ast.expr) -> object:
        if isinstance(index, ast.Slice):
            ends = [None if end is None else self.value(end) for end in (index.lower, index.upper, index.step)]
            return whole[slice(*ends)]
        return whole[self.value(index)]

    def _call(self, function: ast.expr, arguments: list[ast.expr], keywords: list[ast.keyword]) -> object:
        match function:
            case ast.Name(name):
                path: tuple[str, ...] = (name,)
            case ast.Attribute(ast.Name(space), name) if space in NAMESPACES:
                path = (space, name)
            case _:
                path = ()
        if path in (("isinstance",), ("python", "isinstance")) and len(arguments) == 2:
            kind = _path(arguments[1])[-1]
            if kind not in PYTHON_TYPES:
                raise ExpansionError(f"isinstance() of {kind[:60]!r} is not supported")
            return isinstance(self.value(arguments[0]), PYTHON_TYPES[kind])
        known: Function | float | None
        if path:
            known, receiver = self._functions.get(path) or _find_builtin(path), []
        elif isinstance(function, ast.Attribute):
            value = self.value(function.value)
            known, receiver = METHODS.get((type(value), function.attr)), [value]
        else:
            known, receiver = None, []
        if not callable(known):
            raise ExpansionError(f"{ast.unparse(function)[:60]}() is not supported", EXPRESSION_HINT)
        named = {keyword.arg: self.value(keyword.value) for keyword in keywords if keyword.arg is not None}
        if keywords and (known is not dict or len(named) < len(keywords)):
            raise ExpansionError("arguments by name are not supported")
        return known(*receiver, *(self.value(each) for each in arguments), **named)


def _binary(kind: type[ast.operator], left: Any, right: Any) -> object:
    """Return the result of a binary operator; raises ExpansionError if the result would be too large."""
    if kind is ast.Mult and isinstance(left, str | list) != isinstance(right, str | list):
        many, times = (left, right) if isinstance(left, str | list) else (right, left)
        if isinstance(times, int) and size(many) * times > MAX_LENGTH:
            raise ExpansionError(f"the value is longer than {MAX_LENGTH}")
    if kind is ast.Pow and isinstance(left, int) and isinstance(right, int) and left.bit_length() * right > MAX_BITS:
        raise ExpansionError("the number is too large")
    if kind is ast.Mod and isinstance(left, str):
        raise ExpansionError("formatting texts with % is not supported", "write ${…} between the words instead")
    return BINARY_OPERATORS[kind](left, right)


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


def item(whole: Value, key: str) -> Value:
    """Return the value `whole.key` of a dictionary; raises ExpansionError if there is none."""
    if not isinstance(whole, dict) or key not in whole:
        raise ExpansionError(f"there is no value {key[:60]!r}")
    return whole[key]


def _find_builtin(path: tuple[str, ...]) -> Function | float | None:
    """Return the function or constant with a dotted name, or None."""
    match path:
        case (name,):
            return GLOBAL_FUNCTIONS.get(name)
        case (space, name):
            return NAMESPACES.get(space, {}).get(name)
        case _:
            return None


def _describe(node: ast.expr) -> str:
    """Return a description of an unsupported part of an expression for messages."""
    return {
        ast.Lambda: "a lambda", ast.ListComp: "a comprehension", ast.SetComp: "a comprehension", ast.Dict: "{…}",
        ast.DictComp: "a comprehension", ast.GeneratorExp: "a comprehension", ast.JoinedStr: "an f-string",
        ast.NamedExpr: ":=", ast.BinOp: "this operator", ast.UnaryOp: "this operator",
    }.get(type(node), "this expression")  # fmt: skip
