"""bslam beside other people's programs: the same drives, timed and counted; tools/bench/bench.py runs it."""
