"""Tests of the HTML of report.html: content, order, and escaping."""

import json
import math
import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from PIL import Image

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import Artifacts
from simscen.core.records.study import ParameterEffect, Study
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.report.results_json import json_parts
from simscen.report.session_history import past_sessions
from simscen.report.suite import RunningSession, SessionReport, elements, page, to_html
from simscen.report.suite.elements import anchor
from simscen.report.suite.run_entry import scenario_folder, smallest_margin
from simscen.report.suite.study_section import study_html

VOID = ("meta", "img", "input", "rect", "polyline", "circle")


def with_result(run, **changes):
    """Return the run with other values in its result."""
    return replace(run, result=replace(run.result, **changes))


def with_key(run, scenario, seed=1, variation=""):
    """Return the run with another scenario, seed, and variation."""
    return with_result(run, key=RunKey(scenario, seed, variation))


class TagParser(HTMLParser):
    """Parser that collects tags with their attributes, and checks that each tag is closed."""

    def __init__(self):
        super().__init__()
        self.tags, self.open = [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def tags_of(html):
    """Return the tags of a page, each with its attributes, and check that all tags are closed."""
    parser = TagParser()
    parser.feed(html)
    assert parser.open == []
    return parser.tags


def runs_on(html):
    """Return the attributes of the elements of runs, in their order on the page."""
    return [
        attributes for tag, attributes in tags_of(html) if tag == "details" and "run" in attributes["class"].split()
    ]


def test_failures_come_first_and_are_expanded(passed, failed, crashed):
    html = to_html(SessionReport([passed, failed, crashed]))
    assert ["open" in attributes for attributes in runs_on(html)] == [True, True, False]
    assert [attributes["data-status"] for attributes in runs_on(html)] == ["error", "failed", "passed"]
    assert "<h1>✓ 1 passed, ✗ 1 failed, ! 1 error</h1>" in html


def test_each_violated_criterion_has_a_row_with_its_reason_and_its_line_of_the_file(failed):
    html = to_html(SessionReport([failed]))
    row = html[html.index("<td>fail</td>") : html.index("</tr>", html.index("<td>fail</td>"))]
    assert "stopped_within" in row
    assert "0.84 s &gt; 0.50 s after lidar.off, at t = 10.84 s, (2.10, 3.41)" in row
    assert "<li>drove 0.31 m blind" in row
    assert f"{failed.result.path}:27" in row
    assert "<td>warning</td><td>speed</td>" in html


def test_console_text_of_a_failure_can_be_copied(passed, failed):
    assert "console output" not in to_html(SessionReport([passed]))
    console_text = to_html(SessionReport([failed])).partition("console output")[2].partition("</pre>")[0]
    assert "stopped_within: 0.84 s &gt; 0.50 s after lidar.off, at t = 10.84 s, (2.10, 3.41)\n" in console_text
    assert "again     simscen run" in console_text


def test_external_text_is_escaped_in_tags_attributes_and_links(passed, crashed):
    markup = '"><script>alert(1)</script><img src=x onerror=y>'
    evil_run = replace(
        with_result(passed, key=RunKey(f"{markup}/x", 1, markup, "s"), reason=markup, ended=markup),
        again=markup,
        file=f"javascript:{markup}",
        tags=(markup, "javascript:1"),
        artifacts=Artifacts("javascript:1", "javascript:alert(1)", "/etc/passwd", "out/../../x"),
    )
    usual_tags = {tag for tag, _ in tags_of(to_html(SessionReport([passed, crashed])))}
    html = to_html(SessionReport([evil_run, crashed], folder="out", title=markup))
    tags = tags_of(html)
    assert {tag for tag, _ in tags} <= usual_tags | {"option", "select", "span"}
    assert [tag for tag, _ in tags].count("script") == 1
    assert not any(name.startswith("on") for _, attributes in tags for name in attributes)
    assert not any("javascript" in (attributes.get("href") or "") for _, attributes in tags)
    assert not [attributes for tag, attributes in tags if tag == "a"]
    assert not re.search("\x1b", html)


def test_content_security_policy_allows_only_own_style_and_script(passed):
    html = to_html(SessionReport([passed]))
    policy = next(a["content"] for tag, a in tags_of(html) if a.get("http-equiv") == "Content-Security-Policy")
    assert policy.startswith("default-src 'none'; img-src data:; style-src 'sha256-")
    assert "unsafe" not in policy
    assert not [a for _, a in tags_of(html) if "style" in a or (a.get("src") or "data:")[:5] != "data:"]


def test_page_does_not_depend_on_the_order_of_results(passed, failed, crashed):
    runs = [replace(passed, tags=("b", "a")), failed, crashed]
    assert to_html(SessionReport(runs)) == to_html(SessionReport(runs[::-1]))


def test_repeated_scenario_is_a_group_with_a_mark_for_each_run(passed, failed):
    group = [with_key(passed, "a/speeds", seed, variation) for seed in (1, 2) for variation in ("slow", "fast")]
    html = to_html(SessionReport([*group, with_key(failed, "a/speeds", 3, "slow"), with_key(passed, "b/alone")]))
    assert "4 of 5 as expected" in html
    assert 'aria-label="runs: passed, passed, passed, passed, failed"' in html
    assert html.count('class="group many" open') == 1
    assert html.count('class="group"') == 1


def test_runs_have_attributes_for_filters_and_sorting(failed):
    (data,) = runs_on(to_html(SessionReport([replace(failed, tags=("door", "smoke"))])))
    data_attributes = {name: value for name, value in data.items() if name.startswith("data-")}
    assert data_attributes == {
        "data-status": "failed",
        "data-tags": "door smoke",
        "data-theme": "faults",
        "data-simulated": "31.000",
        "data-wall": "0.350",
        "data-margin": "-0.6800",
    }


def test_smallest_margin_is_relative_to_its_limit(passed, failed):
    assert smallest_margin(passed) == pytest.approx(0.014)
    assert smallest_margin(failed) == pytest.approx(-0.68)
    assert scenario_folder(RunKey("navigation/goal", 1)) == "navigation"
    assert scenario_folder(RunKey("goal", 1)) == ""


def test_every_run_has_a_different_anchor(passed):
    keys = [RunKey("a/b", 1), RunKey("a/b", 2), RunKey("a/b", 1, "x=1"), RunKey("a/b", 1, "x=1", "dwb")]
    assert [anchor(key) for key in keys] == [
        "run-a-b-seed-1", "run-a-b-seed-2", "run-a-b-x=1-seed-1", "run-a-b-x=1-seed-1-dwb",
    ]  # fmt: skip


def test_links_point_to_existing_files_of_the_run(failed, tmp_path):
    folder = tmp_path / "out"
    (folder / "runs/a b").mkdir(parents=True)
    (folder / "runs/a b/worker.log").write_text("given")
    (folder / "runs/a b/stack.log").write_text("")
    run = replace(failed, artifacts=Artifacts(str(folder / "runs/a b"), str(folder / "runs/a b/run.mcap")))
    links = [a["href"] for tag, a in tags_of(to_html(SessionReport([run], folder=str(folder)))) if tag == "a"]
    assert links == ["./runs/a%20b/run.mcap", "./runs/a%20b/worker.log"]


def test_picture_is_embedded_in_the_page(failed, tmp_path):
    path = tmp_path / "map.png"
    Image.new("RGB", (4, 4)).save(path)
    html = to_html(SessionReport([replace(failed, artifacts=Artifacts(picture=str(path)))]))
    (image,) = [attributes for tag, attributes in tags_of(html) if tag == "img"]
    assert image["src"].startswith("data:image/png;base64,")
    assert image["alt"] == "map of faults/lidar_off, seed 7: failed"


def test_missing_picture_is_omitted(failed):
    assert "<img" not in to_html(SessionReport([failed]))


def test_embedded_pictures_are_limited_with_failures_first(passed, failed, tmp_path, monkeypatch):
    picture = tmp_path / "map.png"
    Image.new("L", (8, 8)).save(picture)
    monkeypatch.setattr(elements, "MAX_EMBEDDED_BYTES", picture.stat().st_size)
    runs = [replace(run, artifacts=Artifacts(picture=str(picture))) for run in (passed, failed)]
    html = to_html(SessionReport(runs))
    assert [tag for tag, _ in tags_of(html)].count("img") == 1
    assert html.index("<img") < html.index(f"picture: <code>{picture}")


@pytest.fixture
def sessions(tmp_path, passed, failed):
    """Return an output folder with three sessions, of which the last one has just ended."""
    out = tmp_path / "simscen-out"
    runs = [with_key(passed, "a/flaky"), with_key(passed, "a/steady")]
    changed_runs = [with_key(failed, "a/flaky"), with_key(passed, "a/steady")]
    for number, (name, finished_runs) in enumerate((("one", runs), ("two", changed_runs), ("three", runs))):
        (out / name).mkdir(parents=True)
        (out / name / "results.json").write_text("".join(json_parts(finished_runs)))
        (out / name / "events.jsonl").write_text("")
        (out / name / "run.json").write_text(json.dumps({"written": f"2026-01-0{number + 1}T00:00:00+00:00"}))
    (out / "latest").symlink_to("three")
    return out


def test_earlier_sessions_are_listed_with_changes(sessions, passed):
    earlier_sessions = past_sessions(sessions / "three")
    assert [session.name for session in earlier_sessions] == ["two", "one"]
    assert past_sessions(sessions / "latest") == earlier_sessions
    html = to_html(SessionReport([with_key(passed, "a/flaky"), with_key(passed, "a/steady")], earlier_sessions))
    assert "1 newly passing" in html
    assert html.index("../two/report.html") < html.index("../one/report.html")
    assert '<a href="#run-a-flaky-seed-1">a/flaky, seed 1</a>: passed, failed before' in html
    assert 'aria-label="earlier sessions and this one: passed, failed, passed">✓✗✓</span>' in html
    assert [run.get("data-changed") for run in runs_on(html)] == ["1", None]


def test_skipped_runs_have_no_change_and_hide_no_earlier_outcome(sessions, passed, skipped):
    results_text = "".join(json_parts([with_key(skipped, "a/flaky"), with_key(passed, "a/steady")]))
    results = sessions / "three/results.json"
    results.write_text(results_text)
    (sessions / "four").mkdir()
    (sessions / "four/events.jsonl").write_text("")
    (sessions / "four/run.json").write_text(json.dumps({"written": "2026-01-04T00:00:00+00:00"}))
    earlier_sessions = past_sessions(sessions / "four")
    assert [session.name for session in earlier_sessions] == ["three", "two", "one"]
    html = to_html(SessionReport([with_key(passed, "a/flaky"), with_key(passed, "a/steady")], earlier_sessions))
    assert "a/flaky, seed 1</a>: passed, failed before" in html
    assert [run.get("data-changed") for run in runs_on(html)] == ["1", None]
    assert "no change since the last session" in to_html(
        SessionReport([with_key(skipped, "a/flaky")], earlier_sessions)
    )


def test_share_of_expected_outcomes_includes_runs_that_are_not_listed(sessions, passed, failed, monkeypatch):
    monkeypatch.setattr(page, "MAX_LISTED_RUNS", 1)
    runs = [with_key(passed, f"a/{number}") for number in range(3)] + [with_key(failed, "a/flaky")]
    html = to_html(SessionReport(runs, past_sessions(sessions / "three")))
    assert "share of runs as expected, oldest first: 100%, 50%, 75%" in html


def test_heading_of_a_scenario_counts_runs_that_are_not_listed(passed, failed, monkeypatch):
    monkeypatch.setattr(page, "MAX_LISTED_RUNS", 1)
    html = to_html(
        SessionReport([with_key(passed, "a/flaky", seed) for seed in (1, 2)] + [with_key(failed, "a/flaky", 3)])
    )
    assert [run.get("data-status") for run in runs_on(html)] == ["failed"]
    assert ">2 of 3 as expected<" in html


def test_sessions_with_missing_or_damaged_results_are_ignored(sessions, tmp_path):
    (sessions / "two/results.json").write_text("{")
    (sessions / "one/results.json").unlink()
    assert past_sessions(sessions / "three") == []
    assert past_sessions(tmp_path / "elsewhere") == []


def test_page_of_a_running_session_shows_progress_and_reloads(passed, failed):
    html = to_html(SessionReport([passed], progress=RunningSession(3, (failed.key,))))
    assert "1 of 3 runs done, running: faults/lidar_off, seed 7" in html
    assert "<noscript><meta http-equiv=refresh" in html
    assert "refresh" not in to_html(SessionReport([passed])).replace("refreshing", "").partition("<script>")[0]


def test_session_without_runs_has_a_page():
    assert "<h1>✓ 0 passed</h1>" in to_html(SessionReport([], progress=RunningSession(5)))


def test_every_outcome_has_a_symbol_and_a_color(passed):
    page = to_html(SessionReport([passed]))
    assert f'class="pill {Outcome.PASSED.value}"><span aria-hidden="true">✓ </span>passed' in page


def test_points_of_a_study_link_to_files_and_have_finite_positions(passed):
    def run(seed, margin, replay):
        finding = Finding(Status.PASS, "clearance", "", "", margin, "m", margin)
        result = replace(
            passed.result, key=RunKey("a/b", seed), verdicts=(Verdict("clearance", "clearance", "fail", (finding,)),)
        )
        return replace(passed, result=result, artifacts=Artifacts(replay=replay))

    runs = [run(1, 0.5, "out/seed-1 50%/replay.html"), run(2, math.inf, "out/b/replay.html"), run(3, 0.1, "/etc/hosts")]
    effects = (
        ParameterEffect("x", "clearance", 0.9, 0.01, 3, True),
        ParameterEffect("y", "clearance", 0.4, 0.02, 3, False),
    )
    values = {run_.key: {"x": run_.key.seed, "y": "a"} for run_ in runs}
    html = study_html(Study("a/b", True, 3, 0, 0, None, None, (), effects, {}, values), runs, "out")
    assert re.findall('href="([^"]*)"', html) == ["./seed-1%2050%25/replay.html"]
    assert html.count("<circle") == 2 and "nan" not in html
    assert "<td>+0.90</td>" in html and "<td>0.40 (epsilon squared)</td>" in html
