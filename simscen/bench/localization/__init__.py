"""Benchmark of localization on generated logs, and the evaluation of recorded logs."""
