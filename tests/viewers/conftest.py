"""Fixture that reads logs with the npm packages that Foxglove and Lichtblick use."""

import fcntl
import json
import shutil
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
FOLDER = HERE.parents[1] / ".viewers"
PACKAGES = [
    "@mcap/core@2.2.2",
    "@mcap/support@1.1.0",
    "@foxglove/rosmsg@5.0.5",
    "@foxglove/rosmsg2-serialization@3.1.0",
]
NPM = ["npm", "install", "--no-audit", "--no-fund", "--no-save", "--ignore-scripts", "--fetch-retries=0"]


@pytest.fixture(scope="session")
def read_in_viewer() -> Callable[[Path], dict[str, Any]]:
    """Return a function that reads a log like a viewer; skip the test without Node.js or the npm registry."""
    node = shutil.which("node")
    if node is None or shutil.which("npm") is None:
        pytest.skip("there is no node and npm to run Foxglove's readers with")
    FOLDER.mkdir(exist_ok=True)
    with (FOLDER / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # other pytest workers install them too
        stamp = FOLDER / "installed"
        if not stamp.exists() or stamp.read_text() != " ".join(PACKAGES):
            command = [*NPM, "--fetch-timeout=8000", f"--prefix={FOLDER}", *PACKAGES]
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
            if done.returncode:
                pytest.skip(f"Foxglove's readers cannot be installed: {done.stderr.strip().splitlines()[-1]}")
            stamp.write_text(" ".join(PACKAGES))
        shutil.copy(HERE / "read.mjs", FOLDER / "read.mjs")  # Node.js looks for packages in the folder of the script

    @cache
    def read(log: Path) -> dict[str, Any]:
        done = subprocess.run([node, str(FOLDER / "read.mjs"), str(log)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        content: dict[str, Any] = json.loads(done.stdout)
        return content

    return read
