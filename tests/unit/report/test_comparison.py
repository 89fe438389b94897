"""Tests of the reports of stack comparisons."""

import io
import json
import re

import pytest

from simscen.core.records.comparison import BaselineComparison, Comparison, Flip, MetricDifference, OutcomeCounts
from simscen.core.records.session_events import SessionFinished, SessionStarted
from simscen.report.comparison import comparison_lines, difference_cells, session_comparison_lines, shorten
from simscen.report.comparison_markup import session_comparison_markdown
from simscen.report.console_reporter import text_reporter
from simscen.report.display_text import plain_text
from simscen.report.github import summary_markdown
from simscen.report.results_json import json_parts
from simscen.report.suite import SessionReport, to_html

FLIP = Flip("navigation/goal", 3, "ref", "mine", "clearance: 0.03 m < 0.05 m, at t = 4.10 s, (2.59, 4.42)")
TIME = MetricDifference("time_to_goal", "s", 8, 25.341, 28.23, 2.889, (0.78, 4.954), 1, 0, 7, 0.070)
REPLANS = MetricDifference("replans", "", 2, 3.0, 3.0, 0.0, None, 0, 2, 0, 1.0)
EXPECTED = """\

  passed                     ref     mine
  navigation/goal          10/10      6/9
  obstacles/cart_crosses     1/1   0/0 1!
  all                      11/11   6/9 1!
  ! = runs with errors, which are not counted

  mine against ref: 10 pairs of the same scenario and seed, 0 better, 1 worse (p = 1)
    worse  navigation/goal, seed 3: passed with ref, failed with mine: clearance: 0.03 m < 0.05 m, at t = 4.10 s, (2.59, 4.42)
    mean over pairs    ref   mine  difference  95 % interval  -/=/+
    time_to_goal, s  25.34  28.23       +2.89  +0.78 … +4.95  1/0/7
    replans           3.00   3.00       +0.00                 0/2/0
    only collisions are compared in 2 pairs: only one run reached the last goal
    left out: 1 pair with an error, 1 run without a partner

"""  # noqa: E501 - as it is printed


@pytest.fixture
def comparison() -> Comparison:
    """Return a comparison of two stacks in two scenarios."""
    return Comparison(
        {"ref": "reference", "mine": "./nav '<b>'"},
        {
            "navigation/goal": {"ref": OutcomeCounts(10), "mine": OutcomeCounts(6, 3, 0)},
            "obstacles/cart_crosses": {"ref": OutcomeCounts(1), "mine": OutcomeCounts(0, 0, 1)},
        },
        (BaselineComparison("mine", 10, 1, 1, 2, (FLIP,), 1.0, (TIME, REPLANS)),),
    )


def lines(comparison: Comparison, columns: int | None = None) -> list[str]:
    return [plain_text(line) for line in comparison_lines(comparison, "", columns)]


def test_console_output_snapshot(comparison) -> None:
    assert "\n".join(lines(comparison)) + "\n" == EXPECTED


def test_tables_fit_into_the_columns_of_a_terminal_and_use_a_wider_one(comparison) -> None:
    outcomes = {"a" * 90 + "/one": comparison.outcomes["navigation/goal"]}
    for columns in (80, 200):
        text = lines(Comparison(comparison.stacks, outcomes, comparison.baseline_comparisons), columns)
        tables = [line for line in text if "worse " not in line]
        assert max(map(len, tables)) <= columns
        assert (next(iter(outcomes)) in "\n".join(text)) == (columns == 200)


def test_long_name_is_shortened_in_the_middle() -> None:
    assert shorten("navigation-stack-of-january", 16) == "navigat…-january"
    assert shorten("short", 16) == "short"


def test_first_changed_outcomes_are_listed_and_the_rest_counted(comparison) -> None:
    many_flips = BaselineComparison("mine", 30, 0, 0, 0, (FLIP,) * 25, 0.0, ())
    text = lines(Comparison(comparison.stacks, comparison.outcomes, (many_flips,)))
    assert sum("worse " in line for line in text) == 11  # ten, and the row of the table
    assert "    and 15 more, in the JSON results" in text


def test_comparison_is_before_the_last_line_of_piped_output(comparison) -> None:
    out = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    with text_reporter(out) as listener:
        listener(SessionStarted("0.1.0", 20, 2, 1, ids=("a/b", "a/c"), stacks=("ref=reference", "mine=./nav")))
        listener(SessionFinished(1, 0, 0, 10.0, 1.0, comparison=comparison))
    out.seek(0)
    text = out.read()
    assert text.startswith("simscen 0.1.0 - 2 scenarios - 2 stacks - 20 runs - 1 worker\n")
    assert "+0.78 ... +4.95" in text
    assert text.splitlines()[-1].startswith("1 passed")


def test_comparison_on_the_page_is_escaped(comparison, passed) -> None:
    html = to_html(SessionReport([passed], comparison=comparison))
    for tag in ("section", "table", "tr", "td", "th", "h3", "p", "div"):
        assert len(re.findall(f"<{tag}[ >]", html)) == html.count(f"</{tag}>"), tag
    assert "mine against ref" in html
    assert "&lt;b&gt;" in html
    assert "time_to_goal, s" in html
    assert '<section class="in"' not in to_html(SessionReport([passed]))


def test_comparison_is_in_the_github_summary(comparison, passed) -> None:
    session = SessionFinished(1, 0, 0, 1.0, 1.0, comparison=comparison)
    text = summary_markdown([passed], session)
    assert "| navigation/goal | 10/10 | 6/9 |" in text
    assert "- navigation/goal, seed 3: passed with ref, failed with mine: clearance" in text.replace("&#95;", "_")
    rows = [line for line in text.splitlines() if "time" in line and "28.23" in line]
    assert rows[0].count("|") == 9


def test_comparison_in_results_json(comparison, passed) -> None:
    assert (
        json.loads("".join(json_parts([passed], "", comparison)))["comparison"]["against"][0]["flips"][0]["seed"] == 3
    )
    assert "comparison" not in json.loads("".join(json_parts([passed])))


@pytest.mark.parametrize(
    ("baseline_comparison", "conclusion"),
    [
        (BaselineComparison("candidate", 0, 5, 0, 0, (), 1.0, ()), "nothing was compared: 5 pairs with an error"),
        (BaselineComparison("candidate", 4, 1, 0, 0, (), 1.0, ()), "candidate is not significantly worse in 4 pairs"),
    ],
)
def test_comparison_with_crashed_runs_is_not_good(baseline_comparison, conclusion) -> None:
    outcomes = {
        "baseline": OutcomeCounts(5),
        "candidate": OutcomeCounts(baseline_comparison.pairs, 0, baseline_comparison.error_pairs),
    }
    sessions = Comparison({"baseline": "a", "candidate": "b"}, {"goal": outcomes}, (baseline_comparison,))
    *_, conclusion_line = session_comparison_lines(sessions, {}, is_worse=False)
    assert plain_text(conclusion_line) == conclusion
    assert conclusion_line[0].role == "warning"
    markdown = session_comparison_markdown(sessions, {}, is_worse=False)
    assert markdown[0] == f"### simscen: {conclusion}"


def test_markdown_without_differences_has_no_empty_table() -> None:
    baseline_comparison = BaselineComparison("candidate", 4, 0, 0, 0, (), 1.0, ())
    outcomes = {"baseline": OutcomeCounts(4), "candidate": OutcomeCounts(4)}
    sessions = Comparison({"baseline": "a", "candidate": "b"}, {"goal": outcomes}, (baseline_comparison,))
    markdown = session_comparison_markdown(sessions, {}, is_worse=False)
    assert not [line for line in markdown if "interval |" in line]


def test_small_numbers_have_one_more_digit() -> None:
    clearance = MetricDifference("min_clearance", "m", 6, 0.0716, 0.0309, -0.0407, (-0.0512, -0.0298), 6, 0, 0, 0.03)
    assert difference_cells(clearance)[1:5] == ("0.072", "0.031", "-0.041", "-0.051 … -0.030")
    assert difference_cells(TIME)[1:5] == ("25.34", "28.23", "+2.89", "+0.78 … +4.95")
    assert difference_cells(REPLANS)[1] == "3.00"
