"""Pass criteria: their specifications, and how they judge the trace of a run."""
