"""Platforms for which a native FMU can be made."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Platform:
    """A platform on which machine code runs.

    Attributes
    ----------
    folder : name of an FMU's folder of binaries in FMI 2.0
    suffix : suffix of a shared library
    triple : LLVM's name of the platform
    cpu : oldest supported processor
    fast : processor of a second, faster code, selected when the library is loaded; empty for none
    zig : name of the platform for ``zig cc -target``
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
"""Supported platforms by folder. FMI 2.0 names no folder for ARM, so the last has the name of FMI 3.0."""
