"""Fixtures for pages in a real browser: Chromium, Playwright, and axe-core from npm.

Without Chromium, the tests are skipped; in CI with root rights, it is installed.
"""

import fcntl
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from browser_tab import BrowserTab, Pages, TabOpener
from editor_page import TEXT, Edit, settle

from simscen.cli.session.backends import backend_of
from simscen.editor.document import EditedFile
from simscen.editor.server import EditorServer
from simscen.editor.session import EditorSession
from simscen.run.sessions.run_session import SessionOptions

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / ".browser"
AXE = "axe-core@4.14.1"
NAMES = ("chromium", "chromium-browser", "google-chrome-stable", "google-chrome")
POLL_INTERVAL_S = 0.02
"""Maximum time in s until an editor server notices `shutdown`."""
NPM = ["npm", "install", "--no-audit", "--no-fund", "--no-save", "--ignore-scripts", "--fetch-retries=0"]


@pytest.fixture(scope="session")
def chromium() -> str:
    """Return the path of Chromium; skip the test if there is none."""
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None and os.environ.get("CI") == "true" and os.geteuid() == 0 and shutil.which("apt-get"):
        with _InstallationLock():
            if shutil.which(NAMES[0]) is None:
                apt = ["apt-get", "-o", "DPkg::Lock::Timeout=120"]
                subprocess.run([*apt, "update"], check=False, capture_output=True, timeout=120)
                install = [*apt, "install", "--yes", "--no-install-recommends", "chromium"]
                installation = subprocess.run(install, check=False, capture_output=True, text=True, timeout=300)
                if installation.returncode:
                    pytest.skip(f"Chromium cannot be installed: {_last_line(installation.stderr)}")
        program = shutil.which(NAMES[0])
    if program is None:
        pytest.skip(f"there is no browser: none of {', '.join(NAMES)} is on the PATH")
    return program


@pytest.fixture(scope="session")
def browser(chromium: str) -> Iterator[Any]:
    """Start one browser for all tests of this pytest process."""
    playwright_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright_api.sync_playwright() as playwright:
        arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
        chromium_browser = playwright.chromium.launch(executable_path=chromium, args=arguments)
        yield chromium_browser
        chromium_browser.close()


@pytest.fixture(scope="session")
def pages(browser: Any) -> Pages:
    """Return the blank pages of the browser."""
    return Pages(browser)


@pytest.fixture
def open_tab(pages: Pages) -> Iterator[TabOpener]:
    """Return a function that opens files in tabs; at the end, check for logged errors and requests of other files."""
    tabs: list[BrowserTab] = []

    def open_tab(
        file: Path | str, *, size: tuple[int, int] = (1280, 800), dark: bool = False, fragment: str = ""
    ) -> BrowserTab:
        tabs.append(BrowserTab(pages, file, size, dark, fragment))
        return tabs[-1]

    yield open_tab
    complaints = [complaint for tab in tabs for complaint in tab.close()]
    assert complaints == []


@pytest.fixture(scope="session")
def axe() -> str:
    """Return the script of axe-core."""
    if shutil.which("npm") is None:
        pytest.skip("there is no npm to install axe-core with")
    script = FOLDER / "node_modules" / "axe-core" / "axe.min.js"
    with _InstallationLock():
        stamp = FOLDER / "installed"
        if not stamp.exists() or stamp.read_text() != AXE:
            command = [*NPM, "--fetch-timeout=8000", f"--prefix={FOLDER}", AXE]
            installation = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
            if installation.returncode:
                pytest.skip(f"{AXE} cannot be installed: {_last_line(installation.stderr)}")
            stamp.write_text(AXE)
    return script.read_text(encoding="utf-8")


def _last_line(text: str) -> str:
    return (text.strip().splitlines() or ["?"])[-1]


class _InstallationLock:
    """Lock against installations by other pytest processes."""

    def __enter__(self) -> None:
        FOLDER.mkdir(exist_ok=True)
        self._file = (FOLDER / ".lock").open("w")
        fcntl.flock(self._file, fcntl.LOCK_EX)

    def __exit__(self, *_: object) -> None:
        self._file.close()


@pytest.fixture
def edit(open_tab: TabOpener, tmp_path: Path) -> Iterator[Edit]:
    """Return a function that opens a file in the editor, in a new tab."""
    servers: list[EditorServer] = []

    def open_file(file: Path, kind: str = "scenario", root: Path | None = None, **options: Any) -> BrowserTab:
        session = EditorSession(EditedFile(file, kind, root or file.parent), lambda: backend_of(SessionOptions()))
        server = EditorServer(session)
        servers.append(server)
        threading.Thread(target=server.serve_forever, args=(POLL_INTERVAL_S,), daemon=True).start()
        tab = open_tab(server.url, **options)
        tab.until("document.documentElement.dataset.ready !== undefined")
        settle(tab)
        return tab

    yield open_file
    for server in servers:
        server.shutdown()
        server.server_close()
        server.stop_runs()


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    """Return the file of the scenario TEXT."""
    file = tmp_path / "hall.scenario.yaml"
    file.write_text(TEXT)
    return file
