"""`python -m bslam` is the same as the command `bslam`."""

import sys

from bslam.cli import main

if __name__ == "__main__":
    sys.exit(main())
