"""THE WORLD: a bench in software. It makes data; it never judges them.

Simulated
---------
* A three-axis table (MuJoCo bodies and servo): moves within rate and acceleration limits, settling, lock; axes that
  are not quite square, a base that is not quite level, an azimuth that is not quite the declared one, pointing
  errors, axis wobble; whole turns of one axis at a constant rate, while the unit is recorded.
* A unit of three gyros and three accelerometers: biases, a full 3×3 matrix a triad, asymmetry and a quadratic term,
  run-to-run changes, start-up transient, self-heating, residue of the mechanical dither, angle random walk, bias
  instability, rate random walk, ramp, and a dithered integer counter whose phase is carried from the moment of
  power-up.
* A supply, and a clock: time passes only in ``clock.sleep`` and while a recording is read.

Not simulated
-------------
Temperature on the bench (the physics of a chamber and of the unit in it are in `chamber`, not wired to the world yet),
vibration, cogging, encoder steps, structural modes, supply noise, cross-axis acceleration terms, lever arms (the
accelerometers stand where the three axes meet), latency and loss of data. Inertias are invented. The table is an ideal
servo: how it settles says nothing of a real one.

How truthful
------------
The true attitude is known to about 1e-15 rad and the specific force at rest to about 1e-14 m/s²; the noise follows
IEEE Std 952 definitions, each process by itself. Nothing here imports the analysis that judges the data, nor its
geometry: both know only the conventions written in `procedures`, and a third witness, numbers worked by hand, stands
in the tests. Every random number is keyed by (seed, launch, channel, process, block), so the same seed gives the same
bytes in whatever pieces they are read, and after a resume from a checkpoint.

Layers: ``world`` > ``turntable`` | ``imu`` | ``supply`` | ``chamber`` > ``clock`` | ``truth``. The door is
`simulators.world.build`.
"""
