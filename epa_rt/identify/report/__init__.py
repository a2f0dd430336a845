"""What an identification found, on the terminal and as a page."""
