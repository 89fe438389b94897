"""Navigation benchmarks: generated worlds, experiments, and their scores."""
