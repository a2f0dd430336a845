"""A draft of a mapping: what a foreign file holds, read from names, units, sizes and motion."""
