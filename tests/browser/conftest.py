"""Pages in a real browser: Chromium, driven by Playwright, with axe-core from npm.

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
from editor_page import TEXT, Edit, settle
from rig import Opened, Opener, Pages

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
"""Time until a server of the editor notices that it is shut down."""
NPM = ["npm", "install", "--no-audit", "--no-fund", "--no-save", "--ignore-scripts", "--fetch-retries=0"]


@pytest.fixture(scope="session")
def chromium() -> str:
    """Return the path of Chromium; skip the test if there is none."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None and os.environ.get("CI") == "true" and os.geteuid() == 0 and shutil.which("apt-get"):
        with _locked():
            if shutil.which(NAMES[0]) is None:
                apt = ["apt-get", "-o", "DPkg::Lock::Timeout=120"]
                subprocess.run([*apt, "update"], check=False, capture_output=True, timeout=120)
                install = [*apt, "install", "--yes", "--no-install-recommends", "chromium"]
                done = subprocess.run(install, check=False, capture_output=True, text=True, timeout=300)
                if done.returncode:
                    pytest.skip(f"Chromium cannot be installed: {(done.stderr.strip().splitlines() or ['?'])[-1]}")
        found = shutil.which(NAMES[0])
    if found is None:
        pytest.skip(f"there is no browser: none of {', '.join(NAMES)} is on the PATH")
    return found


@pytest.fixture(scope="session")
def browser(chromium: str) -> Iterator[Any]:
    """Start one browser for all tests of this pytest process."""
    driver = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with driver.sync_playwright() as playwright:
        arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
        running = playwright.chromium.launch(executable_path=chromium, args=arguments)
        yield running
        running.close()


@pytest.fixture(scope="session")
def pages(browser: Any) -> Pages:
    """Return the blank pages of the browser."""
    return Pages(browser)


@pytest.fixture
def open_page(pages: Pages) -> Iterator[Opener]:
    """Return a function that opens files; at the end, check for logged errors and requests of other files."""
    opened: list[Opened] = []

    def open_(file: Path | str, *, size: tuple[int, int] = (1280, 800), dark: bool = False, where: str = "") -> Opened:
        opened.append(Opened(pages, file, size, dark, where))
        return opened[-1]

    yield open_
    complaints = [complaint for one in opened for complaint in one.close()]
    assert complaints == []


@pytest.fixture(scope="session")
def axe() -> str:
    """Return the script of axe-core."""
    if shutil.which("npm") is None:
        pytest.skip("there is no npm to install axe-core with")
    script = FOLDER / "node_modules" / "axe-core" / "axe.min.js"
    with _locked():
        stamp = FOLDER / "installed"
        if not stamp.exists() or stamp.read_text() != AXE:
            command = [*NPM, "--fetch-timeout=8000", f"--prefix={FOLDER}", AXE]
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
            if done.returncode:
                pytest.skip(f"{AXE} cannot be installed: {(done.stderr.strip().splitlines() or ['?'])[-1]}")
            stamp.write_text(AXE)
    return script.read_text(encoding="utf-8")


class _locked:
    """Lock against installations by other pytest processes."""

    def __enter__(self) -> None:
        FOLDER.mkdir(exist_ok=True)
        self._file = (FOLDER / ".lock").open("w")
        fcntl.flock(self._file, fcntl.LOCK_EX)

    def __exit__(self, *_: object) -> None:
        self._file.close()


@pytest.fixture
def edit(open_page: Opener, tmp_path: Path) -> Iterator[Edit]:
    """Return a function that opens a file in the editor."""
    servers: list[EditorServer] = []

    def open_(file: Path, kind: str = "scenario", root: Path | None = None, **given: Any) -> Opened:
        session = EditorSession(EditedFile(file, kind, root or file.parent), lambda: backend_of(SessionOptions()))
        server = EditorServer(session)
        servers.append(server)
        threading.Thread(target=server.serve_forever, args=(POLL_INTERVAL_S,), daemon=True).start()
        opened = open_page(server.url, **given)
        opened.until("document.documentElement.dataset.ready !== undefined")
        settle(opened)
        return opened

    yield open_
    for server in servers:
        server.shutdown()
        server.server_close()
        server.stop_runs()


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    file = tmp_path / "hall.scenario.yaml"
    file.write_text(TEXT)
    return file
