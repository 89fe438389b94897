"""The thing on the map that a problem of the text is about."""

from collections.abc import Sequence

from simscen.core.errors import Problem
from simscen.editor.map_view.map_objects import MapObject
from simscen.loading.yaml.source_nodes import SourceNode, source_at


def object_at_problem(problem: Problem, objects: Sequence[MapObject], source: SourceNode | None, text: str) -> str:
    """Return the id of the smallest thing whose text contains the position of a problem; "" if there is none.

    If none contains it, this is the smallest one that begins later in the same line, such as behind a key.
    """
    if not problem.line or source is None:
        return ""
    lines = text.split("\n")
    line_start = sum(len(line) + 1 for line in lines[: problem.line - 1])
    index, line_end = line_start + max(problem.col - 1, 0), line_start + len(lines[problem.line - 1])
    nodes = [(node, one) for one in objects if one.keys and (node := source_at(source, one.keys)) is not None]
    around = [(node.end - node.start, one) for node, one in nodes if node.start <= index <= node.end]
    behind = [(node.end - node.start, one) for node, one in nodes if index < node.start <= line_end]
    found = around or behind
    return "/".join(map(str, min(found, key=lambda each: each[0])[1].keys)) if found else ""
