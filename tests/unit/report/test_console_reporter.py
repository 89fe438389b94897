"""Tests of the console reporters: text, colors, GitHub, and JSON."""

import io
import json
import re
import shlex
import subprocess
from dataclasses import replace

import pytest

from simscen.cli.diagnostics import as_github
from simscen.core.errors import Problem
from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import SessionStarted
from simscen.report.console_reporter import text_reporter
from simscen.report.github import GitHubReporter, annotations, summary_markdown
from simscen.report.reporters import JsonReporter
from simscen.report.results_json import json_parts

EXPECTED = """\
simscen 0.1.0 · 3 scenarios · 2 workers
  ✓ navigation/goal        18.2 s simulated in 0.21 s   tightest: path_length +0.14 m, 1 % of its limit
  ✗ faults/lidar_off       31.0 s simulated in 0.35 s
      stopped_within: 0.84 s > 0.50 s after lidar.off, at t = 10.84 s, (2.10, 3.41)
        drove 0.31 m blind at 0.37 m/s; the newest scan was 0.9 s old
      warning: speed: 0.60 m/s > 0.50 m/s, at t = 1.00 s, (1.00, 1.00)
      scenario  scenarios/faults/lidar_off.scenario.yaml:27
      picture   out/x/map.png
      again     simscen run scenarios/faults/lidar_off.scenario.yaml --seed 7
  ! evil/[red]::error::x crashed after 1.25 s
      crashed: SIGSEGV
        | ::error::owned
        | ##\\[error]x
        | \\x1b[31mred\\x1b[0m ]]> <script>&
        | Segmentation fault
      scenario  scenarios/evil/[red]::error::x.scenario.yaml:1
      again     simscen run evil

did not pass:
  ✗ faults/lidar_off
      stopped_within: 0.84 s > 0.50 s after lidar.off, at t = 10.84 s, (2.10, 3.41)
      picture   out/x/map.png
      again     simscen run scenarios/faults/lidar_off.scenario.yaml --seed 7
  ! evil/[red]::error::x
      crashed: SIGSEGV
      again     simscen run evil

1 passed, 1 failed, 1 error · 49 s simulated in 0.5 s (98x) · out/junit.xml
page: out/report.html
"""


def with_result(run, **changes):
    """Return the run with other values in its result."""
    return replace(run, result=replace(run.result, **changes))


def test_common_folder_of_the_ids_is_omitted(passed):
    out = io.StringIO()
    first, second = (with_result(passed, key=RunKey(f"scenarios/{name}", 1)) for name in ("faults/a", "fancy/long"))
    ids = ("scenarios/fancy/long", "scenarios/faults/a")
    send(text_reporter(Utf8Stream(out)), [SessionStarted("0.1.0", 2, 2, 1, ids=ids), first, second])
    assert re.findall(r"✓ (\S+ *) ", out.getvalue()) == ["faults/a    ", "fancy/long  "]


def send(reporter, session):
    """Send the events of a session to a reporter."""
    with reporter as listener:
        for event in session:
            listener(event)


def test_piped_output_snapshot(session):
    out = io.StringIO()
    send(text_reporter(Utf8Stream(out)), session)
    assert out.getvalue() == EXPECTED


class Utf8Stream:
    """Text stream with the encoding UTF-8; StringIO has no encoding."""

    encoding = "utf-8"

    def __init__(self, out):
        self._out = out

    def write(self, text):
        return self._out.write(text)

    def flush(self):
        self._out.flush()

    def isatty(self):
        return False


def test_ascii_stream_gets_ascii_symbols(session):
    raw = io.BytesIO()
    out = io.TextIOWrapper(raw, encoding="ascii")
    send(text_reporter(out), session)
    out.flush()
    text = raw.getvalue().decode("ascii")
    assert "  + navigation/goal" in text
    assert "  x faults/lidar_off" in text


def test_ascii_terminal_gets_plain_lines(session):
    class Terminal(io.TextIOWrapper):
        def isatty(self):
            return True

    raw = io.BytesIO()
    out = Terminal(raw, encoding="ascii")
    send(text_reporter(out), session)
    out.flush()
    assert b"\x1b" not in raw.getvalue()


def test_terminal_output_is_colored_and_user_text_is_not_markup(session):
    out = io.StringIO()
    send(text_reporter(out, live=True), session)
    plain = re.sub(r"\x1b(\[[0-9;?]*[a-zA-Z]|\]8;.*?\x1b\\)", "", out.getvalue())
    for line in EXPECTED.splitlines():
        if "##" not in line:
            assert line.strip() in plain


def test_runs_of_one_scenario_show_their_seeds(passed):
    out = io.StringIO()
    second = with_result(passed, key=RunKey("navigation/goal", 2))
    send(text_reporter(Utf8Stream(out)), [SessionStarted("0.1.0", 2, 1, 1, seeds=2), passed, second])
    assert "1 scenario · 2 runs · 1 worker\n" in out.getvalue()
    assert "navigation/goal (seed 1) " in out.getvalue()
    assert "navigation/goal (seed 2) " in out.getvalue()


def test_plain_output_contains_no_ci_commands(session, failed):
    evil_run = replace(
        with_result(failed, key=RunKey("::set-output name=x::y", 1)), again="::stop-commands::x\n##[group]x"
    )
    evil_verdict = replace(failed.result.verdicts[0], id="::error::y", criterion="::error::y")
    evil_run = with_result(evil_run, verdicts=(evil_verdict,), lines=(1,))
    out = io.StringIO()
    send(text_reporter(Utf8Stream(out)), [*session, evil_run])
    assert not re.search(r"^\s*::|##\[", out.getvalue(), re.MULTILINE)


def test_github_annotations_have_the_line_of_the_criterion_and_are_escaped(failed, crashed):
    error, warning = annotations(failed)
    assert error == (
        "::error file=scenarios/faults/lidar_off.scenario.yaml,line=27,title=faults/lidar_off (seed 7)::"
        "stopped_within: 0.84 s > 0.50 s after lidar.off, at t = 10.84 s, (2.10, 3.41)"
        "%0Adrove 0.31 m blind at 0.37 m/s; the newest scan was 0.9 s old"
    )
    assert warning.startswith("::warning file=scenarios/faults/lidar_off.scenario.yaml,line=28,")
    evil_run = with_result(crashed, error=replace(crashed.result.error, message="100 %, a:b\r\n::warning::x"))
    (line,) = annotations(evil_run)
    assert "\n" not in line
    assert "file=scenarios/evil/[red]%3A%3Aerror%3A%3Ax.scenario.yaml,line=1," in line
    assert "100 %25, a:b" in line


def test_github_annotations_have_paths_relative_to_the_checkout(failed, tmp_path, monkeypatch):
    file = tmp_path / "repo/robots/sim/aisle.scenario.yaml"
    file.parent.mkdir(parents=True)
    file.write_text("")
    monkeypatch.setenv("GITHUB_WORKSPACE", str(tmp_path / "repo"))
    monkeypatch.chdir(tmp_path / "repo/robots")
    error = annotations(replace(failed, file="sim/aisle.scenario.yaml"))[0]
    assert "file=robots/sim/aisle.scenario.yaml,line=27," in error
    problem = Problem("sim/aisle.scenario.yaml", 2, 1, "SC012", "unknown key")
    assert as_github([problem]).startswith("::error file=robots/sim/aisle.scenario.yaml,line=2,")
    monkeypatch.chdir("/")
    outside = replace(failed, file="etc/hostname")
    assert "file=etc/hostname,line=27," in annotations(outside)[0]


def test_github_summary_lists_failures_first_and_is_escaped(session, passed, crashed):
    summary = summary_markdown([passed, crashed], session[-1])
    rows = summary.splitlines()[4:]
    assert "crashed: SIGSEGV" in rows[0]
    assert "navigation/goal" in rows[1]
    evil_run = with_result(passed, key=RunKey("<script>|*x*[a](b)@me#1", 1))
    (row,) = summary_markdown([evil_run], session[-1]).splitlines()[4:5]
    assert not re.search(r"<script|\*x\*|\[a\]|@me", row)
    assert row.count("|") == 5


def test_github_summary_stays_below_the_size_limit_of_github(session, failed):
    violations = failed.result.verdicts * 100
    runs = [with_result(failed, key=RunKey("a/b", seed), verdicts=violations, lines=()) for seed in range(1, 400)]
    summary = summary_markdown(runs, session[-1])
    assert len(summary.encode()) < 2**20
    row_count = sum(line.startswith("| ❌") for line in summary.splitlines())
    assert f"and {len(runs) - row_count} more" in summary


def test_every_criterion_has_its_own_line_in_the_github_summary(session, failed):
    (row,) = summary_markdown([failed], session[-1]).splitlines()[4:5]
    stopping, speeding = row.rsplit("|", 2)[1].split("<br>")
    assert stopping.startswith(" stopped&#95;within: 0.84 s &#62; 0.50 s") and speeding.startswith("speed: 0.60 m/s")


def test_summary_shows_pictures_of_failures_that_have_a_url(session, passed, failed):
    with_picture = replace(failed, artifacts=replace(failed.artifacts, picture="out/runs/a b)/seed-7/map.png"))
    summary = summary_markdown([passed, with_picture], session[-1], "https://example.org/raw/pictures/1/")
    assert summary.endswith(
        "**faults/lidar&#95;off (seed 7)**\n\n"
        "![map of the run](https://example.org/raw/pictures/1/runs/a%20b%29/seed-7/map.png)\n\n"
    )
    assert "![" not in summary_markdown([passed, with_picture], session[-1])


def test_github_output_contains_the_plain_lines(session):
    out, summary = io.StringIO(), io.StringIO()
    send(GitHubReporter(Utf8Stream(out), summary), session)
    lines = [line for line in out.getvalue().splitlines() if not line.startswith("::")]
    assert "\n".join(lines) + "\n" == EXPECTED
    assert summary.getvalue().startswith("### simscen: 1 passed, 1 failed, 1 error\n")


def test_json_format_is_the_results_file(session, passed, failed, crashed):
    out = io.StringIO()
    send(JsonReporter(out), session)
    assert json.loads(out.getvalue()) == json.loads("".join(json_parts([passed, failed, crashed], "out")))
    assert "##[" not in out.getvalue()


@pytest.mark.parametrize("live", [True, False])
def test_aborted_session_restores_the_terminal(session, live):
    out = io.StringIO()
    with pytest.raises(KeyboardInterrupt), text_reporter(out, live=live) as listener:
        listener(session[0])
        listener(session[1])
        raise KeyboardInterrupt
    hide_count, show_count = out.getvalue().count("\x1b[?25l"), out.getvalue().count("\x1b[?25h")
    assert hide_count == show_count


def test_repeat_command_is_one_quoted_shell_line(failed):
    words = ["simscen", "run", "a.yaml", "--stack", "x=sh -c 'echo  two;\n\techo \"it'\"'\"'s\"'"]
    out = io.StringIO()
    send(text_reporter(Utf8Stream(out)), [replace(failed, again=shlex.join(words))])
    (line,) = [line for line in out.getvalue().splitlines() if line.startswith("      again")]
    shell = ["bash", "-c", f"printf '%s\\0' {line.removeprefix('      again     ')}"]
    assert subprocess.run(shell, capture_output=True, text=True, check=True).stdout.split("\0")[:-1] == words
