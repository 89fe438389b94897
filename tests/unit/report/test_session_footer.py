"""Tests of the lines of a session in terminals of different widths, and of its last lines."""

import io
import re
from dataclasses import replace
from pathlib import Path

import pytest

from simscen.core.records.run_result import Outcome, RunFailure, RunKey
from simscen.core.records.session_events import SessionFinished, SessionStarted, session_started
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.report.console_reporter import text_reporter
from simscen.report.display_text import TerminalStyle, plain_text
from simscen.report.live_console import ColorReporter, LiveReporter
from simscen.report.session_formatter import SessionFormatter


def with_result(run, **changes):
    """Return the run with other values in its result."""
    return replace(run, result=replace(run.result, **changes))


def lines_of(events, slow=None, columns=None):
    """Return the plain lines of events; `slow` is the number of listed slowest runs, or 0 for all."""
    formatter = SessionFormatter(slow, lambda: columns)
    return [plain_text(line) for event in events for line in formatter(event)]


def with_key(run, number, name="faults/lidar_off", again=False):
    """Return the run with another key: scenario, seed, and repetition."""
    key = RunKey(name, number)
    return with_result(run, key=key.repetition if again else key)


AT_80 = """\
simscen 0.1.0 · 3 scenarios · 2 workers
  ✓ navigation/goal        18.2 s simulated in 0.21 s
    tightest: path_length +0.14 m, 1 % of its limit
  ✗ faults/lidar_off       31.0 s simulated in 0.35 s
      stopped_within: 0.84 s > 0.50 s after lidar.off, at t = 10.84 s, (2.10,
        3.41)
        drove 0.31 m blind at 0.37 m/s; the newest scan was 0.9 s old
      warning: speed: 0.60 m/s > 0.50 m/s, at t = 1.00 s, (1.00, 1.00)
      scenario  scenarios/faults/lidar_off.scenario.yaml:27
      picture   out/x/map.png
      again     simscen run scenarios/faults/lidar_off.scenario.yaml --seed 7
1 passed, 1 failed, 1 error · 49 s simulated in 0.5 s (98x) · out/junit.xml
page: out/report.html
"""

AT_40 = """\
simscen 0.1.0 · 3 scenarios · 2 workers
  ✓ navigation/goal
    18.2 s simulated in 0.21 s
    tightest: path_length +0.14 m, 1 %
    of its limit
  ✗ faults/lidar_off
    31.0 s simulated in 0.35 s
      stopped_within: 0.84 s > 0.50 s
        after lidar.off, at t = 10.84 s,
        (2.10, 3.41)
        drove 0.31 m blind at 0.37 m/s;
          the newest scan was 0.9 s old
      warning: speed: 0.60 m/s > 0.50
        m/s, at t = 1.00 s, (1.00, 1.00)
      scenario
scenarios/faults/lidar_off.scenario.yaml:27
      picture   out/x/map.png
      again     simscen run \\
scenarios/faults/lidar_off.scenario.yaml \\
             --seed 7
1 passed, 1 failed, 1 error · 49 s
  simulated in 0.5 s (98x) ·
  out/junit.xml
page: out/report.html
"""


@pytest.mark.parametrize(("columns", "expected"), [(80, AT_80), (40, AT_40)])
def test_words_are_not_broken_in_a_narrow_terminal(session, passed, failed, columns, expected):
    lines = lines_of([session[0], passed, failed], columns=columns) + lines_of([session[-1]], columns=columns)
    assert "\n".join(lines) + "\n" == expected


def test_lines_in_a_wide_terminal_equal_piped_lines(session):
    assert lines_of(session, columns=200) == lines_of(session)


def test_every_criterion_that_failed_has_its_own_line(failed):
    first, second = failed.result.verdicts
    repeated_verdict = Verdict("speed", "slow", "fail", (*second.findings, *second.findings))
    run = with_result(failed, verdicts=(first, repeated_verdict), lines=(27, 28))
    lines = lines_of([run])
    assert sum(line.startswith("      ") and " > " in line for line in lines) == 3


def test_recap_has_the_first_cause_and_the_number_of_others(session, passed, failed):
    first, second = failed.result.verdicts
    run = with_result(failed, verdicts=(replace(second, severity="fail"), first), lines=(28, 27))
    lines = lines_of([passed, run, session[-1]])
    recap = lines[lines.index("did not pass:") :]
    assert recap[1:3] == [
        "  ✗ faults/lidar_off",
        "      speed: 0.60 m/s > 0.50 m/s, at t = 1.00 s, (1.00, 1.00) (and 1 more)",
    ]


def test_single_run_has_no_recap(session, failed):
    assert "did not pass:" not in lines_of([failed, session[-1]])
    assert "did not pass:" not in lines_of([failed, with_key(failed, 7, again=True), session[-1]])


def test_no_recap_if_all_runs_passed(session, passed):
    assert "did not pass:" not in lines_of([passed, with_key(passed, 2), session[-1]])


def test_only_the_first_of_many_failures_have_details(session, failed):
    lines = lines_of([*(with_key(failed, number) for number in range(1, 31)), session[-1]])
    recap = lines[lines.index("did not pass:") :]
    assert sum("✗" in line for line in recap) == 30
    assert sum(line.startswith("      again ") for line in recap) == 20


def test_slowest_runs_are_listed_by_wall_time(session, passed, failed, crashed):
    lines = lines_of([passed, failed, crashed, session[-1]], slow=2)
    index = lines.index("slowest:")
    assert lines[index + 1 : index + 4] == [
        "    1.25 s  evil/[red]::error::x   0.0 s simulated",
        "    0.35 s  faults/lidar_off   31.0 s simulated",
        "",
    ]
    all_lines = lines_of([passed, failed, crashed, session[-1]], slow=0)
    assert sum("s simulated" in line and line.startswith("    ") for line in all_lines) == 3


def test_determinism_runs_are_in_the_same_column(passed):
    runs = [with_key(passed, 1, "navigation/goal"), with_key(passed, 1, "navigation/goal", again=True)]
    key = runs[0].key
    _, first, second = lines_of([session_started("0.1.0", [key, key.repetition], 1, Path("out"), ()), *runs])
    assert first.index("18.2 s") == second.index("18.2 s")


def test_determinism_runs_of_one_seed_have_no_seed_in_their_names(passed):
    runs = [with_key(passed, 1, "navigation/goal"), with_key(passed, 1, "navigation/goal", again=True)]
    skipped = with_key(passed, 1, "navigation/skipped").key  # a skipped run has no repetition
    keys = [*(run.key for run in runs), skipped]
    names = [line.split("  ")[1] for line in lines_of([session_started("0.1.0", keys, 1, Path("out"), ()), *runs])[1:]]
    assert names == ["✓ goal", "✓ goal (again)"]


def test_equal_logs_are_reported_as_equal(session, failed, passed):
    runs = [failed, with_key(failed, 7, again=True)]
    assert "logs equal: 1 pair of runs, byte for byte" in lines_of([*runs, session[-1]])
    assert not any(line.startswith("logs") for line in lines_of([passed, session[-1]]))


def test_different_logs_are_never_reported_as_equal(session, failed):
    other = with_result(
        with_key(failed, 7, again=True),
        outcome=Outcome.ERROR,
        error=RunFailure("nondeterministic", "two runs with the same seed differ: truth at t = 1 s"),
    )
    lines = lines_of([failed, other, with_key(failed, 8), with_key(failed, 8, again=True), session[-1]])
    index = lines.index("logs differ: in 1 of 2 pairs of runs, byte for byte")
    assert lines[index + 1] == "  verdicts equal in 2 of 2"
    assert not any(line.startswith("logs equal") for line in lines)


def test_spread_of_different_runs_is_reported(session, failed):
    pairs = []
    for seed, arrival in ((7, 31.75), (8, 32.5)):
        second = with_result(with_key(failed, seed, again=True), metrics={"time_to_goal": arrival, "path_length": None})
        pairs += [with_result(with_key(failed, seed), metrics={"time_to_goal": 32.0, "path_length": 9.0}), second]
    pairs[3] = with_result(pairs[3], outcome=Outcome.ERROR, error=RunFailure("nondeterministic", "x"))
    pairs[1] = with_result(pairs[1], verdicts=(), lines=())
    lines = lines_of([*pairs, session[-1]])
    assert "  verdicts equal in 1 of 2, time to goal differs by up to 0.50 s" in lines


def test_run_without_a_log_does_not_count_as_equal(session, failed):
    artifacts = replace(failed.artifacts, mcap="")
    runs = [failed, replace(with_key(failed, 7, again=True), artifacts=artifacts)]
    assert not any(line.startswith("logs") for line in lines_of([*runs, session[-1]]))


def unfinished(run, number, kind):
    """Return an aborted run with a seed and a kind of error."""
    return with_result(with_key(run, number), error=RunFailure(kind, f"{kind}!"))


def test_an_interrupted_session_ends_with_two_lines(session, passed, crashed):
    unfinished_runs = [
        unfinished(crashed, 2, "interrupted"),
        unfinished(crashed, 3, "not-run"),
        unfinished(crashed, 4, "not-run"),
    ]
    end = replace(session[-1], passed=1, failed=0, errors=4, interrupted=True)
    lines = lines_of([passed, crashed, *unfinished_runs, end])
    assert lines[-2:] == [
        "interrupted: 1 passed, 1 error, 1 unfinished, 2 not started",
        "page: out/report.html   resume with --resume out",
    ]
    assert not any("not-run!" in line or "interrupted!" in line for line in lines)


def test_runs_skipped_by_fail_fast_are_only_counted(session, failed, crashed):
    end = replace(session[-1], passed=0, failed=1, errors=2)
    lines = lines_of([failed, unfinished(crashed, 2, "not-run"), unfinished(crashed, 3, "not-run"), end])
    assert lines[-2].startswith("0 passed, 1 failed, 2 not run · ")
    assert not any("not-run!" in line for line in lines)


def terminal_output(events, style, reporter):
    """Return the output of a reporter for events, with escape sequences."""
    out = io.StringIO()
    out.isatty = lambda: True
    with reporter(out, style) as listener:
        for event in events:
            listener(event)
    return out.getvalue()


def test_forced_colors_do_not_move_the_cursor(session):
    text = terminal_output(
        session, TerminalStyle(has_color=True, has_live_progress=False, is_terminal=False), ColorReporter
    )
    assert "\x1b[32m✓\x1b[0m" in text
    assert set(re.findall(r"\x1b\[[0-9;?]*([a-zA-Z])", text)) == {"m"}
    assert "\x1b]8" not in text


def test_lines_that_ci_could_interpret_have_no_colors(session):
    text = terminal_output(
        session, TerminalStyle(has_color=True, has_live_progress=False, is_terminal=False), ColorReporter
    )
    assert not re.search(r"^\s*::|##\[", text, re.MULTILINE)


@pytest.fixture(autouse=True)
def _terminal_with_cursor(monkeypatch):
    """Set TERM to a terminal whose cursor rich can move."""
    monkeypatch.setenv("TERM", "xterm")


def test_terminal_without_colors_has_live_output(session):
    text = terminal_output(
        session, TerminalStyle(has_color=False, has_live_progress=True, is_terminal=True), LiveReporter
    )
    assert "\x1b[?25l" in text
    assert not re.search(r"\x1b\[[0-9;]*m", text)


def test_paths_are_links_if_colors_are_on(session, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    text = terminal_output(
        session, TerminalStyle(has_color=True, has_live_progress=True, is_terminal=True), LiveReporter
    )
    assert re.search(rf"\x1b\]8;[^;]*;file://{re.escape(str(tmp_path))}/out/report.html\x1b\\", text)


def test_progress_shows_the_number_of_finished_runs(session, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    text = terminal_output(
        [session[0], session[1], session[2]],
        TerminalStyle(has_color=True, has_live_progress=True, is_terminal=True),
        LiveReporter,
    )
    rows = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "\n", text).splitlines()
    assert any("0 of 3" in row for row in rows)
    assert all(len(row.rstrip()) <= 40 for row in rows if "…" in row)


def test_forced_colors_are_written_to_a_pipe(monkeypatch):
    class Utf8(io.StringIO):
        encoding = "utf-8"

    stream = Utf8()
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("FORCE_COLOR", "1")
    with text_reporter(stream) as listener:
        listener(SessionStarted("0.1.0", 1, 1, 1))
        listener(SessionFinished(1, 0, 0, 1.0, 1.0))
    assert "\x1b[32m1 passed" in stream.getvalue()


def test_inconclusive_finding_is_in_the_recap(session, passed, failed):
    inconclusive = Verdict("own", "own", "fail", (Finding(Status.INCONCLUSIVE, "own", "too short", ""),))
    lines = lines_of([passed, with_result(failed, verdicts=(inconclusive,), lines=(3,)), session[-1]])
    assert "      own: inconclusive: too short" in lines[lines.index("did not pass:") :]
