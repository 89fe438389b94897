"""Reader of simscen's own logs: from an MCAP file to the trace of its run."""
