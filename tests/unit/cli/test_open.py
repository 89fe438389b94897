"""Tests of `simscen run --open`: the live page before, during, and after the runs."""

import webbrowser
from pathlib import Path
from urllib.parse import unquote, urlparse

import pytest

from simscen.cli.session import live_page
from simscen.core.records.session_events import SessionEvent

SCENARIO = """\
simscen: 1
tags: [smoke]
world: {simscen: 1, walls: [{points: [[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 1.4, y: 1}}]
time_limit: 20 s
pass: [{goals_reached: {}}]
"""


@pytest.fixture
def pages(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return a list that receives the content of each page when it is opened."""
    opened: list[str] = []

    def open_(uri: str) -> bool:
        opened.append(Path(unquote(urlparse(uri).path)).read_text(encoding="utf-8"))
        return True

    monkeypatch.setattr(webbrowser, "open", open_)
    return opened


@pytest.mark.slow
def test_live_page_opens_first_and_becomes_the_report(
    simscen, pages: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    page_versions: list[str] = []

    class RecordedPage(live_page.LivePage):
        def __call__(self, event: SessionEvent) -> None:
            super().__call__(event)
            page_versions.append((tmp_path / "out/report.html").read_text(encoding="utf-8"))

    monkeypatch.setattr(live_page, "MIN_UPDATE_INTERVAL_S", 0.0)
    monkeypatch.setattr(live_page, "UPDATE_INTERVAL_FACTOR", 0)
    monkeypatch.setattr("simscen.cli.session.scenario_session.LivePage", RecordedPage)
    result = simscen("run", "a.scenario.yaml", "--repeat", "2", "--out", "out", "--open", "-j", "1")
    assert (result.code, result.err) == (0, "")
    assert ["0 of 2 runs done" in page for page in pages] == [True]
    assert any("1 of 2 runs done" in page for page in page_versions)
    final = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert "<h1>✓ 2 passed</h1>" in final
    assert "data-live" not in final.partition("<script>")[0]
    assert 'data-tags="smoke"' in final


def test_path_of_the_page_is_printed_without_a_browser(
    simscen, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    monkeypatch.setattr(webbrowser, "open", lambda uri: False)
    result = simscen("run", "a.scenario.yaml", "--out", "out", "--open")
    assert result.code == 0
    assert result.err == "simscen: no browser found; open out/report.html in a browser\n"


def test_watch_and_open_exclude_each_other(simscen, tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    result = simscen("run", "a.scenario.yaml", "--watch", "--open")
    assert result.code == 2
    assert "--watch and --open exclude each other" in result.err
