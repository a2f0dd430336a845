"""The experiment that would tell apart what these logs cannot."""
