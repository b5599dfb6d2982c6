"""Pictures of runs, as matplotlib figures and PNG, from plain arrays: of the package it knows logs only."""
