"""Runs all estimators on a recorded drive. Estimators find faults, objects, pedestrians, kidnappings, and incidents."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Pose2
from simscen.reconstruction.compared_scans import compare_scans
from simscen.reconstruction.drive.gaps import pose_gaps, recording_gaps, scans_with_pose
from simscen.reconstruction.drive.motion_steps import motion_steps
from simscen.reconstruction.drive.recorded_drive import RecordedDrive
from simscen.reconstruction.faults.commands import command_faults
from simscen.reconstruction.faults.false_returns import false_return_faults, glass_fault
from simscen.reconstruction.faults.lidar_calibration import (
    mount_error,
    mount_fault,
    range_error_faults,
    with_corrected_mount,
)
from simscen.reconstruction.faults.lidar_readings import (
    invalid_scan_faults,
    missing_beam_faults,
    noise_faults,
    range_faults,
)
from simscen.reconstruction.faults.localizer import localizer_faults
from simscen.reconstruction.faults.message_stream import stream_faults, stuck_scans
from simscen.reconstruction.faults.odometry import gyroscope_faults, odometry_faults
from simscen.reconstruction.objects.clusters import usable_scans
from simscen.reconstruction.objects.find_objects import find_objects
from simscen.reconstruction.objects.found_object import FoundObject
from simscen.reconstruction.objects.pedestrian_trial import PedestrianTrial
from simscen.reconstruction.objects.pedestrians import fit_pedestrians
from simscen.reconstruction.reasons import FoundFault, Reason
from simscen.reconstruction.scenario.contents import EstimatedParts
from simscen.reconstruction.scenario.incidents import find_incidents
from simscen.reconstruction.scenario.robot_file import TYPICAL_ROBOT, RobotProperties
from simscen.reconstruction.static_world import StaticWorld
from simscen.run.live_world.pedestrians import PedestrianMap

MAX_SCANS = 3000
"""Maximum number of scans that are compared with the world. In longer drives, every second, third, … scan is used."""
MIN_SCANS = 3
"""Minimum number of scans from which objects and faults of the lidar are estimated."""
SENSORS = ("lidar", "odom", "imu")
"""Names of sensors in the faults that the estimators return. The names in the robot file can differ."""
NEVER_ESTIMATED = "doors that open or close, pushes, slippery floor, and changes of the payload; add them by hand"
"""Disturbances that no estimator looks for, as the end of the sentence "The log does not show …"."""
MIN_KIDNAP_M, MAX_KIDNAP_S = 0.5, 0.3
"""Minimum distance and maximum duration of a jump of the true pose that counts as a kidnapping.

The distance that the robot drives in this time, at its speed before or after the jump, is subtracted first."""


def run_estimators(
    drive: RecordedDrive,
    world: StaticWorld,
    robot: RobotProperties = TYPICAL_ROBOT,
    other_robots: Sequence[FoundObject] = (),
    is_map_built: bool = False,
) -> EstimatedParts:
    """Return all parts of a scenario that the estimators find in a drive.

    drive:         recorded drive
    world:         walls and known obstacles
    robot:         properties of the robot
    other_robots:  other robots in the log, which become objects of the scenario. Scan hits on these robots are not
        reported as additional objects.
    is_map_built:  whether the walls of `world` were built from the scans of this drive
    """
    unknowns = [NEVER_ESTIMATED, *_unknown_times(drive)]
    is_calibrated = drive.has_true_poses and not is_map_built
    faults, objects = _faults_and_objects_of_scans(drive, world, robot, other_robots, unknowns, is_calibrated)
    kidnaps, gaps = list(_find_kidnaps(drive)), recording_gaps(drive)
    for target, signal in (("odom", drive.odometry), ("imu", drive.turn_rates)):
        faults += stream_faults(target, signal.times, signal.arrivals, drive.duration, gaps)
    if drive.has_true_poses:
        faults += odometry_faults(motion_steps(drive), robot.wheel_separation, robot.skids)
        if not kidnaps:
            faults += gyroscope_faults(drive)
    else:
        unknowns.append("errors of odometry, gyroscope, and mount of the lidar, which need a ground truth (--truth)")
    if drive.has_true_poses and not is_calibrated:
        unknowns.append("errors of the ranges and of the mount of the lidar, which need a map (--map)")
    unknowns += _unknown_reactions(objects)
    faults += command_faults(drive, 0.0 if robot.skids else robot.wheel_separation)
    faults += localizer_faults(drive)
    faults = _with_sensor_names_of_robot(faults, robot, unknowns)
    return EstimatedParts(find_incidents(drive), objects, faults, kidnaps, unknowns)


def _with_sensor_names_of_robot(
    faults: list[FoundFault], robot: RobotProperties, unknowns: list[str]
) -> list[FoundFault]:
    """Return the faults with the sensor names of the robot file.

    Omit the fault of a sensor that the robot file does not have, and append a phrase about the fault to `unknowns`.
    """
    if not robot.sensors:
        return faults
    renamed_faults = []
    for fault in faults:
        if fault.target in SENSORS and fault.target not in robot.sensors:
            unknowns.append(f"where to put {fault.target}.{fault.kind}, because the robot file has no such sensor")
        else:
            renamed_faults.append(replace(fault, target=robot.sensors.get(fault.target, fault.target)))
    return renamed_faults


def _faults_and_objects_of_scans(
    drive: RecordedDrive,
    world: StaticWorld,
    robot: RobotProperties,
    other_robots: Sequence[FoundObject],
    unknowns: list[str],
    is_calibrated: bool,
) -> tuple[list[FoundFault], list[FoundObject]]:
    """Return the faults and objects that the scans show. Append phrases about missing information to `unknowns`.

    `is_calibrated` states that poses and walls are exact. Only then, errors of the mount and the ranges are estimated.
    """
    scans = drive.scans
    if scans is None or len(scans) < MIN_SCANS:
        found = "no" if scans is None else "too few"
        unknowns.append(f"objects that are not on the map, and faults of the lidar, because the log has {found} scans")
        return [], [*other_robots]
    faults = [*stream_faults("lidar", scans.times, scans.arrivals, drive.duration, recording_gaps(drive))]
    faults += stuck_scans(scans, drive.duration)
    scans = scans_with_pose(drive, scans)
    if len(scans) < MIN_SCANS:
        return faults, [*other_robots]
    if len(scans) > MAX_SCANS:
        count, step = len(scans), -(-len(scans) // MAX_SCANS)
        scans = scans.subset(slice(None, None, step))
        unknowns.append(f"details that only some scans show: one of every {step} of the {count} scans was used")
    compared = compare_scans(drive, scans, world)
    if is_calibrated:
        error = mount_error(compared, world)
        if (wrong_mount := mount_fault(error)) is not None:
            faults.append(wrong_mount)
            compared = with_corrected_mount(compared, world, error)
    faults += invalid_scan_faults(compared, drive.duration)
    faults += missing_beam_faults(compared, drive.duration)
    range_limits = [*range_faults(compared, drive.duration, robot.lidar_noise)]
    faults += range_limits
    false_returns = [*false_return_faults(compared, drive.duration)]
    faults += false_returns
    if not any(fault.kind == "rain" for fault in range_limits):
        # False returns look like a little noise, so that only larger noise is then reported.
        is_noise_known = robot.is_known and not false_returns
        faults += noise_faults(compared, drive.duration, robot.lidar_noise, is_noise_known)
    if is_calibrated:
        faults += range_error_faults(compared)
    glass = glass_fault(compared, world, usable_scans(compared))
    faults += [] if glass is None else [glass]
    objects = find_objects(compared, world, drive.has_true_poses, other_robots)
    return faults, fit_pedestrians(objects, PedestrianTrial(drive, PedestrianMap(world.built), robot.radius))


def _unknown_times(drive: RecordedDrive) -> Iterator[str]:
    """Yield a phrase for each gap in the recording and in the poses."""
    for begin, end in recording_gaps(drive):
        yield f"what happened from t = {begin:.2f} s to {end:.2f} s, when no message was recorded"
    for begin, end in pose_gaps(drive):
        yield f"where the robot was from t = {begin:.2f} s to {end:.2f} s, so that scans of this time are not used"


def _unknown_reactions(objects: Sequence[FoundObject]) -> Iterator[str]:
    """Yield phrases about reactions of objects to the robot that the log does not show."""
    if any(thing.is_moving and thing.pedestrian is None for thing in objects):
        yield "whether moving objects react to the robot; objects that are no pedestrians follow their recorded tracks"
    distant = [thing.name for thing in objects if thing.pedestrian is not None and not thing.pedestrian.meets_robot]
    if distant:
        names = ", ".join(distant)
        yield f"whether {names} would evade the robot, which was never near them; simulated pedestrians evade robots"


def _find_kidnaps(drive: RecordedDrive) -> Iterator[tuple[float, Pose2, Reason]]:
    """Yield the time in s, the new pose, and the reason of each sudden jump of the true pose."""
    if not drive.has_true_poses or len(drive.poses) < 2:
        return
    poses, times = drive.poses.values, drive.poses.times
    distances, steps = np.hypot(*np.diff(poses[:, :2], axis=0).T), np.diff(times)
    speeds = np.pad(distances / np.maximum(steps, 1e-9), 1)
    jumps = distances - steps * np.maximum(speeds[:-2], speeds[2:])
    for index in np.flatnonzero((jumps > MIN_KIDNAP_M) & (steps < MAX_KIDNAP_S)).tolist():
        text = f"the true pose jumps by {distances[index]:.2f} m"
        yield float(times[index + 1]), Pose2(*poses[index + 1].tolist()), Reason(text, float(times[index + 1]))
