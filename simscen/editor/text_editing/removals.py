"""Remove keys and items from a YAML text together with their line breaks or commas."""

from simscen.editor.text_editing.insertions import dash_before
from simscen.editor.text_editing.splices import EditRefused, Splice, line_end, line_start, path_text
from simscen.loading.yaml.source_nodes import SourceNode, source_at
from simscen.loading.yaml.tree import Key


def removed_part(text: str, source: SourceNode, keys: tuple[Key, ...]) -> Splice:
    """Return the splice that removes a key or an item. Raises EditRefused if it is not in this text."""
    parent, node = source_at(source, keys[:-1]), source_at(source, keys)
    if not keys or parent is None or node is None:
        raise EditRefused(f"{path_text(keys)} is not written out in this file; edit the text, or the file that has it")
    if parent.kind == "sequence":
        assert isinstance(keys[-1], int)
        parts = [(item.start, item.end) for item in parent.items]
        if not parent.flow:
            parts = [(dash_before(text, start), max(end, dash_before(text, start) + 1)) for start, end in parts]
        number = keys[-1]
    else:
        parts = [(entry.start, max(entry.end, entry.value.end)) for entry in parent.entries.values()]
        number = list(parent.entries).index(str(keys[-1]))
    if parent.flow:
        return _from_flow(parent, parts, number)
    if len(parts) == 1:
        begin = len(text[: parent.start].rstrip())
        empty = "[]" if parent.kind == "sequence" else "{}"
        is_behind_key = text[begin - 1 : begin] == ":"
        return Splice(begin if is_behind_key else parent.start, parent.end, f" {empty}" if is_behind_key else empty)
    return _from_block(text, parts, number)


def _from_flow(parent: SourceNode, parts: list[tuple[int, int]], number: int) -> Splice:
    """Remove a part of a list or mapping in brackets with the comma before it; of the first part, the one after it."""
    start, end = parts[number]
    if len(parts) == 1:
        return Splice(parent.start + 1, parent.end - 1, "")
    if number == 0:
        return Splice(start, parts[1][0], "")
    return Splice(parts[number - 1][1], end, "")


def _from_block(text: str, parts: list[tuple[int, int]], number: int) -> Splice:
    """Remove the lines of a part; of one that begins within a line, all up to the next part."""
    start, end = parts[number]
    begin = line_start(text, start)
    if text[begin:start].strip():
        if number + 1 == len(parts):
            return Splice(parts[number - 1][1], end, "")
        return Splice(start, parts[number + 1][0], "")
    stop = line_end(text, end)
    if stop == len(text) and begin > 0:
        return Splice(begin - 1, stop, "")
    return Splice(begin, min(stop + 1, len(text)), "")
