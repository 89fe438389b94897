"""The docstring under each field of a specification, read from its source when somebody asks.

Pydantic can collect them itself (`use_attribute_docstrings`), but it does so when a class is made, by reading and
parsing source for each class: 45 ms of start-up for every command. Only schema, explain and the reference need them.
"""

import ast
import inspect
import sys
from functools import cache


def field_docs(model: type) -> dict[str, str]:
    """Field name → docstring, those of base classes included."""
    docs: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if base.__module__.partition(".")[0] not in ("builtins", "pydantic", "abc", "typing"):
            docs.update(_of_module(base.__module__).get(base.__name__, {}))
    return docs


@cache
def _of_module(module: str) -> dict[str, dict[str, str]]:
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except OSError:  # a package that was installed without its source
        return {}
    return {node.name: _of_class(node) for node in tree.body if isinstance(node, ast.ClassDef)}


def _of_class(node: ast.ClassDef) -> dict[str, str]:
    docs = {}
    for statement, following in zip(node.body, node.body[1:], strict=False):
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            match following:
                case ast.Expr(value=ast.Constant(value=str(text))):
                    docs[statement.target.id] = inspect.cleandoc(text)
    return docs
