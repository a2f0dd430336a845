"""The rigs that can be diagnosed, of this house and of others, and their logs as columns."""
