"""Real logs and pictures, read into the project's own log."""
