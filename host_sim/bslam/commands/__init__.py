"""The commands of `bslam`, one module each.

A module has SUMMARY, EXAMPLES, add_arguments(parser) and execute(arguments) -> exit status.
"""
