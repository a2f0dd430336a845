"""Where a gap shows, and where it comes from."""
