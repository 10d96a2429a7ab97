"""``python -m contactlib``: the command ``contactlib``."""

from contactlib.cli.entry import main

if __name__ == "__main__":
    main()
