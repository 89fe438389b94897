"""Recorded drive past a crate with perfect scans and 10 % wheel slip, and the map of the room."""

import math
from pathlib import Path

import numpy as np

BOXES = np.array([
    (-0.1, -0.1, 6.1, 0.0), (-0.1, 4.0, 6.1, 4.1), (-0.1, 0.0, 0.0, 4.0), (6.0, 0.0, 6.1, 4.0), (1.2, 1.8, 2.0, 2.8),
    (4.5, 0.0, 5.2, 0.4),
])  # fmt: skip
ANGLES = -math.pi / 2 + math.pi / 180 * np.arange(181)


def ranges_at(x: float, y: float, yaw: float, angles: np.ndarray = ANGLES) -> list[float]:
    """Return exact ranges, computed with the slab method."""
    with np.errstate(divide="ignore"):
        inverse = 1 / np.column_stack((np.cos(yaw + angles), np.sin(yaw + angles)))
    found = np.full(len(angles), 20.0)
    for left, low, right, high in BOXES:
        near, far = ((np.array(corner) - (x, y)) * inverse for corner in ((left, low), (right, high)))
        enter, leave = np.minimum(near, far).max(axis=1), np.maximum(near, far).min(axis=1)
        found = np.where((enter <= leave) & (enter > 0), np.minimum(found, enter), found)
    return found.round(3).tolist()


def write_map(folder: Path) -> None:
    """Write the map of the room with a resolution of 5 cm."""
    center = 0.025 + 0.05 * np.arange(128) - 0.2
    x, y = np.meshgrid(center, center[:88])
    solid = sum((x + 0.02 > b[0]) & (x - 0.02 < b[2]) & (y + 0.02 > b[1]) & (y - 0.02 < b[3]) for b in BOXES)
    pixels = np.where(np.asarray(solid) > 0, 0, 254).astype(np.uint8)[::-1]
    (folder / "room.pgm").write_bytes(b"P5 128 88 255\n" + pixels.tobytes())
    numbers = "resolution: 0.05\norigin: [-0.2, -0.2, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    (folder / "room.yaml").write_text("image: room.pgm\n" + numbers)


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
    """Write rows of odometry, scans, and true poses."""
    lines = ["# a drive"]
    for t, true, odom in drive():
        lines.append("odom," + ",".join(map(str, (t, *odom))))
        lines.append("scan," + ",".join(map(str, (t, -math.pi / 2, math.pi / 180, 0.05, 15, *ranges_at(*true)))))
        if pose_rows:
            lines.append("truth," + ",".join(map(str, (t, *true))))
    (folder / "drive.csv").write_text("\n".join(lines) + "\n")


def write_carmen(folder: Path, kind: str) -> None:
    """Write FLASER or ROBOTLASER1 lines with TRUEPOS lines."""
    lines = ["# CARMEN Logfile"]
    for t, true, odom in drive():
        ranges, place = " ".join(map(str, ranges_at(*true))), " ".join(map(str, odom))
        tail = f"{t} host {t}"
        if kind == "FLASER":
            lines.append(f"FLASER 181 {ranges} {place} {place} {tail}")
        else:
            head = f"ROBOTLASER1 0 {-math.pi / 2} {math.pi} {math.pi / 180} 15 0.01 0 181"
            lines.append(f"{head} {ranges} 0 {place} {place} 0 0 0.3 0.3 0 {tail}")
        lines.append(f"TRUEPOS {' '.join(map(str, true))} {place} {tail}")
    (folder / "drive.log").write_text("\n".join(lines) + "\n")
