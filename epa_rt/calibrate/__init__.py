"""Calibration of a reading: points, line, uncertainty, what speaks against them, the page."""
