"""map.png: the map, the truth, the belief, the plans, the obstacles, and where each criterion failed.

`compose` draws a `scene`. Nothing is imported here: pages want the palette, and no imaging library with it.
"""
