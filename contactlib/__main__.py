"""``python -m contactlib``: the command ``contactlib``."""

from contactlib.cli.commands import main

if __name__ == "__main__":
    main()
