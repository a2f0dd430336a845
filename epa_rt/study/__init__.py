"""Studies of the paper on the plant's own blocks: serial actuator, knee, arrangements, and the
grids they run on.
"""
