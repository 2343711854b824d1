"""Where the command line and the repository's files are."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[4]


def binary() -> str | None:
    """The command line to compare with: $CROMOSIM_BINARY, else one on the path."""
    return os.environ.get("CROMOSIM_BINARY") or shutil.which("cromosim")


@pytest.fixture
def command_line():
    """Runs `cromosim ARGUMENTS`, which must succeed; skips without a built one."""
    found = binary()
    if found is None:
        message = "no command line to compare with; name it in CROMOSIM_BINARY"
        if os.environ.get("CROMOSIM_REQUIRE_ALL"):
            pytest.fail(message)
        pytest.skip(message)

    def run(*arguments: object) -> str:
        command = [found, *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run
