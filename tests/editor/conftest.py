"""Fixture that installs yaml-language-server from npm in a separate folder and starts it, as editors do."""

import fcntl
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from language_server import LanguageServer

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / ".yaml-language-server"
PACKAGE = "yaml-language-server@1.19.2"
"""Newest version that runs on each supported Node.js."""
NPM = ["npm", "install", "--no-audit", "--no-fund", "--no-save", "--ignore-scripts", "--fetch-retries=0"]


@pytest.fixture(scope="session")
def server() -> Iterator[LanguageServer]:
    """Yield a running server; skip the test without Node.js or without a connection to npm."""
    node = shutil.which("node")
    if node is None or shutil.which("npm") is None:
        pytest.skip("there is no node and npm to run yaml-language-server with")
    program = FOLDER / "node_modules" / "yaml-language-server" / "bin" / "yaml-language-server"
    FOLDER.mkdir(exist_ok=True)
    with (FOLDER / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # other pytest processes install it, too
        stamp = FOLDER / "installed"
        if not stamp.exists() or stamp.read_text() != PACKAGE:
            command = [*NPM, "--fetch-timeout=8000", f"--prefix={FOLDER}", PACKAGE]
            installation = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
            if installation.returncode:
                pytest.skip(f"{PACKAGE} cannot be installed: {installation.stderr.strip().splitlines()[-1]}")
            stamp.write_text(PACKAGE)
    language_server = LanguageServer([node, str(program), "--stdio"], ROOT)
    yield language_server
    language_server.close()
