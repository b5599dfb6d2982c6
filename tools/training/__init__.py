"""Offline training: samples in, support vector machines for the C core out."""
