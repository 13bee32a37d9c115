"""The option ``--fillets`` of the verbs that take stresses from fine sub-models of throws."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from cranktrain.core.errors import InputError

if TYPE_CHECKING:
    from cranktrain.engine.model import Engine
    from cranktrain.structure.stress.stress_modes import ShapedCrank
    from cranktrain.structure.stress.sub_model import FilletModes


def fillet_help(what: str) -> str:
    """Help of the option ``--fillets``, which begins with its purpose ``what``."""
    return (
        f"{what} by fine sub-models of these throws: all, or numbers such as 1,6; minutes and 3 to 4 GB the first "
        "time, then kept"
    )


def chosen_throws(fillets: str | None, mesh: str | Path | None, engine: Engine) -> list[int]:
    """Throws whose fillets were requested; ``InputError`` for a throw that does not exist."""
    if fillets is None:
        return []
    if mesh is not None:
        raise InputError("--fillets meshes throws by the engine file's dimensions; leave out --mesh")
    words = [str(k + 1) for k in range(len(engine.crankshaft.throw_angles))]
    chosen = words if fillets == "all" else [word.strip() for word in fillets.split(",")]
    for word in chosen:
        if word not in words:
            raise InputError(f"--fillets '{word}' is not a throw; engine '{engine.name}' has 1 to {len(words)}, or all")
    return sorted({int(word) for word in chosen})


def fillets_of(
    engine: Engine, throws: list[int], shaped: Callable[[], ShapedCrank], say: Callable[[str], None]
) -> list[FilletModes]:
    """Fillets and oil bores of throws, computed or read from the cache.

    To be called before runs, because the crankshaft in the cache may be made anew.
    """
    from cranktrain.structure.stress.kept_fillets import throw_fillets

    return [fine for throw in throws for fine in throw_fillets(engine, throw, shaped, say)]
