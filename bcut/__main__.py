"""``python -m bcut``: the same as the command ``bcut``."""

from bcut.cli.main import main

main()
