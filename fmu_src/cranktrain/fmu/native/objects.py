"""Object files of a program of kernels, for any platform that LLVM supports, without numba.

``python -m cranktrain.fmu.native.objects PROGRAM PLATFORM OBJECT [fast]`` writes one.
"""

import sys
from pathlib import Path

import llvmlite.binding as llvm

from cranktrain.fmu.native.platforms import PLATFORMS, Platform

FAST = "_fast"
"""Suffix of the names of exported functions compiled for a platform's faster processors."""


def object_code(program: bytes, platform: Platform, fast: bool = False) -> bytes:
    """Object file of a program in LLVM bitcode for a platform; the layout of data is the same on all platforms.

    Parameters
    ----------
    program : result of :meth:`cranktrain.fmu.native.emit.Emission.program`
    fast : True for the platform's faster processors, False for all
    """
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(platform.triple).create_target_machine(
        cpu=platform.fast if fast else platform.cpu, opt=3, reloc="pic", codemodel="default"
    )
    module = llvm.parse_bitcode(program)
    module.triple, module.data_layout = platform.triple, str(machine.target_data)
    if fast:
        for function in list(module.functions):
            if not function.is_declaration and function.linkage == llvm.Linkage.external:
                function.name += FAST
    return bytes(machine.emit_object(module))


if __name__ == "__main__":
    program, folder, target, *fast = sys.argv[1:]
    Path(target).write_bytes(object_code(Path(program).read_bytes(), PLATFORMS[folder], bool(fast)))
