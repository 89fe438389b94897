"""Apply the faults of a scenario to the readings, commands, beliefs, and map of a run."""
