"""What the adapter knows about Nav2: its nodes, parameters, actions, logs, and costmap filters."""
