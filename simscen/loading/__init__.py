"""From text to a validated scenario, or to a list of problems that say where and how to mend."""
