"""Views of a run that is on: a terminal, and Foxglove's WebSocket; processes of their own."""
