"""Readers of logs from npm, those that Foxglove and Lichtblick are made of, in a folder of their own."""

import fcntl
import json
import shutil
import subprocess
from collections.abc import Callable
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
def seen_by_viewers() -> Callable[[Path], dict[str, Any]]:
    """What a viewer reads of a log; skips the test where there is no Node.js, or no registry to install from."""
    node = shutil.which("node")
    if node is None or shutil.which("npm") is None:
        pytest.skip("there is no node and npm to run Foxglove's readers with")
    FOLDER.mkdir(exist_ok=True)
    with (FOLDER / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # several processes of pytest would install them at once
        stamp = FOLDER / "installed"
        if not stamp.exists() or stamp.read_text() != " ".join(PACKAGES):
            command = [*NPM, "--fetch-timeout=8000", f"--prefix={FOLDER}", *PACKAGES]
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
            if done.returncode:
                pytest.skip(f"Foxglove's readers cannot be installed: {done.stderr.strip().splitlines()[-1]}")
            stamp.write_text(" ".join(PACKAGES))
        shutil.copy(HERE / "read.mjs", FOLDER / "read.mjs")  # Node.js looks for packages beside what is run

    def read(log: Path) -> dict[str, Any]:
        done = subprocess.run([node, str(FOLDER / "read.mjs"), str(log)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        told: dict[str, Any] = json.loads(done.stdout)
        return told

    return read
