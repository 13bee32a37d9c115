"""Child process for netgen's CAD kernel, which can crash its process on degenerate input."""

import ctypes
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

PR_SET_PDEATHSIG = 1


def run_in_child(code: str, values: Any, target: Path, seconds: float) -> str | None:
    """Run ``code`` in a child process that ends with this process. Return how it failed, or None if it wrote its file.

    Parameters
    ----------
    code : the line; its ``sys.argv[1]`` is the file to write, its stdin ``values`` as JSON
    seconds : time limit
    """
    package_root = str(Path(__file__).resolve().parents[3])
    paths = [package_root, *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    begin = f"import sys; from {__name__} import die_with; die_with(int(sys.argv[2])); "
    try:
        child = subprocess.run(
            [sys.executable, "-c", begin + code, str(target), str(os.getpid())],
            input=json.dumps(values),
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))},
            capture_output=True,
            text=True,
            errors="replace",
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"took longer than {seconds:.0f} s"
    if child.returncode or not target.exists():
        last = (child.stderr.strip().splitlines() or ["no message"])[-1]
        ended = f"signal {-child.returncode}" if child.returncode < 0 else f"code {child.returncode}"
        return f"{ended}: {last}"
    return None


def die_with(parent: int) -> None:
    """End this process when its parent ends for any reason: by the system on Linux, else by a check every second."""
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    elif hasattr(os, "getppid"):

        def watch() -> None:
            while os.getppid() == parent:
                time.sleep(1.0)
            os._exit(1)

        threading.Thread(target=watch, daemon=True).start()
    if os.getppid() != parent:  # the parent ended before this function was called
        os._exit(1)
