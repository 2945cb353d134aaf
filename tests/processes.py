"""Commands of the product that a test starts and interrupts."""

from __future__ import annotations

import signal
import subprocess
from typing import Any


def interruptible(words: list[Any], **options: Any) -> subprocess.Popen:
    """Start a command that Ctrl+C ends, as a person's terminal does, and that may be read."""
    return subprocess.Popen(
        words,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Tests that run in the background inherit an ignored SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        **options,
    )
