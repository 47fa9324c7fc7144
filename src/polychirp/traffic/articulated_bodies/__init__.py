"""Bodies whose parts move: people, and two-wheelers with riders, as ellipsoids and rods.

The modules in reading order, each with the names that other packages may use:

- `gait`: joints of a walking person over the cycle of two steps: `Gait`, `STANDING`.
- `person`: a person of ellipsoids, placed by the joints: `person`, `leg_length`.
- `rider`: a person who sits, with hands and feet at given places: `rider`.
- `tubes`: tubes, rims and spokes as rods: `Tube`, `Spokes`.
- `two_wheelers`: bicycle and motorcycle with riders: `BicycleRide`, `MotorcycleRide`.
"""
