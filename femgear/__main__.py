"""``python -m femgear``: the command line."""

import sys

from femgear.cli import main

if __name__ == "__main__":
    sys.exit(main())
