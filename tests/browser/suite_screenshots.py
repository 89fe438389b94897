"""Take the screenshots of the report page and of runs for the docs (`make screenshots`).

Some shipped scenarios run in two sessions. In the second session, one of them is changed so that it fails.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image
from screenshots import IMAGES, ROOT, browser, save

SCENARIOS = (
    "localization/kidnapped",
    "localization/wrong_initial_estimate",
    "navigation/patrol",
    "navigation/speeds",
    "obstacles/door_closes",
    "people/person_crosses",
    "zones/keepout_lifted",
    "zones/slow_zone_begins",
)
TIMEOUT = "timeout: 150 s"
WIDE, NARROW = {"width": 1280, "height": 900}, {"width": 390, "height": 844}


def main() -> None:
    """Run the sessions, and take the screenshots."""
    with tempfile.TemporaryDirectory() as folder, browser() as chromium:
        home = Path(folder)
        _copy_scenarios(home)
        _run(home, "20260101T080000Z-1a2b")
        harder = home / "scenarios/obstacles/door_closes.scenario.yaml"
        assert TIMEOUT in harder.read_text()
        harder.write_text(harder.read_text().replace(TIMEOUT, "timeout: 30 s"))
        _run(home, "20260102T080000Z-3c4d")
        last = home / "simscen-out/20260102T080000Z-3c4d"
        for name, run in (("patrol", "navigation/patrol"), ("picture-failure", "obstacles/door_closes")):
            (picture,) = last.glob(f"runs/scenarios/{run}/seed-*/map.png")
            save(Image.open(picture).convert("RGB"), IMAGES / f"{name}.png")
        for name, size, scheme in (
            ("suite", WIDE, "light"),
            ("suite-dark", WIDE, "dark"),
            ("suite-phone", NARROW, "light"),
        ):
            _take_screenshot(chromium, last / "report.html", name, size, scheme)


def _copy_scenarios(home: Path) -> None:
    shutil.copytree(ROOT / "worlds", home / "worlds")
    for name in SCENARIOS:
        file = home / f"scenarios/{name}.scenario.yaml"
        file.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / f"scenarios/{name}.scenario.yaml", file)


def _run(home: Path, session: str) -> None:
    command = [sys.executable, "-m", "simscen", "run", "scenarios", "--out", f"simscen-out/{session}"]
    subprocess.run(command, cwd=home, check=False, stdout=subprocess.DEVNULL)


def _take_screenshot(chromium: Any, page: Path, name: str, size: dict[str, int], scheme: str) -> None:
    context = chromium.new_context(viewport=size, color_scheme=scheme)
    tab = context.new_page()
    tab.goto(page.as_uri())
    tab.locator(".history").evaluate("element => element.open = true")
    save(tab.screenshot(), IMAGES / f"{name}.png")
    context.close()


if __name__ == "__main__":
    main()
