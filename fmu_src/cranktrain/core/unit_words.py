"""Unit symbols as engineers write them, translated to those of pint.

Each line of ``_TABLE`` has pint's expression and its spellings. Plane angles have units of their own here, because pint
treats the radian as a number.
"""

import math

_ALIKE = (
    "m mm cm dm km um nm kg g mg N kN MN mN s ms us Pa hPa kPa MPa GPa mPa bar mbar psi ksi J kJ MJ mJ W kW MW mW Hz "
    "kHz K slug kip dyn torr mmHg inHg V mV A ft yd h lbf ozf kgf atm Btu cal kcal Wh kWh ppm ohm"
)
_TABLE = """
inch               | in inch inches Zoll zoll "
thou               | mil thou
foot               | feet
tonne              | t to
pound              | lb lbs lbm
ounce              | oz
kgf                | kp
poundal            | pdl
second             | sec
minute             | min
hour               | hr std
day                | d
plane_radian       | rad radian radians
milliplane_radian  | mrad
microplane_radian  | urad
plane_degree       | deg degree degrees Grad grad Deg DEG
milliplane_degree  | mdeg
plane_turn         | rev revs revolution revolutions U Umdr Umdrehung Umdrehungen r turn turns tr giri
(plane_turn/minute) | rpm upm Upm UPM RPM
(plane_turn/second) | rps
(plane_turn/400)   | gon
(plane_degree/60)  | arcmin
(plane_degree/3600) | arcsec
technical_atmosphere | at
torr               | Torr
(lbf/foot**2)      | psf
poise              | P
centipoise         | cP cp cPs
stokes             | St
centistokes        | cSt cst
horsepower         | hp HP bhp
metric_horsepower  | PS ps cv CV
liter              | l L
milliliter         | ml mL
centiliter         | cl
cm**3              | cc ccm
Btu                | BTU
percent            | %
permille           | ‰
(mile/hour)        | mph
(km/hour)          | kmh kph
(foot/second)      | fps
(inch/second)      | ips
(1/minute)         | cpm CPM
(N*m)              | Nm NM
(kN*m)             | kNm KNm
(MN*m)             | MNm
(mN*m)             | mNm
(N*mm)             | Nmm
(kN*mm)            | kNmm
(10*N)             | daN
(10*N*m)           | daNm
psi                | PSI Psi
bar                | BAR Bar
mm                 | MM
m                  | M
kg                 | KG Kg
kN                 | KN Kn
kW                 | KW Kw
kPa                | KPA KPa Kpa
MPa                | MPA Mpa
GPa                | GPA Gpa
Hz                 | HZ hz
(centimeter_H2O/10) | mmHtO
inch_H2O           | inHtO
"""
WORDS = {word: word for word in _ALIKE.split()}
for _line in _TABLE.strip().splitlines():
    _pint, _spellings = _line.split("|")
    WORDS.update(dict.fromkeys(_spellings.split(), _pint.strip()))
"""Pint's expression for each spelling."""
DOUBTFUL = frozenset(("gr",))
"""Words with two meanings, which are refused: pint reads gr as grain, others as gram."""
PARTS = sorted(
    (word for word in WORDS if word.isalpha() and word not in ("r", "d", "U", "M", "tr", "giri")), key=len, reverse=True
)
"""Symbols that may be joined without a sign between them, as in kNm or mPas, the longest first."""
ANGLES = (
    "plane_radian = [angle]",
    f"plane_turn = {2.0 * math.pi!r} * plane_radian",
    "plane_degree = plane_turn / 360",
)
"""Definitions of plane angles for pint."""
FORCES = {"pound": "lbf", "kg": "kgf", "g": "gram_force", "ounce": "ozf", "tonne": "(1000*kgf)"}
"""Mass units that mean forces if only a force has the wanted dimension."""
BASES = {
    "kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K", "mole": "mol", "candela": "cd",
    "plane_radian": "rad",
}  # fmt: skip
"""Pint's base units and their symbols."""
SIGNS = {
    "µ": "u", "μ": "u", "·": "*", "⋅": "*", "∙": "*", "•": "*", "×": "*", "−": "-", "–": "-", "÷": "/", "∕": "/",
    "⁄": "/", "″": '"', "”": '"', "º": "°", "²": "^2", "³": "^3", "⁴": "^4", "⁻¹": "^-1", "⁻²": "^-2", "⁻³": "^-3",
    "**": "^", "㎜": "mm", "Ω": "ohm", "\u00a0": " ", "\u202f": " ", "\u2009": " ",
}  # fmt: skip
"""Typographic symbols and their ASCII spelling."""
KELVINS = {
    "°c": "degC", "c": "degC", "degc": "degC", "celsius": "degC", "deg c": "degC", "grad c": "degC", "°f": "degF",
    "f": "degF", "degf": "degF", "fahrenheit": "degF", "deg f": "degF", "k": "kelvin", "°k": "kelvin",
    "kelvin": "kelvin", "degk": "kelvin", "deg k": "kelvin", "°r": "degR", "degr": "degR", "rankine": "degR",
}  # fmt: skip
"""Spellings of temperature units, in small letters, and pint's names."""
