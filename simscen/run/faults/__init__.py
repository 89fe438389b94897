"""Application of a scenario's faults to the readings, commands, beliefs, and map of a run."""
