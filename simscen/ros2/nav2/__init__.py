"""Parts of the adapter that are specific to Nav2: its nodes, parameters, actions, logs, and costmap filters."""
