"""``python -m cromosim`` is the command line."""

import os
import shutil
import sys


def main() -> int:
    """Replace this process by the program ``cromosim``; 2 where there is none."""
    program = os.environ.get("CROMOSIM_BINARY") or shutil.which("cromosim")
    if program is None or not os.access(program, os.X_OK):
        print(
            "error: no program `cromosim` on the path; `cargo install --path .` in the repository "
            "puts it there, or name it in CROMOSIM_BINARY",
            file=sys.stderr,
        )
        return 2
    os.execv(program, ["cromosim", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
