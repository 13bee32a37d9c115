"""Rough surfaces of a plain bearing in engineering units: roughness, asperities, contact modulus, hardness, friction.

Greenwood and Tripp's contact needs the products ηβσ and σ/β. A measured profile gives either these products, or the
density η of the asperities and the radius β of their tips. Both forms are accepted:

    σ/β = roughness / radius,    ηβσ = density · radius · roughness

Missing values are those of the engine files (:class:`cranktrain.engine.parts.PlainBearing`).
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

from cranktrain.core.errors import InputError, within
from cranktrain.core.reduced_body import Array
from cranktrain.engine.parts import PlainBearing
from cranktrain.film.contact.asperity import contact_constants
from cranktrain.film.reynolds.rough_gap import Roughness

BOUNDS = {
    "roughness_um": (1e-3, 1e3, "um"),
    "roughness_pattern": (
        1.0 / 9.0,
        9.0,
        "length over width; flow factors are published for 1/9 to 9",
    ),
    "asperity_factor": (1e-4, 0.99, "eta beta sigma; usual surfaces have 0.03 to 0.05"),
    "asperity_ratio": (1e-6, 0.99, "sigma over the tips' radius; usual surfaces have 0.0001 to 0.01"),
    "asperity_density": (1.0, 1e9, "1/mm^2"),
    "asperity_radius_um": (1e-2, 1e6, "um"),
    "contact_modulus_gpa": (1e-3, 1e4, "GPa; steel on a steel-backed lining has 40 to 110"),
    "hardness_mpa": (1e-1, 1e5, "MPa; linings have 100 to 600"),
    "boundary_friction": (0.0, 1.0, "of the contact pressure"),
    "boundary_shear_mpa": (0.0, 1e4, "MPa"),
}
"""Lowest and highest value of each field, and explanation in the error message."""
EITHER = (("asperity_factor", "asperity_density"), ("asperity_ratio", "asperity_radius_um"))
"""Pairs of alternative fields for the same property."""


@dataclass(frozen=True, kw_only=True)
class Surfaces:
    """Combined surfaces of journal and bore, smooth without ``roughness_um``; None is the engine files' default.

    Attributes
    ----------
    roughness_um : σ, standard deviation of the combined heights of both surfaces
    roughness_pattern : Peklenik's γ; 1 isotropic, above 1 stretched along the motion, below 1 across it
    asperity_factor or asperity_density : ηβσ, or η in 1/mm²
    asperity_ratio or asperity_radius_um : σ/β, or the radius β of the tips
    contact_modulus_gpa : E' = 1/((1 − ν₁²)/E₁ + (1 − ν₂²)/E₂)
    hardness_mpa : hardness of the softer surface, the limit of the contact pressure
    boundary_friction : coefficient of friction of the asperities
    boundary_shear_mpa : additional shear stress on the real contact area
    """

    roughness_um: float | None = None
    roughness_pattern: float | None = None
    asperity_factor: float | None = None
    asperity_density: float | None = None
    asperity_ratio: float | None = None
    asperity_radius_um: float | None = None
    contact_modulus_gpa: float | None = None
    hardness_mpa: float | None = None
    boundary_friction: float | None = None
    boundary_shear_mpa: float | None = None

    def check_surfaces(self, label: Callable[[str], str]) -> None:
        """Raise ``InputError`` for invalid values; ``label`` gives the user's name of a field."""
        for name, (low, high, what) in BOUNDS.items():
            value = getattr(self, name)
            if value is not None:
                within(label(name), value, low, high, what)
                if self.roughness_um is None:
                    raise InputError(f"{label(name)} needs {label('roughness_um')}: smooth surfaces do not touch")
        for one, other in EITHER:
            if getattr(self, one) is not None and getattr(self, other) is not None:
                raise InputError(f"{label(other)} does not go with {label(one)}: both say the same, give one")
        if self.roughness_um is None:
            return
        factor, ratio = self.asperities()
        for (name, same), value in zip(EITHER, (factor, ratio), strict=True):
            low, high, what = BOUNDS[name]
            given = name if getattr(self, name) is not None else same
            if not low <= value <= high:
                raise InputError(
                    f"{label(given)} and the rest give {what.split(';')[0]} of {value:.4g}, outside {low:g} to {high:g}"
                )

    def asperities(self) -> tuple[float, float]:
        """Return ηβσ and σ/β of rough surfaces."""
        assert self.roughness_um is not None
        sigma = 1e-6 * self.roughness_um
        ratio = _given(self.asperity_ratio, "asperity_ratio")
        if self.asperity_radius_um is not None:
            ratio = self.roughness_um / self.asperity_radius_um
        factor = _given(self.asperity_factor, "asperity_factor")
        if self.asperity_density is not None:
            factor = 1e6 * self.asperity_density * sigma / ratio * sigma
        return factor, ratio

    def rough(self) -> tuple[Roughness | None, Array | None]:
        """Return the roughness for the flow, and the contact constants of :mod:`cranktrain.film.contact.asperity`."""
        if self.roughness_um is None:
            return None, None
        factor, ratio = self.asperities()
        contact = contact_constants(
            1e-6 * self.roughness_um, factor, ratio,
            _given(self.contact_modulus_gpa, "contact_modulus", 1e9),
            _given(self.boundary_friction, "boundary_friction"),
            _given(self.boundary_shear_mpa, "boundary_shear", 1e6),
            _given(self.hardness_mpa, "hardness", 1e6),
        )  # fmt: skip
        return Roughness(1e-6 * self.roughness_um, self.roughness_pattern or 1.0), contact


SURFACES = tuple(field.name for field in fields(Surfaces))
_USUAL: dict[str, Any] = {field.name: field.default for field in fields(PlainBearing)}


def _given(value: float | None, name: str, unit: float = 1.0) -> float:
    """Return a value converted from ``unit``, or the default of the engine files if it is None."""
    return float(_USUAL[name]) if value is None else unit * value
