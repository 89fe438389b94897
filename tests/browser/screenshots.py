"""Take the screenshots of the replay page for the docs (`make screenshots`).

A shipped scenario, made harder, is run with seeds until one fails and one passes.
"""

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

from simscen.judge.result_json import from_json
from simscen.loading.scenario import load_scenario
from simscen.record.log_reader import read_run
from simscen.report.replay import write_replay
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

ROOT = Path(__file__).parents[2]
IMAGES = ROOT / "docs" / "images"
SCENARIO = ROOT / "scenarios" / "localization" / "kidnapped.scenario.yaml"
REPLACEMENTS = {"time: 120 s": "time: 12 s", "timeout: 240 s": "timeout: 60 s", "../../worlds/": "worlds/"}
SEEDS = range(2, 12)


def main() -> None:
    """Run the scenario, write the replay pages, and take their screenshots."""
    with tempfile.TemporaryDirectory() as folder, browser() as chromium:
        failed, passed = _runs(Path(folder))
        pages = {"replay-failure": [failed], "replay-against": [failed, passed]}
        for name, logs in pages.items():
            page = Path(folder) / f"{name}.html"
            logs_ = [read_run(log, with_sensors=True) for log in logs]
            write_replay(page, [(log, from_json(log.result)) for log in logs_])
            _take_screenshot(chromium, page, name, "#t=20" if len(logs) > 1 else "")


@contextmanager
def browser() -> Iterator[Any]:
    """Start Chromium."""
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if program is None:
        sys.exit("there is no Chromium to take pictures with")
    with sync_playwright() as playwright:
        arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
        chromium = playwright.chromium.launch(executable_path=program, args=arguments)
        yield chromium
        chromium.close()


def save(picture: "Image.Image | bytes", file: Path) -> None:
    """Save a picture with 256 colors, which reduces the size to a third without a visible difference."""
    image = Image.open(BytesIO(picture)) if isinstance(picture, bytes) else picture
    image.quantize(256, dither=Image.Dither.NONE).save(file, optimize=True)


def _runs(folder: Path) -> tuple[Path, Path]:
    """Return the logs of a failed and a passed run."""
    text = SCENARIO.read_text()
    for old, new in REPLACEMENTS.items():
        assert old in text, old
        text = text.replace(old, new)
    shutil.copytree(ROOT / "worlds", folder / "worlds")
    file, logs = folder / "kidnapped.scenario.yaml", dict[bool, Path]()
    file.write_text(text)
    for seed in SEEDS:
        log = folder / f"{seed}.mcap"
        logs.setdefault(simulate(prepare(load_scenario(file, folder)), seed, log=log).passed, log)
        if len(logs) == 2:
            return logs[False], logs[True]
    sys.exit(f"all of the seeds {SEEDS} passed, or all failed")


def _take_screenshot(browser: Any, page: Path, name: str, fragment: str) -> None:
    """Take a screenshot with the light theme, and of the failed run also with the dark one."""
    for scheme in ("light", "dark") if name == "replay-failure" else ("light",):
        context = browser.new_context(viewport={"width": 1280, "height": 800}, color_scheme=scheme)
        tab = context.new_page()
        tab.goto(page.as_uri() + fragment)
        tab.wait_for_selector("html[data-ready]", state="attached")
        tab.wait_for_timeout(300)
        file = IMAGES / f"{name}{'-dark' if scheme == 'dark' else ''}.png"
        save(tab.screenshot(), file)
        context.close()


if __name__ == "__main__":
    main()
