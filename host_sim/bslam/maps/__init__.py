"""Kept maps on the host: bytes, text, and two maps of one place made one. docs/MAP.md has every byte."""
