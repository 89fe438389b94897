"""MPPI (model predictive path integral control) with the critics of nav2_mppi_controller."""
