"""The recorder's side of a live view: rows and events to whoever looks, never waited for."""
