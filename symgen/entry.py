"""Where the command `symgen` begins: Ctrl-C is answered with a word while its modules are still being imported, too."""

from __future__ import annotations

import importlib
import os
import sys

_INTERRUPTED = 130  # a shell's exit status of a program that Ctrl-C ended


def main() -> None:
    """Run the command line."""
    try:
        importlib.import_module("symgen.cli").main()
    except KeyboardInterrupt:
        os.write(2, b"\ninterrupted\n")
        sys.exit(_INTERRUPTED)
