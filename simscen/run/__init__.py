"""Run scenarios: prepare, assemble, simulate in lockstep, record, and judge, with one process for each run."""
