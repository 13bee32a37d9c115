"""Platforms that a native FMU can be made for."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Platform:
    """Where machine code is to run.

    Attributes
    ----------
    folder : of an FMU's binaries, as FMI 2.0 names it
    suffix : of a shared library
    triple : as LLVM names the platform
    cpu : least processor
    fast : processor of a second, faster code, chosen where the library is loaded; empty for none
    zig : as ``zig cc -target`` names it
    """

    folder: str
    suffix: str
    triple: str
    cpu: str
    fast: str
    zig: str


PLATFORMS = {
    row.folder: row
    for row in (
        Platform("linux64", ".so", "x86_64-unknown-linux-gnu", "x86-64-v2", "x86-64-v3", "x86_64-linux-gnu.2.17"),
        Platform("win64", ".dll", "x86_64-w64-windows-gnu", "x86-64-v2", "x86-64-v3", "x86_64-windows-gnu"),
        Platform("aarch64-linux", ".so", "aarch64-unknown-linux-gnu", "generic", "", "aarch64-linux-gnu.2.17"),
    )
}
"""FMI 2.0 names no folder for ARM; the last is FMI 3.0's."""
