"""Where a gap comes from that no effect explains: the quantities of a rig's chain, each with an
error that no law makes.
"""
