"""Tests of the replay page in a browser."""

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from drive import drive
from hostile import EVIL, hostile_log
from nav2_report import ERROR, with_nav2_report
from rig import Opened, Opener

from simscen.core.records.trace import Samples
from simscen.judge.result_json import from_json
from simscen.record.log_reader import read_run
from simscen.report.replay import write_replay

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return the logs of two seeds of the run in drive.py."""
    return [drive(tmp_path_factory.mktemp(f"seed-{seed}"), seed) for seed in (1, 2)]


def write_page(page: Path, logs: list[Path]) -> Path:
    read = [read_run(log, with_sensors=True) for log in logs]
    write_replay(page, [(log, from_json(log.result)) for log in read])
    return page


@pytest.fixture(scope="session")
def one(logs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(tmp_path_factory.mktemp("one") / "replay.html", logs[:1])


@pytest.fixture(scope="session")
def two(logs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(tmp_path_factory.mktemp("two") / "replay.html", logs)


@pytest.fixture(scope="session")
def nav2(logs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The drive, as if a Nav2 had reported its behavior tree, log lines, and parameters."""
    page, log = tmp_path_factory.mktemp("nav2") / "replay.html", read_run(logs[0], with_sensors=True)
    write_replay(page, [(with_nav2_report(log), from_json(log.result))])
    return page


def ready(opened: Opened) -> Opened:
    opened.page.wait_for_selector("html[data-ready]", state="attached")
    return opened


def time(opened: Opened) -> float:
    return float(opened.page.evaluate("simscen.page.player.time"))


FOCUSED = "document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent.slice(0, 20)"
COLORS = """([x, y, reach]) => {
    const map = simscen.page.maps[0], [w, h] = map.size, dense = devicePixelRatio;
    const [u, v] = map.camera.pixel(x, y, w, h).map((one) => one * dense), r = reach * map.camera.scale * dense;
    const data = map.canvas.getContext("2d").getImageData(u - r, v - r, 2 * r, 2 * r).data, seen = new Set();
    for (let k = 0; k < data.length; k += 4) seen.add(`${data[k]} ${data[k + 1]} ${data[k + 2]}`);
    return seen.size;
}"""


def colors(opened: Opened, x: float, y: float, reach: float = 0.35) -> int:
    """Return the number of colors on the map around a point."""
    return int(opened.page.evaluate(COLORS, [x, y, reach]))


def test_replay_of_failed_run_opens_at_the_failure_with_its_line_highlighted(
    open_page: Opener, one: Path, logs: list[Path]
) -> None:
    result = from_json(read_run(logs[0]).result)
    failed = next(verdict.tightest for verdict in result.verdicts if verdict.id == "clearance")
    assert failed is not None and failed.tick is not None and failed.status.value == "fail"
    opened = ready(open_page(one))
    assert time(opened) == pytest.approx(failed.tick / result.tick_rate)
    page = opened.page
    assert page.locator("header").inner_text().startswith("FAILED")
    assert "clearance: 0.5" in page.locator("header .why").inner_text()
    assert page.locator(".line.lit code").all_inner_texts() == ["  - clearance: {min: 0.9 m}"]
    assert page.locator(".card.lit .what").inner_text() == "clearance"
    opened.until("location.hash.startsWith('#t=')")


def test_link_contains_time_and_selection(open_page: Opener, one: Path) -> None:
    opened = ready(open_page(one, where="#t=3.5"))
    assert time(opened) == pytest.approx(3.5)
    opened.page.evaluate("location.hash = '#t=1.25'")
    opened.until("Math.abs(simscen.page.player.time - 1.25) < 1e-3")
    opened.page.evaluate("location.hash = '#v=2&t=0.5'")
    opened.until("document.querySelector('.card.lit .what')?.textContent === 'speed'")


def test_map_content_changes_with_the_displayed_time(open_page: Opener, one: Path, logs: list[Path]) -> None:
    trace = read_run(logs[0]).trace
    opened = ready(open_page(one, where="#t=0"))
    for seconds in (2.0, 6.0, 10.0):
        opened.page.evaluate("(t) => simscen.page.player.seek(t)", seconds)
        opened.page.wait_for_timeout(50)
        x, y = trace.place(round(seconds * trace.tick_rate))
        shown = opened.page.evaluate("(t) => simscen.runs[0].robots[0].truthAt(t * simscen.runs[0].rate)", seconds)
        assert (shown["x"], shown["y"]) == pytest.approx((x, y), abs=0.0011)
    assert colors(opened, x, y) > 12
    names = opened.page.evaluate("simscen.runs[0].thingsAt(240 * 10).map((thing) => thing.name).sort()")
    assert names == ["anna", "pallet"]
    assert opened.page.evaluate("simscen.runs[0].thingsAt(10).map((thing) => thing.name)") == []


def test_page_plays_and_seeks_by_mouse(open_page: Opener, one: Path) -> None:
    opened = ready(open_page(one, where="#t=0"))
    box = opened.page.locator(".strip canvas").first.bounding_box()
    opened.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 20)
    end = opened.page.evaluate("simscen.page.player.end")
    assert time(opened) == pytest.approx(end / 2, rel=0.01)
    opened.page.get_by_role("button", name="Play", exact=True).click()
    opened.until(f"simscen.page.player.time > {end / 2 + 0.3}")
    opened.page.get_by_role("button", name="Pause").click()
    stopped = time(opened)
    opened.page.wait_for_timeout(80)
    assert time(opened) == stopped


def test_all_functions_of_the_replay_work_by_keyboard(open_page: Opener, one: Path) -> None:
    opened = ready(open_page(one, where="#t=0"))
    press = opened.page.keyboard.press
    press("ArrowRight")
    assert time(opened) == pytest.approx(0.1)
    press("Shift+ArrowRight")
    assert time(opened) == pytest.approx(1.1)
    press("End")
    assert time(opened) == opened.page.evaluate("simscen.page.player.end")
    press("p")
    assert time(opened) <= opened.page.evaluate("simscen.page.player.end")
    press("Home")
    press("n")
    first = opened.page.locator("#live").inner_text()
    press("n")
    assert opened.page.locator("#live").inner_text() != first
    press("f")
    assert opened.page.locator(".card.lit").count() == 1
    press("?")
    assert opened.page.get_by_role("dialog").is_visible()
    press("Escape")
    assert not opened.page.get_by_role("dialog").is_visible()
    press("e")
    assert opened.page.get_by_role("tabpanel", name="Events").is_visible()
    before = opened.page.evaluate("simscen.page.camera.scale")
    press("+")
    assert opened.page.evaluate("simscen.page.camera.scale") > before
    reached: set[str] = set()
    for _ in range(40):
        press("Tab")
        reached.add(opened.page.evaluate(FOCUSED))
    assert {"Play", "Time", "Next event"} <= reached and any(name.startswith("Map of") for name in reached)


@pytest.mark.parametrize(("width", "dark"), [(1280, False), (390, True)], ids=["wide and light", "phone and dark"])
def test_axe_finds_nothing_serious(open_page: Opener, nav2: Path, axe: str, width: int, dark: bool) -> None:
    opened = ready(open_page(nav2, dark=dark, size=(width, 800)))
    for view in ("Scenario", "Now", "Events", "Log", "Parameters"):
        opened.page.get_by_role("tab", name=view).click()
        assert opened.grave_findings(axe) == []
    assert opened.page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_two_runs_play_with_the_same_clock(open_page: Opener, two: Path, logs: list[Path], axe: str) -> None:
    opened = ready(open_page(two, where="#t=5"))
    traces = [read_run(log).trace for log in logs]
    assert opened.page.locator(".map canvas").count() == 2
    for number, trace in enumerate(traces):
        shown = opened.page.evaluate("(k) => simscen.runs[k].robots[0].truthAt(1200)", number)
        assert (shown["x"], shown["y"]) == pytest.approx(trace.place(1200), abs=0.0011)
    assert opened.page.evaluate("simscen.page.maps[0].camera === simscen.page.maps[1].camera")
    assert opened.page.locator(".map .chip").all_inner_texts() == ["lidar.noise", "lidar.noise"]
    assert opened.page.locator(".of-run h2").all_inner_texts() == ["A failed", "B failed"]
    assert opened.grave_findings(axe) == []


def test_names_in_a_log_are_escaped(open_page: Opener, tmp_path: Path) -> None:
    log, result = hostile_log()
    page = tmp_path / "replay.html"
    write_replay(page, [(log, result)])
    opened = ready(open_page(page))
    opened.page.get_by_role("tab", name="Events").click()
    assert opened.page.evaluate("typeof pwned") == "undefined"
    assert opened.page.locator("img, iframe, object, embed, link[href]").count() == 0
    assert opened.page.locator("script").count() == 2
    shown = opened.page.locator("body").inner_text()
    assert "<img src=x onerror=pwned()>" in shown
    assert not set(shown) & set("\u202e\u2066\x1b\x00")
    assert EVIL.split("\u202e")[0] in opened.page.title()


def test_content_security_policy_allows_only_own_parts(open_page: Opener, one: Path) -> None:
    opened = ready(open_page(one))
    policy = opened.page.locator("meta[http-equiv=Content-Security-Policy]").get_attribute("content")
    assert policy.startswith("default-src 'none'; script-src 'sha256-") and "unsafe" not in policy
    blocked = opened.page.evaluate("fetch('data:text/plain,hello').then(() => 'fetched', () => 'refused')")
    assert blocked == "refused"
    opened.forgive("console: ")  # the browser logs the refusal


def test_page_opens_within_a_second(open_page: Opener, one: Path, record_property, capsys) -> None:
    """The time is printed but not checked, because the machine may be busy."""
    opened = ready(open_page(one))
    took = int(opened.page.evaluate("document.documentElement.dataset.ready"))
    size = one.stat().st_size
    record_property("replay_ready_ms", took)
    seconds = opened.page.evaluate("simscen.runs[0].seconds")
    with capsys.disabled():
        print(f"\nreplay.html of {seconds:.0f} s: {size / 1e3:.0f} kB, ready after {took} ms")
    assert size < 2_000_000


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
def test_javascript_modules_compute_correct_values() -> None:
    command = ["node", "--test", "--test-reporter=tap", str(ROOT / "tests/browser/replay.test.mjs")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stdout


def test_equal_logs_make_equal_pages(one: Path, logs: list[Path], tmp_path: Path) -> None:
    assert write_page(tmp_path / "again.html", logs[:1]).read_bytes() == one.read_bytes()


def test_log_without_ground_truth_shows_the_estimated_pose(open_page: Opener, tmp_path: Path) -> None:
    log, result = hostile_log()
    nowhere = Samples(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    trace = replace(log.trace, truth=nowhere, velocity=nowhere, clearance=nowhere)
    write_replay(tmp_path / "replay.html", [(replace(log, trace=trace), result)])
    opened = ready(open_page(tmp_path / "replay.html", where="#t=2"))
    assert opened.page.evaluate("simscen.runs[0].robots[0].truthAt(480)") is None
    assert opened.page.evaluate("simscen.runs[0].robots[0].placeAt(480).x") == pytest.approx(1.0, abs=0.01)
    for key in ("w", "n", "p", "c", ",", "f"):
        opened.page.keyboard.press(key)
    assert "not recorded" in opened.page.get_by_role("tabpanel", name="Now").inner_text()


def lit_rows(opened: Opened) -> list[str]:
    """Return the highlighted entries of the log, e.g. "9.25 s ✓ Spin success 0.05 s"."""
    rows = opened.page.locator("#view-log li.lit")
    return [" ".join(text.split()) for text in rows.all_inner_texts()]


def test_log_of_the_stack_follows_the_time_and_entries_lead_to_their_time(open_page: Opener, nav2: Path) -> None:
    opened = ready(open_page(nav2, where="#t=2.3"))
    page = opened.page
    page.keyboard.press("l")
    assert lit_rows(opened) == ["2.25 s ✓ ComputePathToPose success 0.05 s"]
    running = page.locator("#view-log .running-now")
    assert running.inner_text() == "Running now: NavigateRecovery · NavigateWithReplanning · FollowPath"
    page.get_by_role("combobox", name="Entries to show").select_option("problems")
    page.locator("#view-log li", has_text="FollowPath").click()
    failed = time(opened)
    assert failed == pytest.approx(0.75 * opened.page.evaluate("simscen.runs[0].seconds"), abs=0.01)
    opened.until(
        "document.querySelector('#view-log .running-now').textContent.endsWith('NavigateWithReplanning · Spin')"
    )
    assert [row.split(" ", 2)[2] for row in lit_rows(opened)] == [
        f"✗ FollowPath failure {failed - 0.25:.2f} s",
        "! controller_server error: Failed to make progress",
    ]


def test_log_of_the_stack_can_be_filtered_and_walked_through_by_keyboard(open_page: Opener, nav2: Path) -> None:
    opened = ready(open_page(nav2, where="#t=0"))
    page = opened.page
    page.keyboard.press("l")
    rows = page.locator("#view-log li")
    everything = rows.count()
    page.get_by_role("searchbox", name="Filter the log").fill("spin RUN")
    assert [row.split()[3:] for row in rows.all_inner_texts()] == [["Spin", "running"]]
    page.get_by_role("searchbox", name="Filter the log").fill("")
    assert rows.count() == everything
    rows.first.get_by_role("button").focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    assert time(opened) == pytest.approx(0.2, abs=0.005)
    assert "ComputePathToPose running" in page.evaluate("document.activeElement.innerText.replace(/\\s+/g, ' ')")


def test_rows_around_the_time_are_shown_of_a_long_log(open_page: Opener, logs: list[Path], tmp_path: Path) -> None:
    log = read_run(logs[0], with_sensors=True)
    lines = tuple((ERROR, f"error {number}") for number in range(900))
    write_replay(tmp_path / "replay.html", [(with_nav2_report(log, lines=lines), from_json(log.result))])
    opened = ready(open_page(tmp_path / "replay.html", where="#t=0"))
    page = opened.page
    page.keyboard.press("l")
    rows = page.locator("#view-log li")
    assert rows.count() < 200
    page.keyboard.press("End")
    opened.until("document.querySelector('#view-log li:last-child').textContent.endsWith('error 899')")
    page.locator("#view-log .more").click()
    assert "later" in rows.last.inner_text() and rows.count() < 200
    marks = page.locator(".lanes .sign.stack")
    assert marks.count() == 2  # of 900 errors at one time there is one
    marks.first.dispatch_event("click")
    lit = "document.querySelector('#view-log li.lit')"
    opened.until(f"({lit}?.innerText ?? '').replace(/\\s+/g, ' ').includes('FollowPath failure')")


def test_parameters_of_the_stack_can_be_searched(open_page: Opener, nav2: Path) -> None:
    opened = ready(open_page(nav2))
    page = opened.page
    page.keyboard.press("m")
    first = page.locator("#view-parameters details").first
    assert "FollowPath.desired_linear_vel" in first.inner_text() and "odom_topic" not in first.inner_text()
    shown = page.locator("#view-parameters .parameter:visible")
    page.get_by_role("searchbox", name="Filter the parameters").fill("local_costmap radius")
    assert [row.split() for row in shown.all_inner_texts()] == [["inflation_layer.inflation_radius", "0.55"]]
    page.get_by_role("searchbox", name="Filter the parameters").fill("nothing like that")
    assert shown.count() == 0
    page.get_by_role("searchbox", name="Filter the parameters").fill("")
    assert first.is_visible()


def test_parameters_that_differ_between_two_runs_come_first(
    open_page: Opener, logs: list[Path], tmp_path: Path
) -> None:
    log = read_run(logs[0], with_sensors=True)
    result = from_json(log.result)
    nodes = [{"/amcl": {"z_hit": 0.5, "z_max": 0.05}}, {"/amcl": {"z_hit": 0.7, "z_max": 0.05, "beams": 60}}]
    write_replay(tmp_path / "replay.html", [(with_nav2_report(log, one), result) for one in nodes])
    opened = ready(open_page(tmp_path / "replay.html"))
    opened.page.get_by_role("tab", name="Parameters").click()
    rows = opened.page.locator("#view-parameters details[open] .parameter")
    assert [row.split() for row in rows.all_inner_texts()] == [
        ["z_hit", "A", "0.5", "B", "0.7"],
        ["beams", "A", "–", "B", "60"],
    ]


def test_page_of_the_reference_stack_has_no_empty_views(open_page: Opener, one: Path) -> None:
    opened = ready(open_page(one))
    for key in ("l", "m"):
        opened.page.keyboard.press(key)
    assert opened.page.get_by_role("tab").all_inner_texts() == ["Scenario", "Now", "Events"]
    assert opened.page.get_by_role("tab", name="Scenario").get_attribute("aria-selected") == "true"
    assert "Stack log" not in opened.page.locator(".lanes").inner_text()
