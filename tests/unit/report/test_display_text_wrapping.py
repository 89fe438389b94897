"""Tests of wrapping at the width of a terminal."""

import shlex
import subprocess

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from simscen.report.display_text import StyledText, display_width, plain_text, wrap_line

RUN = (
    StyledText("  "),
    StyledText("✓", "good"),
    StyledText(" navigation/goal ", "name"),
    StyledText("  18.2 s simulated in 0.21 s", "quiet"),
    StyledText("   tightest: path_length +0.14 m, 1 % of its limit", "quiet"),
)


def wrapped_lines(line, columns):
    """Return the plain text of a line that is wrapped at a width."""
    return [plain_text(part) for part in wrap_line(line, columns)]


def test_column_is_wrapped_as_a_whole():
    assert wrapped_lines(RUN, 80) == [
        "  ✓ navigation/goal   18.2 s simulated in 0.21 s",
        "    tightest: path_length +0.14 m, 1 % of its limit",
    ]


def test_long_column_is_wrapped_between_words():
    assert wrapped_lines(RUN, 40) == [
        "  ✓ navigation/goal",
        "    18.2 s simulated in 0.21 s",
        "    tightest: path_length +0.14 m, 1 %",
        "    of its limit",
    ]


def test_text_after_a_label_has_a_hanging_indent():
    line = (StyledText("      happened  ", "quiet"), StyledText("the pallet falls: t = 10.00 s, it fell"))
    assert wrapped_lines(line, 42) == ["      happened  the pallet falls: t =", "              10.00 s, it fell"]


@pytest.mark.parametrize("columns", [40, 60, 80])
def test_wrapped_command_can_be_copied(columns):
    words = ["simscen", "run", "a b.yaml", "--stack", "mine=./my_nav --verbose", "--world-path", "worlds", "--lenient"]
    lines = wrapped_lines(
        (StyledText("      again     ", "quiet"), StyledText(shlex.join(words), is_shell=True)), columns
    )
    assert len(lines) > 1
    assert all(len(line) <= columns for line in lines)
    text = "\n".join(lines).replace("again", "", 1).strip()
    shell = ["bash", "-c", f"printf '%s\\0' {text}"]
    assert subprocess.run(shell, capture_output=True, text=True, check=True).stdout.split("\0")[:-1] == words


def test_long_path_is_not_broken():
    path = "simscen-out/20261122T074142Z-09d4/runs/scenarios/faults/lidar_off/seed-1/map.png"
    line = (StyledText("      picture   ", "quiet"), StyledText(path, file=path))
    assert wrapped_lines(line, 40)[-1] == path
    assert wrapped_lines(line, len(path) + 2) == ["      picture", f"  {path}"]


def test_wrapping_breaks_only_at_spaces():
    line = (
        StyledText("1 passed", "good"),
        StyledText(", "),
        StyledText("1 failed", "bad"),
        StyledText(" · and a good deal more"),
    )
    assert all(not text.lstrip().startswith(",") for columns in range(9, 40) for text in wrapped_lines(line, columns))


def test_lines_are_not_wrapped_without_a_terminal():
    assert wrap_line(RUN, None) == [RUN]


TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Zl", "Zp")), max_size=60)


@given(st.lists(TEXTS, min_size=1, max_size=4), st.integers(20, 100))
@example(["  ", "", " a ", "b"], 20)
def test_wrapping_keeps_all_words_in_order_within_the_width(parts, columns):
    line = tuple(StyledText(part) for part in parts)
    lines = wrapped_lines(line, columns)
    assert "".join("".join(lines).split()) == "".join(plain_text(line).split())
    for text in lines:
        assert display_width(text) <= columns or len(text.split()) == 1
