"""Sessions: plan many runs, execute each in a worker process, and collect the results."""
