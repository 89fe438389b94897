"""Tests of the YAML parser: positions, problems, and limits."""

import resource

import pytest

from simscen.core.errors import Problem
from simscen.loading.yaml.parser import MAX_DEPTH, parse_yaml
from simscen.loading.yaml.tree import Node, key_position, value_position


def _tree(text: str) -> Node:
    tree, problems = parse_yaml(text, "f")
    assert tree is not None
    assert not problems
    return tree


def _problem(text: str) -> Problem:
    _, problems = parse_yaml(text, "f")
    assert len(problems) == 1
    return problems[0]


def test_every_key_and_value_has_its_position() -> None:
    tree = _tree("a: 1\nb:\n  - x: y\n    z: {u: v}\n")
    assert key_position(tree, ("b", 0, "z", "u"))[1:] == (4, 9)
    assert value_position(tree, ("b", 0, "z", "u"))[1:] == (4, 12)
    assert value_position(tree, ("b", 0))[1:] == (3, 5)
    assert key_position(tree, ("b",))[1:] == (2, 1)


def test_columns_count_characters_not_bytes() -> None:
    assert value_position(_tree("{é机: 1, b: 2}"), ("b",))[1:] == (1, 12)


def test_empty_value_has_the_position_of_its_key() -> None:
    assert value_position(_tree("a:\n  b:\nc: 1\n"), ("a", "b"))[1:] == (2, 3)


def test_quoted_scalars_and_keys_are_text() -> None:
    assert _tree("'1': \"true\"\n2: '3'\non: 'null'").plain == {"1": "true", "2": "3", "on": "null"}


def test_block_scalars_are_text() -> None:
    assert _tree("a: |\n  1\n  2\nb: >\n  3\n").plain == {"a": "1\n2\n", "b": "3\n"}


def test_anchors_and_merge_keys_work() -> None:
    text = "base: &base {x: 1, y: 2}\nother: &other {y: 3, z: 4}\nmade:\n  <<: [*base, *other]\n  x: 5\nsame: *base\n"
    assert _tree(text).plain["made"] == {"x": 5, "y": 2, "z": 4}  # type: ignore[index]
    assert _tree(text).plain["same"] == {"x": 1, "y": 2}  # type: ignore[index]


def test_merged_keys_keep_their_positions() -> None:
    tree = _tree("base: &base {x: 1}\nmade: {<<: *base, y: 2}\n")
    assert key_position(tree, ("made", "x"))[1:] == (1, 14)


def test_duplicate_keys_are_reported_with_both_positions() -> None:
    _, problems = parse_yaml("a: 1\nb: {c: 1, c: 2}\na: 3\n", "f")
    assert [(p.line, p.col, p.message) for p in problems] == [
        (2, 11, "duplicate key `c` (first at 2:5)"),
        (3, 1, "duplicate key `a` (first at 1:1)"),
    ]


TOO_DEEP, ODD_KEY = f"nested deeper than {MAX_DEPTH}", "a key must be text; it is a list, a mapping or an alias"


@pytest.mark.parametrize(
    ("opening", "output"), [("[", TOO_DEEP), ("{a: ", TOO_DEEP), ("- ", TOO_DEEP), ("? ", ODD_KEY)]
)
def test_deep_nesting_is_refused(opening: str, output: str) -> None:
    assert _problem(opening * 200_000).message == output


def test_forty_levels_are_valid() -> None:
    _tree("[" * MAX_DEPTH + "]" * MAX_DEPTH)


def test_aliases_cannot_nest_deeper_either() -> None:
    text = "a: &a " + "[" * 30 + "]" * 30 + "\nb: " + "[" * 15 + "*a" + "]" * 15
    assert _problem(text).message == f"nested deeper than {MAX_DEPTH}"


def test_an_alias_bomb_is_refused_at_its_line_without_memory() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 10)]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    problem = _problem("\n".join(lines))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000
    assert problem.message == "aliases expand to more than 100000 values"
    assert problem.line == 5


def test_ordinary_aliases_do_not_cost_the_budget() -> None:
    _tree("a: &a [1, 2, 3]\nb: [" + ", ".join(["*a"] * 1000) + "]")


def test_too_many_values_are_refused() -> None:
    assert _problem("[" + "1, " * 100_001 + "]").message == "the file has more than 100000 values"


@pytest.mark.parametrize("text", ["&a [*a]", "a: &a {b: [*a]}"])
def test_a_self_reference_is_refused(text: str) -> None:
    assert _problem(text).message == "alias `*a` contains itself"


@pytest.mark.parametrize("text", ["", "\n\n", "# only a comment\n", "---\n...\n"])
def test_an_empty_file_is_reported(text: str) -> None:
    tree, problems = parse_yaml(text, "f")
    assert [p.message for p in problems] == ["the file is empty"] or (tree is not None and tree.plain is None)


def test_a_second_document_is_refused() -> None:
    assert _problem("a: 1\n---\nb: 2\n").message == "more than one YAML document (line 2)"


@pytest.mark.parametrize("tag", ["!!int", "!!python/object/apply:os.system", "!mine", "!!str", "!"])
def test_tags_are_refused(tag: str) -> None:
    assert "is not allowed" in _problem(f"a: {tag} x").message


@pytest.mark.parametrize("text", ["? [a]\n: b", "? {a: 1}\n: b", "a: &a x\n*a : b"])
def test_keys_are_text(text: str) -> None:
    assert _problem(text).message.startswith("a key must be text")


def test_a_tab_is_named() -> None:
    problem = _problem("a:\n\tb: 1\n")
    assert (problem.line, problem.col, problem.message) == (2, 1, "tab character")


def test_position_of_a_syntax_error_is_inside_the_file() -> None:
    for text in [
        "a: [1, 2",
        "a: 'x",
        "a: {b",
        'a: "\\q"',
        "a: b: c",
        "@",
        "a: |1\nb",
        "%YAML 9.9\n---\na",
        "- a\nb: c",
        "\ta: 1",
    ]:
        problem = _problem(text)
        lines = text.split("\n")
        assert 1 <= problem.line <= len(lines)
        assert 1 <= problem.col <= len(lines[problem.line - 1]) + 1


@pytest.mark.parametrize(
    ("text", "place", "message", "hint"),
    [
        ("a: 1\nb 2\nc: 3\n", (2, 1), "`:` is missing after this key", "write `key: value`"),
        ("a: 1\nb\n", (2, 1), "`:` is missing after this key", "write `key: value`"),
        ("a:1\nb: 2\n", (2, 2), "unexpected `:`", "write a space after each `:`"),
        ("name: one: two\n", (1, 10), "unexpected `:`", "quote texts that contain `: `"),
        ("a: 1\n b: 2\n", (2, 3), "unexpected `:`", "indent all keys of a mapping alike"),
        ("a:\n  b: 1\n c: 2\n", (3, 2), "expected a key in the mapping that starts at 1:1", "indent all keys"),
        ("a: 'it's'\n", (1, 8), "expected a key in the mapping that starts at 1:1", "nothing after a closing quote"),
        ("a:\n  - 1\n  -2\n", (3, 3), "`:` is missing after this key", "or `- value` for an item of a list"),
        ("a:\n  - b: 1\n  -c: 2\n", (3, 3), "begins with `- ` in the list that starts at 2:3", "indent all items"),
        ("a: - 1\n", (1, 4), "unexpected `- `", "on a line of its own"),
        ("a: @home\n", (1, 4), "a value cannot begin with this character", "put the value in quotes"),
        ("a: {b: 1\nc: 2\n", (2, 2), "expected `,` or `}` in the mapping that starts at 1:4", ""),
        ("a: [1, , 2]\n", (1, 8), "expected a value", ""),
        ("a: {b: 1\n", (1, 4), "this mapping in braces is not closed", ""),
        ("a: &\n", (1, 5), "while scanning an anchor that starts at 1:4", ""),
    ],
)
def test_common_syntax_errors_say_what_to_write(text: str, place: tuple[int, int], message: str, hint: str) -> None:
    problem = _problem(text)
    assert (problem.line, problem.col) == place
    assert message in problem.message
    assert hint in problem.hint
