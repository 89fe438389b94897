"""The recorded drive: messages of a log as arrays, goals, and what the header of the log says about the run."""
