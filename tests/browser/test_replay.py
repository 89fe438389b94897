"""Tests of the replay page in a browser."""

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from browser_tab import BrowserTab, TabOpener
from hostile import MARKUP, hostile_log
from nav2_report import ERROR, with_nav2_report
from recorded_drive import record_drive

from simscen.core.records.trace import Samples
from simscen.judge.result_json import from_json
from simscen.record.log_reader import read_run
from simscen.report.replay import write_replay

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return the logs of two seeds of the scenario in recorded_drive.py."""
    return [record_drive(tmp_path_factory.mktemp(f"seed-{seed}"), seed) for seed in (1, 2)]


def write_page(page: Path, logs: list[Path]) -> Path:
    """Write the replay page of logs, and return its file."""
    read = [read_run(log, with_sensors=True) for log in logs]
    write_replay(page, [(log, from_json(log.result)) for log in read])
    return page


@pytest.fixture(scope="session")
def replay_page(logs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(tmp_path_factory.mktemp("one") / "replay.html", logs[:1])


@pytest.fixture(scope="session")
def comparison_page(logs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(tmp_path_factory.mktemp("two") / "replay.html", logs)


@pytest.fixture(scope="session")
def nav2(logs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the replay page of the first log, with an invented report of Nav2."""
    page, log = tmp_path_factory.mktemp("nav2") / "replay.html", read_run(logs[0], with_sensors=True)
    write_replay(page, [(with_nav2_report(log), from_json(log.result))])
    return page


def wait_until_ready(tab: BrowserTab) -> BrowserTab:
    """Return the tab after the page has drawn its content."""
    tab.page.wait_for_selector("html[data-ready]", state="attached")
    return tab


def time(tab: BrowserTab) -> float:
    """Return the displayed time of the run in s."""
    return float(tab.page.evaluate("simscen.page.player.time"))


FOCUSED = "document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent.slice(0, 20)"
COLORS = """([x, y, reach]) => {
    const map = simscen.page.maps[0], [w, h] = map.size, dense = devicePixelRatio;
    const [u, v] = map.camera.pixel(x, y, w, h).map((one) => one * dense), r = reach * map.camera.scale * dense;
    const data = map.canvas.getContext("2d").getImageData(u - r, v - r, 2 * r, 2 * r).data, seen = new Set();
    for (let k = 0; k < data.length; k += 4) seen.add(`${data[k]} ${data[k + 1]} ${data[k + 2]}`);
    return seen.size;
}"""


def colors(tab: BrowserTab, x: float, y: float, reach: float = 0.35) -> int:
    """Return the number of colors on the map around a point."""
    return int(tab.page.evaluate(COLORS, [x, y, reach]))


def test_replay_of_failed_run_opens_at_the_failure_with_its_line_highlighted(
    open_tab: TabOpener, replay_page: Path, logs: list[Path]
) -> None:
    result = from_json(read_run(logs[0]).result)
    finding = next(verdict.tightest for verdict in result.verdicts if verdict.id == "clearance")
    assert finding is not None and finding.tick is not None and finding.status.value == "fail"
    tab = wait_until_ready(open_tab(replay_page))
    assert time(tab) == pytest.approx(finding.tick / result.tick_rate)
    page = tab.page
    assert page.locator("header").inner_text().startswith("FAILED")
    assert "clearance: 0.5" in page.locator("header .why").inner_text()
    assert page.locator(".line.lit code").all_inner_texts() == ["  - clearance: {min: 0.9 m}"]
    assert page.locator(".card.lit .what").inner_text() == "clearance"
    tab.until("location.hash.startsWith('#t=')")


def test_link_contains_time_and_selection(open_tab: TabOpener, replay_page: Path) -> None:
    tab = wait_until_ready(open_tab(replay_page, fragment="#t=3.5"))
    assert time(tab) == pytest.approx(3.5)
    tab.page.evaluate("location.hash = '#t=1.25'")
    tab.until("Math.abs(simscen.page.player.time - 1.25) < 1e-3")
    tab.page.evaluate("location.hash = '#v=2&t=0.5'")
    tab.until("document.querySelector('.card.lit .what')?.textContent === 'speed'")


def test_map_content_changes_with_the_displayed_time(open_tab: TabOpener, replay_page: Path, logs: list[Path]) -> None:
    trace = read_run(logs[0]).trace
    tab = wait_until_ready(open_tab(replay_page, fragment="#t=0"))
    for seconds in (2.0, 6.0, 10.0):
        tab.page.evaluate("(t) => simscen.page.player.seek(t)", seconds)
        tab.page.wait_for_timeout(50)
        x, y = trace.place(round(seconds * trace.tick_rate))
        output = tab.page.evaluate("(t) => simscen.runs[0].robots[0].truthAt(t * simscen.runs[0].rate)", seconds)
        assert (output["x"], output["y"]) == pytest.approx((x, y), abs=0.0011)
    assert colors(tab, x, y) > 12
    names = tab.page.evaluate("simscen.runs[0].thingsAt(240 * 10).map((thing) => thing.name).sort()")
    assert names == ["anna", "pallet"]
    assert tab.page.evaluate("simscen.runs[0].thingsAt(10).map((thing) => thing.name)") == []


def test_page_plays_and_seeks_by_mouse(open_tab: TabOpener, replay_page: Path) -> None:
    tab = wait_until_ready(open_tab(replay_page, fragment="#t=0"))
    box = tab.page.locator(".strip canvas").first.bounding_box()
    tab.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 20)
    end = tab.page.evaluate("simscen.page.player.end")
    assert time(tab) == pytest.approx(end / 2, rel=0.01)
    tab.page.get_by_role("button", name="Play", exact=True).click()
    tab.until(f"simscen.page.player.time > {end / 2 + 0.3}")
    tab.page.get_by_role("button", name="Pause").click()
    stopped = time(tab)
    tab.page.wait_for_timeout(80)
    assert time(tab) == stopped


def test_all_functions_of_the_replay_work_by_keyboard(open_tab: TabOpener, replay_page: Path) -> None:
    tab = wait_until_ready(open_tab(replay_page, fragment="#t=0"))
    press = tab.page.keyboard.press
    press("ArrowRight")
    assert time(tab) == pytest.approx(0.1)
    press("Shift+ArrowRight")
    assert time(tab) == pytest.approx(1.1)
    press("End")
    assert time(tab) == tab.page.evaluate("simscen.page.player.end")
    press("p")
    assert time(tab) < tab.page.evaluate("simscen.page.player.end")
    press("Home")
    press("n")
    first = tab.page.locator("#live").inner_text()
    press("n")
    assert tab.page.locator("#live").inner_text() != first
    press("f")
    assert tab.page.locator(".card.lit").count() == 1
    press("?")
    assert tab.page.get_by_role("dialog").is_visible()
    press("Escape")
    assert not tab.page.get_by_role("dialog").is_visible()
    press("e")
    assert tab.page.get_by_role("tabpanel", name="Events").is_visible()
    scale = tab.page.evaluate("simscen.page.camera.scale")
    press("+")
    assert tab.page.evaluate("simscen.page.camera.scale") > scale
    focused: set[str] = set()
    for _ in range(40):
        press("Tab")
        focused.add(tab.page.evaluate(FOCUSED))
    assert {"Play", "Time", "Next event"} <= focused and any(name.startswith("Map of") for name in focused)


@pytest.mark.parametrize(("width", "dark"), [(1280, False), (390, True)], ids=["wide and light", "phone and dark"])
def test_axe_finds_nothing_serious(open_tab: TabOpener, nav2: Path, axe: str, width: int, dark: bool) -> None:
    tab = wait_until_ready(open_tab(nav2, dark=dark, size=(width, 800)))
    for view in ("Scenario", "Now", "Events", "Log", "Parameters"):
        tab.page.get_by_role("tab", name=view).click()
        assert tab.severe_findings(axe) == []
    assert tab.page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_two_runs_play_with_the_same_clock(
    open_tab: TabOpener, comparison_page: Path, logs: list[Path], axe: str
) -> None:
    tab = wait_until_ready(open_tab(comparison_page, fragment="#t=5"))
    traces = [read_run(log).trace for log in logs]
    assert tab.page.locator(".map canvas").count() == 2
    for number, trace in enumerate(traces):
        output = tab.page.evaluate("(k) => simscen.runs[k].robots[0].truthAt(1200)", number)
        assert (output["x"], output["y"]) == pytest.approx(trace.place(1200), abs=0.0011)
    assert tab.page.evaluate("simscen.page.maps[0].camera === simscen.page.maps[1].camera")
    assert tab.page.locator(".map .chip").all_inner_texts() == ["lidar.noise", "lidar.noise"]
    assert tab.page.locator(".of-run h2").all_inner_texts() == ["A failed", "B failed"]
    assert tab.severe_findings(axe) == []


def test_names_in_a_log_are_escaped(open_tab: TabOpener, tmp_path: Path) -> None:
    log, result = hostile_log()
    page = tmp_path / "replay.html"
    write_replay(page, [(log, result)])
    tab = wait_until_ready(open_tab(page))
    tab.page.get_by_role("tab", name="Events").click()
    assert tab.page.evaluate("typeof pwned") == "undefined"
    assert tab.page.locator("img, iframe, object, embed, link[href]").count() == 0
    assert tab.page.locator("script").count() == 2
    output = tab.page.locator("body").inner_text()
    assert "<img src=x onerror=pwned()>" in output
    assert not set(output) & set("\u202e\u2066\x1b\x00")
    assert MARKUP.split("\u202e")[0] in tab.page.title()


def test_content_security_policy_allows_only_own_parts(open_tab: TabOpener, replay_page: Path) -> None:
    tab = wait_until_ready(open_tab(replay_page))
    policy = tab.page.locator("meta[http-equiv=Content-Security-Policy]").get_attribute("content")
    assert policy.startswith("default-src 'none'; script-src 'sha256-") and "unsafe" not in policy
    blocked = tab.page.evaluate("fetch('data:text/plain,hello').then(() => 'fetched', () => 'refused')")
    assert blocked == "refused"
    tab.ignore_complaints("console: ")  # the browser logs the refusal


def test_replay_page_is_smaller_than_2_mb(open_tab: TabOpener, replay_page: Path, record_property, capsys) -> None:
    """The time is not checked, because the machine may be busy."""
    tab = wait_until_ready(open_tab(replay_page))
    ready_ms = int(tab.page.evaluate("document.documentElement.dataset.ready"))
    size = replay_page.stat().st_size
    record_property("replay_ready_ms", ready_ms)
    seconds = tab.page.evaluate("simscen.runs[0].seconds")
    with capsys.disabled():
        print(f"\nreplay.html of {seconds:.0f} s: {size / 1e3:.0f} kB, ready after {ready_ms} ms")
    assert size < 2_000_000


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
def test_javascript_modules_compute_correct_values() -> None:
    command = ["node", "--test", "--test-reporter=tap", str(ROOT / "tests/browser/replay.test.mjs")]
    result = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert result.returncode == 0, result.stdout


def test_equal_logs_make_equal_pages(replay_page: Path, logs: list[Path], tmp_path: Path) -> None:
    assert write_page(tmp_path / "again.html", logs[:1]).read_bytes() == replay_page.read_bytes()


def test_log_without_ground_truth_shows_the_estimated_pose(open_tab: TabOpener, tmp_path: Path) -> None:
    log, result = hostile_log()
    no_samples = Samples(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    trace = replace(log.trace, truth=no_samples, velocity=no_samples, clearance=no_samples)
    write_replay(tmp_path / "replay.html", [(replace(log, trace=trace), result)])
    tab = wait_until_ready(open_tab(tmp_path / "replay.html", fragment="#t=2"))
    assert tab.page.evaluate("simscen.runs[0].robots[0].truthAt(480)") is None
    assert tab.page.evaluate("simscen.runs[0].robots[0].placeAt(480).x") == pytest.approx(1.0, abs=0.01)
    for key in ("w", "n", "p", "c", ",", "f"):
        tab.page.keyboard.press(key)
    assert "not recorded" in tab.page.get_by_role("tabpanel", name="Now").inner_text()


def lit_rows(tab: BrowserTab) -> list[str]:
    """Return the highlighted entries of the log, e.g. "9.25 s ✓ Spin success 0.05 s"."""
    rows = tab.page.locator("#view-log li.lit")
    return [" ".join(text.split()) for text in rows.all_inner_texts()]


def test_log_of_the_stack_follows_the_time_and_entries_lead_to_their_time(open_tab: TabOpener, nav2: Path) -> None:
    tab = wait_until_ready(open_tab(nav2, fragment="#t=2.3"))
    page = tab.page
    page.keyboard.press("l")
    assert lit_rows(tab) == ["2.25 s ✓ ComputePathToPose success 0.05 s"]
    running = page.locator("#view-log .running-now")
    assert running.inner_text() == "Running now: NavigateRecovery · NavigateWithReplanning · FollowPath"
    page.get_by_role("combobox", name="Entries to show").select_option("problems")
    page.locator("#view-log li", has_text="FollowPath").click()
    failure_time = time(tab)
    assert failure_time == pytest.approx(0.75 * tab.page.evaluate("simscen.runs[0].seconds"), abs=0.01)
    tab.until("document.querySelector('#view-log .running-now').textContent.endsWith('NavigateWithReplanning · Spin')")
    assert [row.split(" ", 2)[2] for row in lit_rows(tab)] == [
        f"✗ FollowPath failure {failure_time - 0.25:.2f} s",
        "! controller_server error: Failed to make progress",
    ]


def test_log_of_the_stack_can_be_filtered_and_walked_through_by_keyboard(open_tab: TabOpener, nav2: Path) -> None:
    tab = wait_until_ready(open_tab(nav2, fragment="#t=0"))
    page = tab.page
    page.keyboard.press("l")
    rows = page.locator("#view-log li")
    row_count = rows.count()
    page.get_by_role("searchbox", name="Filter the log").fill("spin RUN")
    assert [row.split()[3:] for row in rows.all_inner_texts()] == [["Spin", "running"]]
    page.get_by_role("searchbox", name="Filter the log").fill("")
    assert rows.count() == row_count
    rows.first.get_by_role("button").focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    assert time(tab) == pytest.approx(0.2, abs=0.005)
    assert "ComputePathToPose running" in page.evaluate("document.activeElement.innerText.replace(/\\s+/g, ' ')")


def test_long_log_shows_only_rows_around_the_displayed_time(
    open_tab: TabOpener, logs: list[Path], tmp_path: Path
) -> None:
    log = read_run(logs[0], with_sensors=True)
    lines = tuple((ERROR, f"error {number}") for number in range(900))
    write_replay(tmp_path / "replay.html", [(with_nav2_report(log, lines=lines), from_json(log.result))])
    tab = wait_until_ready(open_tab(tmp_path / "replay.html", fragment="#t=0"))
    page = tab.page
    page.keyboard.press("l")
    rows = page.locator("#view-log li")
    assert rows.count() < 200
    page.keyboard.press("End")
    tab.until("document.querySelector('#view-log li:last-child').textContent.endsWith('error 899')")
    page.locator("#view-log .more").click()
    assert "later" in rows.last.inner_text() and rows.count() < 200
    marks = page.locator(".lanes .sign.stack")
    assert marks.count() == 2  # one for the failure, and one for 900 errors at the same time
    marks.first.dispatch_event("click")
    lit = "document.querySelector('#view-log li.lit')"
    tab.until(f"({lit}?.innerText ?? '').replace(/\\s+/g, ' ').includes('FollowPath failure')")


def test_parameters_of_the_stack_can_be_searched(open_tab: TabOpener, nav2: Path) -> None:
    tab = wait_until_ready(open_tab(nav2))
    page = tab.page
    page.keyboard.press("m")
    first = page.locator("#view-parameters details").first
    assert "FollowPath.desired_linear_vel" in first.inner_text() and "odom_topic" not in first.inner_text()
    output = page.locator("#view-parameters .parameter:visible")
    page.get_by_role("searchbox", name="Filter the parameters").fill("local_costmap radius")
    assert [row.split() for row in output.all_inner_texts()] == [["inflation_layer.inflation_radius", "0.55"]]
    page.get_by_role("searchbox", name="Filter the parameters").fill("nothing like that")
    assert output.count() == 0
    page.get_by_role("searchbox", name="Filter the parameters").fill("")
    assert first.is_visible()


def test_parameters_that_differ_between_two_runs_come_first(
    open_tab: TabOpener, logs: list[Path], tmp_path: Path
) -> None:
    log = read_run(logs[0], with_sensors=True)
    result = from_json(log.result)
    nodes = [{"/amcl": {"z_hit": 0.5, "z_max": 0.05}}, {"/amcl": {"z_hit": 0.7, "z_max": 0.05, "beams": 60}}]
    write_replay(tmp_path / "replay.html", [(with_nav2_report(log, replay_page), result) for replay_page in nodes])
    tab = wait_until_ready(open_tab(tmp_path / "replay.html"))
    tab.page.get_by_role("tab", name="Parameters").click()
    rows = tab.page.locator("#view-parameters details[open] .parameter")
    assert [row.split() for row in rows.all_inner_texts()] == [
        ["z_hit", "A", "0.5", "B", "0.7"],
        ["beams", "A", "–", "B", "60"],
    ]


def test_page_of_the_reference_stack_has_no_empty_views(open_tab: TabOpener, replay_page: Path) -> None:
    tab = wait_until_ready(open_tab(replay_page))
    for key in ("l", "m"):
        tab.page.keyboard.press(key)
    assert tab.page.get_by_role("tab").all_inner_texts() == ["Scenario", "Now", "Events"]
    assert tab.page.get_by_role("tab", name="Scenario").get_attribute("aria-selected") == "true"
    assert "Stack log" not in tab.page.locator(".lanes").inner_text()
