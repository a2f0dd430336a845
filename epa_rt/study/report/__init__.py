"""What a study found, as pictures and a page."""
