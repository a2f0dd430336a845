"""What is wrong with logs, found before anything is fitted to them."""
