"""Short run with events, a fault, and a failed criterion, for tests of pages."""

from pathlib import Path

SCENARIO = """\
simscen: 1
name: many features
# a comment
world:
  simscen: 1
  name: hall
  walls: [{name: outer wall, points: [[0, 0], [9, 0], [9, 5], [0, 5], [0, 0]]}]
  obstacles: [{name: rack, box: [1.5, 0.6, 1], pose: {x: 4.5, y: 4}}]
  regions: {lane: [[3, 0], [6, 0], [6, 3], [3, 3]]}
robot: {pose: {x: 1, y: 2}}
stack: {speed_zones: [{region: lane, speed_limit: 0.3 m/s}]}
goals:
  - {name: shelf, pose: {x: 6.5, y: 2.2}}
events:
  - name: pallet falls
    when: {time: 3 s}
    do:
      - spawn: {name: pallet, box: [0.5, 0.6, 0.5], pose: {x: 4.5, y: 1.0}}
      - mark: {name: bang}
  - name: pedestrian walks by
    when: {time: 1 s}
    do: {pedestrian: {name: anna, pose: {x: 7.5, y: 4.5, yaw: 180 deg}, goals: [[2, 4.6]]}}
faults:
  - {sensor: lidar, noise: {std: 0.05 m}, when: {time: 4 s}, for: 2 s}
pass:
  - goals_reached: {}
  - clearance: {min: 0.9 m}
  - {speed: {max: 0.2 m/s}, severity: warn}
  - localization_error: {max: 0.5 m}
"""


def record_drive(folder: Path, seed: int = 1) -> Path:
    """Run the scenario, and return its log."""
    from simscen.loading.scenario import load_scenario
    from simscen.run.preparation import prepare
    from simscen.run.simulate import simulate

    folder.mkdir(parents=True, exist_ok=True)
    file, log = folder / "everything.scenario.yaml", folder / "run.mcap"
    file.write_text(SCENARIO)
    simulate(prepare(load_scenario(file, folder)), seed, log=log)
    return log
