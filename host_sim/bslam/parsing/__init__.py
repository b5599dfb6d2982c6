"""Strict reading of text files: whatever is wrong in one is an error that names the place."""
