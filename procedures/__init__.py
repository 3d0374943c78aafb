"""The domain of testing inertial units. No HTTP, SQL, MuJoCo, files, real clock or random generator.

Conventions
-----------
Frames (right-handed; a vector in frame *a* ends in ``_a``; ``rot_ab`` takes components from *b* to *a*):

* ``n``: local level, **north, up, east** (NUE): x north, y along the plumb line upwards, z east.
* ``r``: reference, the attitude of the unit when every table angle is zero: ``n`` turned about up
  by the azimuth, so that x points at the azimuth (clockwise from north), **y up**, z to the right.
* ``b``: the unit's own orthogonal axes, x forward, y up, z right in the zero orientation.

Table: the outer axis is vertical, the middle axis is z of the reference frame, the inner axis is x of the unit.
``rot_rb = R_y(outer) · R_z(middle) · R_x(inner)``, every angle positive by the right-hand rule about its axis.
The thesis writes an orientation as (β, γ): β = inner, γ = middle ("β about x after γ about z").

Signs: a unit at rest with y up measures **specific force +g** along y (it reads the support's reaction),
and the Earth's angular velocity ``Ω·[cos L, sin L, 0]`` in ``n`` at latitude L (north positive).

Units: SI inside (rad, rad/s, m/s², s); °C is the one exception. Public fields carry the unit in the name
(``_s _hz _c _deg _arcsec _rad _rad_s _m_s2``); a standard uncertainty ends in ``_sd``. People read deg/h,
deg/√h, arcsec, µg, ppm: conversions live in ``core.units`` and nowhere else.

Shapes: one vector is (3,), many are (n, 3); samples are (n, channels), time first.

Glossary
--------
procedure (the recipe), station (one orientation and/or temperature in it), job (one execution of a procedure on one
unit on one bench), recording (raw samples of one stretch), result (outcome of the analysis), check (one value against
one limit), verdict (all checks), unit (the device under test, by serial), bench (table + chamber + supply + data
link), calibration (a set of coefficients of a unit with its lineage), launch (one power-up of the unit).

Where does it live?
-------------------
One device's behaviour: its driver or its simulated plant. An order of things over several devices: a
procedure (``catalog``). Arithmetic on recordings: ``analysis``. Its tables and figures: ``reports``. A
question asked of recordings already taken: ``methods``. Remembering: ``bench_service.persistence``. When and
whether: ``bench_service.jobs``.
"""
