"""Simulated bench, the world that the procedures measure. It makes data; it never judges them.

Simulated
---------
* A three-axis table (MuJoCo bodies and servo): moves within rate and acceleration limits, settling, lock; axes that
  are not quite square, a base that is not quite level, an azimuth that is not quite the declared one, pointing
  errors, axis wobble; whole turns of one axis at a constant rate, while the unit is recorded.
* A unit of three gyros and three accelerometers: biases, a full 3×3 matrix a triad, asymmetry and a quadratic term,
  run-to-run changes, start-up transient, self-heating, residue of the mechanical dither, angle random walk, bias
  instability, rate random walk, ramp, and a dithered integer counter whose phase is carried from the moment of
  power-up.
* A thermal chamber (plant, controller, limiter, door, named faults) and the heat of the unit in it, which its power
  brings too: accelerometer bias and scale, the signal converter, a gyro's perimeter control at fault, and the unit's
  own temperature sensors with lag, offset, noise, steps and faults. Temperatures go in whole seconds: what a second's
  end made of outputs and sensors holds until the next one's.
* An operator who sets the unit by hand when asked, in minutes, in a seat that leans a little, differently each time.
* A supply, and a clock: time passes only in ``clock.sleep`` and while a recording is read.

Stated choices
--------------
* A job that reads no temperatures finds a unit that the laboratory has let warm through: it stands at its reference
  temperature, the bench is opened without a chamber, and its truth (`launch_truth`) is that of the triads alone. Only a
  job whose stations read temperatures opens the chamber; then the same triads drift with the temperatures of their
  parts. A self-heating that a triad's truth may have besides is a function of time since power-up and comes on top.
* `make_safe` sends the chamber to ambient and returns at once; the air would go there as bench time passes. After it
  no bench time passes: the job is over, and the next one opens a world at its beginning, with everything at ambient.
* The unit in the chamber's seat hangs on the table's kinematics: a setting by hand puts the axes at their angles, and
  its lean stays through later moves of the table, until the next setting.

Not simulated
-------------
Temperature's part in run-to-run changes, cross terms and noise, gradients inside a lump of heat, humidity, vibration
(the chamber's fan included), cogging, encoder steps, structural modes, supply noise, cross-axis acceleration terms,
lever arms (the accelerometers stand where the three axes meet), latency and loss of data. Inertias are invented. The
table is an ideal servo: how it settles says nothing of a real one.

How truthful
------------
The true attitude is known to about 1e-15 rad and the specific force at rest to about 1e-14 m/s²; the noise follows
IEEE Std 952 definitions, each process by itself. Nothing here imports the analysis that judges the data, nor its
geometry: both know only the conventions written in `procedures`, and a third witness, numbers worked by hand, stands
in the tests. Every random number is keyed by (seed, launch, channel, process, block), so the same seed gives the same
bytes in whatever pieces they are read, and after a resume from a checkpoint.

Layers: ``world`` > ``turntable`` | ``imu`` | ``supply`` | ``chamber`` | ``operator`` > ``clock`` | ``truth``. The door
is `simulators.world.build`.
"""
