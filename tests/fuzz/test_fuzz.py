"""Short version of `make fuzz`: any file is accepted or refused with a message."""

import subprocess
import sys
from pathlib import Path


def test_damaged_files_are_accepted_or_refused_by_every_loader() -> None:
    command = [sys.executable, Path(__file__).with_name("fuzz.py"), "--mutants", "60", "--seed", "7", "--jobs", "1"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
