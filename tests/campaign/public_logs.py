"""Public logs of real robots: judge each, turn each into a scenario, run it, and print a table.

`python tests/campaign/public_logs.py FOLDER [-k TEXT]` reads clones of the GitHub repositories below, in
FOLDER/OWNER/NAME. Bags of ROS 1 are converted with `rosbags-convert`. Exit code 1 if a log does not become a scenario
that runs.
"""

import argparse
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

LIMITS = """\
pass:
  - speed: {max: 1.2 m/s}
  - always: {signal: scan_age, op: "<=", value: 0.6 s}
"""
COMPROBO_24, COMPROBO_23 = "DanPark13/comprobo24_warmup_project", "a-matsoukas/CompRobo-Warmup-23"
OF_REPRODUCTION = (0, 1)
"""Exit codes of --verify for a scenario that ran, whether or not its incidents happened again."""


@dataclass(frozen=True)
class PublicLog:
    """Log of a repository; `truth` is what `judge --truth` takes, and `is_measured` whether it is a ground truth."""

    repository: str
    file: str
    robot: str
    truth: str = "odom:base_link"
    is_measured: bool = False


LOGS = (
    *(PublicLog(COMPROBO_24, f"bags/{name}", "Neato") for name in ("drive_square", "finite-state-controller")),
    PublicLog(COMPROBO_23, "warmup_project/bags/drive_square", "Neato"),
    *(
        PublicLog("ksoltan/robot_localization", f"robot_localizer/bags/{name}.bag", "Neato")
        for name in ("left_side", "middle", "right_side")
    ),
    *(
        PublicLog("mehd1k/lidardata", f"rosbags/test_{name}", "Jackal", "/vrpn_client_node/jackal/pose", True)
        for name in ("2026-02-17-15-54-31", "2026-02-19-10-53-01", "2026-02-19-11-53-31")
    ),
    PublicLog("ros-perception/slam_gmapping_test_data", "test_turtlebot.bag", "TurtleBot"),
    PublicLog("VorpalBlade/ros_mcl_performance_test", "bags/test_drive.bag", "own robot"),
)


def simscen(*words: str | Path) -> subprocess.CompletedProcess[str]:
    """Return the result of a command of simscen."""
    return subprocess.run(
        [sys.executable, "-m", "simscen", *map(str, words)], check=False, capture_output=True, text=True
    )


def row_of(log: PublicLog, file: Path, folder: Path) -> tuple[str, bool]:
    """Return the outcome of a log as a row of a table, and whether it became a scenario that runs."""
    (folder / "limits.yaml").write_text(LIMITS)
    judged = simscen("judge", file, "--scenario", folder / "limits.yaml", "--truth", log.truth)
    truth = ("--truth", log.truth) if log.is_measured else ()
    made = simscen("new", "--from-log", file, "--out", folder / "site.scenario.yaml", *truth, "--verify")
    lines = made.stdout.splitlines()
    found = next((line.removeprefix("found ") for line in lines if line.startswith("found ")), made.stderr.strip())
    from_path = next((line.split("at most")[-1].strip() for line in lines if "the log's" in line), "?")
    shown = f"| {log.repository} `{log.file}` | {log.robot} | {judged.returncode} | {found} | {from_path} |"
    return shown, made.returncode in OF_REPRODUCTION


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clones", type=Path)
    parser.add_argument("-k", default="", help="only logs whose repository or path contains this")
    options = parser.parse_args()
    print("| log | robot | exit code of judge | found | farthest from the log's path |\n|---|---|---|---|---|")
    failed = 0
    for log in LOGS:
        file = options.clones / log.repository / log.file
        if options.k not in f"{log.repository}/{log.file}":
            continue
        if not file.exists():
            print(f"not there: {file}", file=sys.stderr)
            continue
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            if file.is_file() and file.suffix == ".bag":
                subprocess.run(["rosbags-convert", "--src", file, "--dst", folder / "bag"], check=True)
                file = folder / "bag"
            row, runs = row_of(log, file, folder)
        print(row, flush=True)
        failed += not runs
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
