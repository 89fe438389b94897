"""DWB, a dynamic-window controller with the critics of nav2_dwb_controller."""
