"""Recordings of others (CSV, MAT, MCAP) turned into logs of ours by a mapping file."""
