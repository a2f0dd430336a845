"""Logs and trials that no fit has seen: set aside, and how far the gap shrinks on them."""
