"""Tests of the report page in a browser: failures first, search, filters, and order."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from browser_tab import BrowserTab, TabOpener
from session_results import finished_run, past_sessions, session_runs

from simscen.report.suite import RunningSession, SessionReport, to_html

VISIBLE_RUNS = (
    "[...document.querySelectorAll('.run:not([hidden])')].filter(run => !run.closest('[hidden]')).map(run => run.id)"
)
SHUTS, OPENS, WARD = (
    "run-scenarios-doors-shuts-seed-1",
    "run-scenarios-doors-opens-seed-1",
    "run-scenarios-zones-ward-seed-1",
)
SLOW = "run-scenarios-speeds-slow-seed-4"

SEARCHES = [
    ("find", "PALLET stood door", {SHUTS}),
    ("find", "zones/ward", {WARD}),
    ("theme", "doors", {SHUTS, OPENS}),
    ("tag", "smoke", {SHUTS}),
    ("variation", "slow", {SLOW}),
]


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the report page of an invented session with two earlier sessions."""
    folder = tmp_path_factory.mktemp("out")
    runs = session_runs(folder)
    page = folder / "report.html"
    page.write_text(
        to_html(SessionReport(runs, past_sessions(runs), folder=str(folder), files=("junit.xml",))), encoding="utf-8"
    )
    return page


def visible_runs(tab: BrowserTab) -> list[str]:
    """Return the ids of the runs that are not hidden by filters, in their order."""
    ids: list[str] = tab.page.evaluate(VISIBLE_RUNS)
    return ids


def test_failures_are_on_the_first_screen_with_reason_and_line(open_tab: TabOpener, report: Path) -> None:
    tab = open_tab(report)
    assert "2 failed" in tab.page.locator("h1").inner_text()
    failed = tab.page.locator(f"[id='{SHUTS}']")
    assert failed.get_attribute("open") is not None
    row = failed.locator("tbody tr").first.inner_text()
    assert "12.00 m > 10.00 m, at t = 10.00 s, (1.00, 2.00)" in row
    assert "why: a pallet stood in the way" in row
    assert "shuts.scenario.yaml:12" in row
    assert failed.locator("a", has_text="replay").get_attribute("href") == "./runs/doors/shuts/seed-1/replay.html"
    assert failed.locator("img").evaluate("image => image.decode().then(() => image.naturalWidth)") == 300


def test_search_finds_runs_by_words_themes_tags_and_variations(open_tab: TabOpener, report: Path) -> None:
    tab = open_tab(report)
    for name, value, expected in SEARCHES:
        field = tab.page.locator(f"[name={name}]")
        (field.fill if name == "find" else field.select_option)(value)
        assert set(visible_runs(tab)) == expected, name
        assert f"{len(expected)} of 8 shown" in tab.page.locator("#shown").inner_text()
        if value == "smoke":
            second_tab = open_tab(report, fragment=tab.page.evaluate("location.hash"))
            assert set(visible_runs(second_tab)) == expected, "the link contains the filter"
        tab.page.locator("#controls").evaluate("form => { form.reset(); form.dispatchEvent(new Event('input')); }")


def test_filters_show_outcomes_and_changed_runs(open_tab: TabOpener, report: Path) -> None:
    tab = open_tab(report)
    tab.page.locator("[name=status][value=passed]").uncheck()
    assert len(visible_runs(tab)) == 3
    tab.page.locator("[name=status][value=error]").uncheck()
    assert set(visible_runs(tab)) == {SHUTS, SLOW}
    tab.page.locator("[name=status][value=passed]").check()
    tab.page.locator("[name=changed]").check()
    assert set(visible_runs(tab)) == {SHUTS, SLOW}
    tab.page.locator("[name=find]").fill("nothing of the kind")
    assert visible_runs(tab) == []
    tab.page.locator("#all").click()
    assert len(visible_runs(tab)) == 8


def test_runs_can_be_sorted(open_tab: TabOpener, report: Path) -> None:
    tab = open_tab(report)
    order = tab.page.locator("[name=order]")
    order.select_option("margin")
    assert visible_runs(tab)[:3] == [SHUTS, SLOW, "run-scenarios-speeds-fast-seed-1"], "the first run sorts its group"
    order.select_option("simulated")
    assert visible_runs(tab)[0] == SLOW
    assert visible_runs(tab)[-1].startswith("run-scenarios-evil")
    order.select_option("name")
    assert visible_runs(tab)[0] == OPENS
    order.select_option("")
    assert visible_runs(tab)[0].startswith("run-scenarios-evil")


def test_all_functions_of_the_report_work_by_keyboard(open_tab: TabOpener, report: Path) -> None:
    tab = open_tab(report)
    keys, focused = tab.page.keyboard, "document.activeElement.closest('.run')?.id"
    keys.press("f")
    first = tab.page.evaluate(focused)
    keys.press("f")
    second = tab.page.evaluate(focused)
    assert first.startswith("run-scenarios-evil") and second == SHUTS
    keys.press("Enter")
    assert tab.page.locator(f"[id='{SHUTS}']").get_attribute("open") is None
    keys.press("j")
    assert tab.page.evaluate(focused) not in (first, second)
    keys.press("k")
    assert tab.page.evaluate(focused) == SHUTS
    keys.press("/")
    keys.type("ward")
    assert visible_runs(tab) == [WARD]


def test_a_link_to_a_run_opens_it(open_tab: TabOpener, report: Path) -> None:
    tab = open_tab(report, fragment=f"#{WARD}")
    assert tab.page.locator(f"[id='{WARD}']").get_attribute("open") is not None
    tab.until(f"document.activeElement.closest('.run')?.id === '{WARD}'")
    tab.page.locator(".history summary").click()
    tab.page.locator(f".history a[href='#{SLOW}']").click()
    tab.until(f"document.activeElement.closest('.run')?.id === '{SLOW}'")


@pytest.mark.parametrize(("dark", "size"), [(False, (1280, 800)), (True, (1280, 800)), (False, (390, 840))])
def test_report_is_accessible_and_fits_the_screen(
    open_tab: TabOpener, report: Path, axe: str, dark: bool, size: tuple[int, int]
) -> None:
    tab = open_tab(report, dark=dark, size=size)
    tab.page.evaluate("document.querySelectorAll('details').forEach(element => element.open = true)")
    assert tab.severe_findings(axe) == []
    assert tab.page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_names_from_scenarios_are_escaped(open_tab: TabOpener, report: Path) -> None:
    tab = open_tab(report)
    assert tab.page.title().startswith("simscen: ")
    assert tab.page.locator("script").count() == 1
    assert "<script>document.title" in tab.page.locator("#runs").inner_text()


def test_page_of_a_running_session_reloads_until_it_ends(open_tab: TabOpener, report: Path, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    runs = [finished_run("a/first"), finished_run("a/second", margin=-0.1)]
    page.write_text(to_html(SessionReport(runs[:1], progress=RunningSession(2, (runs[1].key,)))), encoding="utf-8")
    tab = open_tab(page)
    assert "1 of 2 runs done, running: a/second, seed 1" in tab.page.locator("#live").inner_text()
    page.write_text(to_html(SessionReport(runs)), encoding="utf-8")
    tab.page.locator(".run").nth(1).wait_for(state="attached")
    assert tab.page.locator("#live").count() == 0


def test_page_is_readable_without_javascript(browser: object, report: Path) -> None:
    context = browser.new_context(java_script_enabled=False)  # type: ignore[attr-defined]
    page = context.new_page()
    page.goto(report.as_uri())
    assert page.locator("#controls").is_hidden()
    assert page.locator(f"[id='{SHUTS}'] .why").is_visible()
    context.close()


@pytest.mark.slow
def test_report_of_two_thousand_runs_is_usable(open_tab: TabOpener, tmp_path: Path) -> None:
    runs = [finished_run(f"many/{k // 20}", k % 20 + 1, 0.01 * (k % 97) - 0.02, k % 60) for k in range(2000)]
    page = tmp_path / "report.html"
    page.write_text(to_html(SessionReport(runs)), encoding="utf-8")
    assert page.stat().st_size < 8 * 2**20
    tab = open_tab(page)
    tab.page.locator("[name=find]").fill("many/77")
    assert len(visible_runs(tab)) == 20
    tab.page.locator("#all").evaluate("button => button.click()")
    tab.page.locator("[name=order]").select_option("margin")
    assert len(visible_runs(tab)) == 2000
