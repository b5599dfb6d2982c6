"""Experiments: feed a log to the core, measure the result, write it down.

`datasets`, `mrclam` load logs; `runner` feeds one; `metrics` measures; `output` writes; `batch` does many in
parallel.
"""
