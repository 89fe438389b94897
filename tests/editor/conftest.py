"""yaml-language-server from its npm package, in a folder of its own, as editors run it."""

import fcntl
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from languageserver import LanguageServer

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / ".yaml-language-server"
PACKAGE = "yaml-language-server@1.19.2"
"""The newest that runs on every Node.js that is still supported."""
NPM = ["npm", "install", "--no-audit", "--no-fund", "--no-save", "--ignore-scripts", "--fetch-retries=0"]


@pytest.fixture(scope="session")
def server() -> Iterator[LanguageServer]:
    """Skips the test where there is no Node.js, or no registry to install it from."""
    node = shutil.which("node")
    if node is None or shutil.which("npm") is None:
        pytest.skip("there is no node and npm to run yaml-language-server with")
    program = FOLDER / "node_modules" / "yaml-language-server" / "bin" / "yaml-language-server"
    FOLDER.mkdir(exist_ok=True)
    with (FOLDER / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # several processes of pytest would install it at once
        stamp = FOLDER / "installed"
        if not stamp.exists() or stamp.read_text() != PACKAGE:
            command = [*NPM, "--fetch-timeout=8000", f"--prefix={FOLDER}", PACKAGE]
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
            if done.returncode:
                pytest.skip(f"{PACKAGE} cannot be installed: {done.stderr.strip().splitlines()[-1]}")
            stamp.write_text(PACKAGE)
    running = LanguageServer([node, str(program), "--stdio"], ROOT)
    yield running
    running.close()
