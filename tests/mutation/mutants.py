"""Create mutants of a Python module: copies with one small change each, such as `<=` instead of `<`."""

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}
SWAPS = (
    ("min", "max"), ("argmin", "argmax"), ("any", "all"), ("minimum", "maximum"), ("floor", "ceil"),
    ("at_most", "at_least"), ("sin", "cos"),
)  # fmt: skip
SWAPPED = {**dict(SWAPS), **{b: a for a, b in SWAPS}}
"""Names that are replaced by other names."""
DROPPED = {"wrap", "wrap_array", "unwrap", "abs", "sorted", "isfinite"}
"""Functions whose call is replaced by the first argument."""
TEXTS = {"left": "right", "right": "left"}
"""String constants that are replaced by others."""


@dataclass(frozen=True)
class Mutant:
    """The module `tree` with one change: at `line` in the function or class `scope`, `before` becomes `after`."""

    line: int
    scope: str
    before: str
    after: str
    tree: ast.Module

    @property
    def change(self) -> str:
        """Description that identifies the mutant in its module. It does not contain the line, which changes often."""
        return f"{self.scope}: {self.before}  =>  {self.after}"


def mutants(file: Path) -> list[Mutant]:
    """Return all mutants of a module in the order of lines. Equal changes in one scope are numbered."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    found, counts = [], {}
    for scope, statement, node in _mutable_nodes(tree):
        for new in _replacements(node):
            mutant = _mutant(tree, scope, statement, node, new)
            counts[mutant.change] = count = counts.get(mutant.change, 0) + 1
            if count > 1:
                mutant = Mutant(mutant.line, mutant.scope, mutant.before, f"{mutant.after}  #{count}", mutant.tree)
            found.append(mutant)
    return found


def _mutant(tree: ast.Module, scope: str, statement: ast.AST, node: ast.AST, new: ast.AST) -> Mutant:
    """Return the mutant in which `new` replaces `node`."""
    before = _as_line(statement)
    memo = {id(node): ast.copy_location(new, node)}
    changed = ast.fix_missing_locations(copy.deepcopy(tree, memo))
    after = _as_line(copy.deepcopy(statement, {id(node): new}))
    return Mutant(node.lineno, scope, before, after, changed)


def _as_line(statement: ast.AST) -> str:
    """Return the code of a statement in one line, without the statements in its body."""
    bare = copy.copy(statement)
    if hasattr(bare, "body") and isinstance(bare.body, list):
        bare.body = [ast.Expr(ast.Constant(...))]
    if hasattr(bare, "orelse") and isinstance(bare.orelse, list):
        bare.orelse = []
    return " ".join(ast.unparse(bare).split())


def _mutable_nodes(tree: ast.Module) -> Iterator[tuple[str, ast.AST, ast.AST]]:
    """Yield scope, statement, and node for each node whose change can have an effect at run time."""

    def walk(node: ast.AST, scope: str, statement: ast.AST) -> Iterator[tuple[str, ast.AST, ast.AST]]:
        if isinstance(node, ast.stmt):
            statement = node
        yield scope, statement, node
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list", "args" if isinstance(node, ast.FunctionDef) else "",
                        "format_spec", "bases", "keywords" if isinstance(node, ast.ClassDef) else ""):  # fmt: skip
                continue
            for child in value if isinstance(value, list) else [value]:
                if not isinstance(child, ast.AST) or _has_no_effect(child):
                    continue
                named = isinstance(child, ast.FunctionDef | ast.ClassDef)
                yield from walk(child, f"{scope}.{child.name}".lstrip(".") if named else scope, statement)

    yield from walk(tree, "", tree)


def _has_no_effect(node: ast.AST) -> bool:
    """Return whether a node is not mutated: docstrings, imports, assertions, raised errors."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return True
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return True
    if isinstance(node, ast.keyword) and node.arg == "strict":  # asserts that the arguments of zip are equally long
        return True
    return isinstance(node, ast.Import | ast.ImportFrom | ast.Assert | ast.Raise)


def _replacements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes that replace a node in mutants."""
    match node:
        case ast.Compare(left, ops, comparators):
            for k, operator in enumerate(ops):
                for other in COMPARISONS.get(type(operator), ()):
                    yield ast.Compare(left, [*ops[:k], other(), *ops[k + 1 :]], comparators)
        case ast.BoolOp(operator, values):
            yield ast.BoolOp(ast.Or() if isinstance(operator, ast.And) else ast.And(), values)
        case ast.UnaryOp(ast.Not() | ast.Invert() | ast.USub(), operand):
            yield operand
        case ast.BinOp(left, operator, right) if type(operator) in ARITHMETIC:
            yield ast.BinOp(left, ARITHMETIC[type(operator)](), right)
        case ast.AugAssign(target, operator, value) if type(operator) in ARITHMETIC:
            yield ast.AugAssign(target, ARITHMETIC[type(operator)](), value)
        case ast.Call(ast.Name(name), [first, *_]) | ast.Call(ast.Attribute(_, name), [first, *_]) if name in DROPPED:
            yield first
        case ast.Name(name, ast.Load()) if name in SWAPPED:
            yield ast.Name(SWAPPED[name], ast.Load())
        case ast.Attribute(value, name, context) if name in SWAPPED and not ast.unparse(value).startswith("self"):
            yield ast.Attribute(value, SWAPPED[name], context)
        case ast.Constant(bool() as value):
            yield ast.Constant(not value)
        case ast.Constant(int() as value):
            yield ast.Constant(value + 1)
        case ast.Constant(float() as value):
            yield ast.Constant(value * 1.25 if value else 0.125)
        case ast.Constant(str() as value) if value in TEXTS:
            yield ast.Constant(TEXTS[value])
        case ast.If(test, body, orelse) if not isinstance(test, ast.Compare | ast.UnaryOp | ast.BoolOp):
            yield ast.If(ast.UnaryOp(ast.Not(), test), body, orelse)
        case ast.IfExp(test, body, orelse) if not isinstance(test, ast.Compare | ast.UnaryOp | ast.BoolOp):
            yield ast.IfExp(ast.UnaryOp(ast.Not(), test), body, orelse)
