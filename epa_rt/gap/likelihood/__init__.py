"""What sets of effects leave of the logs: noise, residuals, fits, by block and in free run."""
