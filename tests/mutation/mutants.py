"""Mutants of a Python module: one small change each, of the kinds that turn a right verdict into a wrong one."""

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
DROPPED = {"wrap", "wrap_array", "unwrap", "abs", "sorted", "isfinite"}
WORDS = {"left": "right", "right": "left"}


@dataclass(frozen=True)
class Mutant:
    """A change at `line`: `was` became `now`, inside `scope`. `tree` is the module with the change."""

    line: int
    scope: str
    was: str
    now: str
    tree: ast.Module

    @property
    def change(self) -> str:
        """What names it, whatever lines are put in above."""
        return f"{self.scope}: {self.was}  =>  {self.now}"


def mutants(file: Path) -> list[Mutant]:
    """Every mutant of a module, in the order of its lines; equal changes of one scope get a number."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    found, seen = [], {}
    for scope, statement, node in _places(tree):
        for new in _changes(node):
            mutant = _made(tree, scope, statement, node, new)
            seen[mutant.change] = times = seen.get(mutant.change, 0) + 1
            if times > 1:
                mutant = Mutant(mutant.line, mutant.scope, mutant.was, f"{mutant.now}  #{times}", mutant.tree)
            found.append(mutant)
    return found


def _made(tree: ast.Module, scope: str, statement: ast.AST, node: ast.AST, new: ast.AST) -> Mutant:
    """A copy of the tree in which `new` stands for `node`."""
    shown = _shown(statement)
    memo = {id(node): ast.copy_location(new, node)}
    changed = ast.fix_missing_locations(copy.deepcopy(tree, memo))
    after = _shown(copy.deepcopy(statement, {id(node): new}))
    return Mutant(node.lineno, scope, shown, after, changed)


def _shown(statement: ast.AST) -> str:
    """A statement in one line, without what is below it."""
    bare = copy.copy(statement)
    if hasattr(bare, "body") and isinstance(bare.body, list):
        bare.body = [ast.Expr(ast.Constant(...))]
    if hasattr(bare, "orelse") and isinstance(bare.orelse, list):
        bare.orelse = []
    return " ".join(ast.unparse(bare).split())


def _places(tree: ast.Module) -> Iterator[tuple[str, ast.AST, ast.AST]]:
    """Every node that runs, with its scope and statement: no annotations, docstrings, decorators or texts."""

    def walk(node: ast.AST, scope: str, statement: ast.AST) -> Iterator[tuple[str, ast.AST, ast.AST]]:
        if isinstance(node, ast.stmt):
            statement = node
        yield scope, statement, node
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list", "args" if isinstance(node, ast.FunctionDef) else "",
                        "format_spec", "bases", "keywords" if isinstance(node, ast.ClassDef) else ""):  # fmt: skip
                continue
            for child in value if isinstance(value, list) else [value]:
                if not isinstance(child, ast.AST) or _idle(child):
                    continue
                named = isinstance(child, ast.FunctionDef | ast.ClassDef)
                yield from walk(child, f"{scope}.{child.name}".lstrip(".") if named else scope, statement)

    yield from walk(tree, "", tree)


def _idle(node: ast.AST) -> bool:
    """What does nothing: docstrings, imports, assertions for the type checker, texts of errors."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return True
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return True
    return isinstance(node, ast.Import | ast.ImportFrom | ast.Assert | ast.Raise)


def _changes(node: ast.AST) -> Iterator[ast.AST]:
    """What might stand in the place of a node."""
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
        case ast.Constant(str() as value) if value in WORDS:
            yield ast.Constant(WORDS[value])
        case ast.If(test, body, orelse) if not isinstance(test, ast.Compare | ast.UnaryOp | ast.BoolOp):
            yield ast.If(ast.UnaryOp(ast.Not(), test), body, orelse)
        case ast.IfExp(test, body, orelse) if not isinstance(test, ast.Compare | ast.UnaryOp | ast.BoolOp):
            yield ast.IfExp(ast.UnaryOp(ast.Not(), test), body, orelse)
