"""Tests of the report page in a browser: failures first, search, filters, and order."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from answers import past, run, session
from rig import Opened, Opener

from simscen.report.suite import RunningSession, SessionReport, to_html

SHOWN = (
    "[...document.querySelectorAll('.run:not([hidden])')].filter(run => !run.closest('[hidden]')).map(run => run.id)"
)
SHUTS, OPENS, WARD = (
    "run-scenarios-doors-shuts-seed-1",
    "run-scenarios-doors-opens-seed-1",
    "run-scenarios-zones-ward-seed-1",
)
SLOW = "run-scenarios-speeds-slow-seed-4"

FOUND = [
    ("find", "PALLET stood door", {SHUTS}),
    ("find", "zones/ward", {WARD}),
    ("theme", "doors", {SHUTS, OPENS}),
    ("tag", "smoke", {SHUTS}),
    ("variation", "slow", {SLOW}),
]


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("out")
    answers = session(folder)
    page = folder / "report.html"
    page.write_text(
        to_html(SessionReport(answers, past(answers), folder=str(folder), files=("junit.xml",))), encoding="utf-8"
    )
    return page


def shown(opened: Opened) -> list[str]:
    found: list[str] = opened.page.evaluate(SHOWN)
    return found


def test_failures_are_on_the_first_screen_with_reason_and_line(open_page: Opener, report: Path) -> None:
    opened = open_page(report)
    assert "2 failed" in opened.page.locator("h1").inner_text()
    failed = opened.page.locator(f"[id='{SHUTS}']")
    assert failed.get_attribute("open") is not None
    row = failed.locator("tbody tr").first.inner_text()
    assert "12.00 m > 10.00 m, at t = 10.00 s, (1.00, 2.00)" in row
    assert "why: a pallet stood in the way" in row
    assert "shuts.scenario.yaml:12" in row
    assert failed.locator("a", has_text="replay").get_attribute("href") == "./runs/doors/shuts/seed-1/replay.html"
    assert failed.locator("img").evaluate("image => image.decode().then(() => image.naturalWidth)") == 300


def test_search_finds_runs_by_words_themes_tags_and_variations(open_page: Opener, report: Path) -> None:
    opened = open_page(report)
    for name, value, left in FOUND:
        field = opened.page.locator(f"[name={name}]")
        (field.fill if name == "find" else field.select_option)(value)
        assert set(shown(opened)) == left, name
        assert f"{len(left)} of 8 shown" in opened.page.locator("#shown").inner_text()
        if value == "smoke":
            again = open_page(report, where=opened.page.evaluate("location.hash"))
            assert set(shown(again)) == left, "a link keeps what was chosen"
        opened.page.locator("#controls").evaluate("form => { form.reset(); form.dispatchEvent(new Event('input')); }")


def test_filters_show_outcomes_and_changed_runs(open_page: Opener, report: Path) -> None:
    opened = open_page(report)
    opened.page.locator("[name=status][value=passed]").uncheck()
    assert len(shown(opened)) == 3
    opened.page.locator("[name=status][value=error]").uncheck()
    assert set(shown(opened)) == {SHUTS, SLOW}
    opened.page.locator("[name=status][value=passed]").check()
    opened.page.locator("[name=changed]").check()
    assert set(shown(opened)) == {SHUTS, SLOW}
    opened.page.locator("[name=find]").fill("nothing of the kind")
    assert shown(opened) == []
    opened.page.locator("#all").click()
    assert len(shown(opened)) == 8


def test_runs_can_be_sorted(open_page: Opener, report: Path) -> None:
    opened = open_page(report)
    order = opened.page.locator("[name=order]")
    order.select_option("margin")
    assert shown(opened)[:3] == [SHUTS, SLOW, "run-scenarios-speeds-fast-seed-1"], "groups go by their first"
    order.select_option("simulated")
    assert shown(opened)[0] == SLOW
    assert shown(opened)[-1].startswith("run-scenarios-evil")
    order.select_option("name")
    assert shown(opened)[0] == OPENS
    order.select_option("")
    assert shown(opened)[0].startswith("run-scenarios-evil")


def test_all_functions_of_the_report_work_by_keyboard(open_page: Opener, report: Path) -> None:
    opened = open_page(report)
    keys, focused = opened.page.keyboard, "document.activeElement.closest('.run')?.id"
    keys.press("f")
    first = opened.page.evaluate(focused)
    keys.press("f")
    second = opened.page.evaluate(focused)
    assert first.startswith("run-scenarios-evil") and second == SHUTS
    keys.press("Enter")
    assert opened.page.locator(f"[id='{SHUTS}']").get_attribute("open") is None
    keys.press("j")
    assert opened.page.evaluate(focused) not in (first, second)
    keys.press("k")
    assert opened.page.evaluate(focused) == SHUTS
    keys.press("/")
    keys.type("ward")
    assert shown(opened) == [WARD]


def test_a_link_to_a_run_opens_it(open_page: Opener, report: Path) -> None:
    opened = open_page(report, where=f"#{WARD}")
    assert opened.page.locator(f"[id='{WARD}']").get_attribute("open") is not None
    opened.until(f"document.activeElement.closest('.run')?.id === '{WARD}'")
    opened.page.locator(".history summary").click()
    opened.page.locator(f".history a[href='#{SLOW}']").click()
    opened.until(f"document.activeElement.closest('.run')?.id === '{SLOW}'")


@pytest.mark.parametrize(("dark", "size"), [(False, (1280, 800)), (True, (1280, 800)), (False, (390, 840))])
def test_report_is_accessible_and_fits_the_screen(
    open_page: Opener, report: Path, axe: str, dark: bool, size: tuple[int, int]
) -> None:
    opened = open_page(report, dark=dark, size=size)
    opened.page.evaluate("document.querySelectorAll('details').forEach(one => one.open = true)")
    assert opened.grave_findings(axe) == []
    assert opened.page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_names_from_scenarios_are_escaped(open_page: Opener, report: Path) -> None:
    opened = open_page(report)
    assert opened.page.title().startswith("simscen: ")
    assert opened.page.locator("script").count() == 1
    assert "<script>document.title" in opened.page.locator("#runs").inner_text()


def test_page_of_a_running_session_reloads_until_it_ends(open_page: Opener, report: Path, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    answers = [run("a/first"), run("a/second", left=-0.1)]
    page.write_text(to_html(SessionReport(answers[:1], live=RunningSession(2, (answers[1].key,)))), encoding="utf-8")
    opened = open_page(page)
    assert "1 of 2 runs done, running: a/second, seed 1" in opened.page.locator("#live").inner_text()
    page.write_text(to_html(SessionReport(answers)), encoding="utf-8")
    opened.page.locator(".run").nth(1).wait_for(state="attached")
    assert opened.page.locator("#live").count() == 0


def test_page_is_readable_without_javascript(browser: object, report: Path) -> None:
    context = browser.new_context(java_script_enabled=False)  # type: ignore[attr-defined]
    page = context.new_page()
    page.goto(report.as_uri())
    assert page.locator("#controls").is_hidden()
    assert page.locator(f"[id='{SHUTS}'] .why").is_visible()
    context.close()


@pytest.mark.slow
def test_report_of_two_thousand_runs_is_usable(open_page: Opener, tmp_path: Path) -> None:
    answers = [run(f"many/{k // 20}", k % 20 + 1, 0.01 * (k % 97) - 0.02, k % 60) for k in range(2000)]
    page = tmp_path / "report.html"
    page.write_text(to_html(SessionReport(answers)), encoding="utf-8")
    assert page.stat().st_size < 8 * 2**20
    opened = open_page(page)
    opened.page.locator("[name=find]").fill("many/77")
    assert len(shown(opened)) == 20
    opened.page.locator("#all").evaluate("button => button.click()")
    opened.page.locator("[name=order]").select_option("margin")
    assert len(shown(opened)) == 2000
