"""Recorded drive past a crate with perfect scans and 10 % wheel slip, and the map of the room."""

import math
from pathlib import Path

import numpy as np

BOXES = np.array([
    (-0.1, -0.1, 6.1, 0.0), (-0.1, 4.0, 6.1, 4.1), (-0.1, 0.0, 0.0, 4.0), (6.0, 0.0, 6.1, 4.0), (1.2, 1.8, 2.0, 2.8),
    (4.5, 0.0, 5.2, 0.4),
])  # fmt: skip
"""Walls and crates: minimum x and y, maximum x and y, in m."""
ANGLES = -math.pi / 2 + math.pi / 180 * np.arange(181)


def ranges_at(x: float, y: float, yaw: float, angles: np.ndarray = ANGLES) -> list[float]:
    """Return the exact ranges in m at a lidar pose, computed with the slab method."""
    with np.errstate(divide="ignore"):
        inverse = 1 / np.column_stack((np.cos(yaw + angles), np.sin(yaw + angles)))
    ranges = np.full(len(angles), 20.0)
    for min_x, min_y, max_x, max_y in BOXES:
        to_min, to_max = ((np.array(corner) - (x, y)) * inverse for corner in ((min_x, min_y), (max_x, max_y)))
        entry, exit_ = np.minimum(to_min, to_max).max(axis=1), np.maximum(to_min, to_max).min(axis=1)
        ranges = np.where((entry <= exit_) & (entry > 0), np.minimum(ranges, entry), ranges)
    return ranges.round(3).tolist()


def write_map(folder: Path) -> None:
    """Write the map of the room with a resolution of 5 cm."""
    center = 0.025 + 0.05 * np.arange(128) - 0.2
    x, y = np.meshgrid(center, center[:88])
    solid = sum((x + 0.02 > b[0]) & (x - 0.02 < b[2]) & (y + 0.02 > b[1]) & (y - 0.02 < b[3]) for b in BOXES)
    pixels = np.where(np.asarray(solid) > 0, 0, 254).astype(np.uint8)[::-1]
    (folder / "room.pgm").write_bytes(b"P5 128 88 255\n" + pixels.tobytes())
    metadata = "resolution: 0.05\norigin: [-0.2, -0.2, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    (folder / "room.yaml").write_text("image: room.pgm\n" + metadata)


def drive() -> list[tuple[float, tuple[float, float, float], tuple[float, float, float]]]:
    """Return rows of time, true pose, and odometry with 10 % slip, at 0.3 m/s past the crate and 10 Hz."""
    rows, x, y, yaw, odom = [], 1.0, 0.8, 0.0, [0.0, 0.0, 0.0]
    for k in range(150):
        rows.append((k / 10, (x, y, yaw), (odom[0], odom[1], odom[2])))
        turn = 0.05 if 50 <= k < 81 else 0.0
        x, y = x + 0.03 * math.cos(yaw + turn / 2), y + 0.03 * math.sin(yaw + turn / 2)
        odom[0] += 0.033 * math.cos(odom[2] + turn / 2)
        odom[1] += 0.033 * math.sin(odom[2] + turn / 2)
        yaw, odom[2] = yaw + turn, odom[2] + turn
    return rows


def write_csv(folder: Path, pose_rows: bool = True) -> None:
    """Write the drive as CSV rows of odometry, scans, and, with `pose_rows`, true poses."""
    lines = ["# a drive"]
    for t, true, odom in drive():
        lines.append("odom," + ",".join(map(str, (t, *odom))))
        lines.append("scan," + ",".join(map(str, (t, -math.pi / 2, math.pi / 180, 0.05, 15, *ranges_at(*true)))))
        if pose_rows:
            lines.append("truth," + ",".join(map(str, (t, *true))))
    (folder / "drive.csv").write_text("\n".join(lines) + "\n")


def write_carmen(folder: Path, kind: str) -> None:
    """Write the drive as a CARMEN log with FLASER or ROBOTLASER1 lines, as `kind` says, and TRUEPOS lines."""
    lines = ["# CARMEN Logfile"]
    for t, true, odom in drive():
        ranges, odometry = " ".join(map(str, ranges_at(*true))), " ".join(map(str, odom))
        ending = f"{t} host {t}"
        if kind == "FLASER":
            lines.append(f"FLASER 181 {ranges} {odometry} {odometry} {ending}")
        else:
            head = f"ROBOTLASER1 0 {-math.pi / 2} {math.pi} {math.pi / 180} 15 0.01 0 181"
            lines.append(f"{head} {ranges} 0 {odometry} {odometry} 0 0 0.3 0.3 0 {ending}")
        lines.append(f"TRUEPOS {' '.join(map(str, true))} {odometry} {ending}")
    (folder / "drive.log").write_text("\n".join(lines) + "\n")
