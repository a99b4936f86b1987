"""python -m marrow: the command line."""

import os
import shutil
import sys
from pathlib import Path
from typing import NoReturn


def main() -> NoReturn:
    """Replace this process by the program marrow: that of the wheel, or else the one in PATH.

    It is a program of its own because it draws pictures with VTK: another VTK may be loaded in this process.
    """
    program = Path(__file__).parent / "bin" / "marrow"
    path = str(program) if program.exists() else shutil.which("marrow")
    if path is None:
        sys.exit("marrow: the program is not installed; install Debian's package marrow, or a wheel that holds it")
    os.execv(path, ["marrow", *sys.argv[1:]])


if __name__ == "__main__":
    main()
