"""Where a simulated rig and a real one disagree, which unmodelled effect causes it, and how far it
shrinks with it.
"""
