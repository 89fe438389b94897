"""Localization benchmark on generated logs, and evaluation of a localizer on recorded logs."""
