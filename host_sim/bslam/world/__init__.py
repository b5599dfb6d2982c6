"""The true world: an arena, a robot that drives in it, and what its wheels and its sensor say about it.

`scenario` reads a TOML file, `simulate` turns it and a seed into a log. Inside, everything is in the arena's
own frame; a log is in the frame of the start pose. Nothing here knows the estimator.
"""
