"""Why a run failed: the cause before the symptom, from the trace and the case alone."""
