"""Make a folder with a real Nav2 for tests/nav2, or say in one line why there is none.

    python tests/nav2/rig.py .nav2

An installed ROS 2 with Nav2 is used as it is: a sourced one (AMENT_PREFIX_PATH), or one in /opt/ros. Otherwise, if
SIMSCEN_NAV2_SOURCES names a folder with the sources, build.sh builds Nav2 from them. `rig.json` in the folder describes
the result: `env`, a script to source, which defines `node PACKAGE EXECUTABLE`; `params`, nav2_bringup's parameter file;
`python`, a Python with rclpy. The folder is kept between calls. The exit code is 1 if there is no Nav2.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

BUILD = Path(__file__).with_name("build.sh")
RECIPE = (BUILD, BUILD.with_name("cmake.sh"))
SOURCES = "SIMSCEN_NAV2_SOURCES"
LAST_PACKAGE = "nav2_bt_navigator"


class Unavailable(Exception):
    """The reason why there is no Nav2 on this machine."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    try:
        description = find_installed(folder) or build(folder)
    except Unavailable as reason:
        (folder / "rig.json").unlink(missing_ok=True)
        print(f"Nav2: tests/nav2 are skipped: {reason}")
        return 1
    (folder / "rig.json").write_text(json.dumps(description, indent=2) + "\n")
    print(f"Nav2: {description['distribution']}, {description['origin']}")
    return 0


def find_installed(folder: Path) -> dict | None:
    """Return the description of an installed Nav2, or None; write its script env.sh to `folder`."""
    for prefix in prefixes():
        params = prefix / "share/nav2_bringup/params/nav2_params.yaml"
        setup = prefix / "setup.bash"
        if setup.is_file() and params.is_file() and (prefix / "share" / LAST_PACKAGE).is_dir():
            env = folder / "env.sh"
            env.write_text(f'source {setup}\nnode() {{ exec "{prefix}/lib/$1/$2" "${{@:3}}"; }}\n')
            names = {"distribution": prefix.name, "origin": f"installed in {prefix}"}
            return {**names, "env": str(env), "params": str(params), "python": "/usr/bin/python3"}
    return None


def prefixes() -> Iterator[Path]:
    for entry in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry)
    yield from sorted(Path("/opt/ros").glob("*"), reverse=True)


def build(folder: Path) -> dict:
    """Build Nav2 from source, unless an up-to-date build exists, and return its description."""
    env, stamp = folder / "env.sh", folder / "recipe"
    recipe = hashlib.sha256(b"".join(file.read_bytes() for file in RECIPE)).hexdigest()[:16]
    if not (env.is_file() and stamp.is_file() and stamp.read_text() == recipe):
        sources = os.environ.get(SOURCES)
        if not sources:
            raise Unavailable(f"no Nav2 is installed in /opt/ros, and {SOURCES} names no folder with sources")
        started = time.monotonic()
        print(f"Nav2: building from {sources} into {folder} ...", flush=True)
        if subprocess.run(["bash", str(BUILD), str(folder), sources], check=False).returncode:
            raise Unavailable("the build failed")
        stamp.write_text(recipe)
        print(f"Nav2: built in {time.monotonic() - started:.0f} s, {size_gb(folder):.1f} GB", flush=True)
    names = {"distribution": "jazzy", "origin": f"built from source in {folder}"}
    python = str(folder / "venv/bin/python")
    return {**names, "env": str(env), "params": str(folder / "nav2_params.yaml"), "python": python}


def size_gb(folder: Path) -> float:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and not path.is_symlink()) / 1e9


if __name__ == "__main__":
    sys.exit(main())
