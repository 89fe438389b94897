"""Signals of a run that criteria compare: what each measures, how it is read from a trace, how it is sampled."""
