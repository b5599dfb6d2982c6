"""SLAM algorithms to compare: what each must offer (`protocol`), and those that come with bslam.

None of them can see the truth: a part of its own that knows the log's terms and the core, not the world.
"""

from bslam.algorithms.protocol import Account, Algorithm, Gyroscopic, Landmark, Setup, Sighting

__all__ = ["Account", "Algorithm", "Gyroscopic", "Landmark", "Setup", "Sighting"]
