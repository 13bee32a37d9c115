"""Pages in headless Chromium: what its console says, what it drew, and how the document stands afterwards."""

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FOUND = next((path for path in map(shutil.which, NAMES) if path), None)
needs_browser = pytest.mark.skipif(FOUND is None, reason="no Chromium is installed")


def shown(page: Path, width: int, height: int = 800, budget_ms: int = 2000) -> tuple[str, list[str], bytes]:
    """Document after its scripts ran, lines of the console, and a picture (PNG) of a page in a window."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "page.png"
        command = [
            FOUND, "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
            "--hide-scrollbars", "--enable-logging=stderr", f"--user-data-dir={folder}/profile",
            f"--window-size={width},{height}", f"--virtual-time-budget={budget_ms}",
            "--dump-dom", f"--screenshot={picture}",
        ]  # fmt: skip
        environment = {**os.environ, "HOME": folder}
        command.append(page.resolve().as_uri())
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True, env=environment)
        console = [line for line in done.stderr.splitlines() if re.search(r"[:.]CONSOLE", line)]
        return done.stdout, console, picture.read_bytes()
