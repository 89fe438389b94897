"""Navigation benchmarks: worlds, experiments, and the scores of the results."""
