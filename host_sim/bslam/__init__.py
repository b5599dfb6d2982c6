"""bslam: SLAM with beacons that fits in a microcontroller, and the harness that simulates and judges it.

Data flows one way: `world` or a recorded log -> `log.Log` -> `runs` (feeds `core`, measures) -> files
-> `view`.
"""
