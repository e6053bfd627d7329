"""The simulated world: motions of a platform, and the sensors that watch them.

`motion` gives exact attitudes, rates and accelerations of three stacked rotary stages, `triad` what
a three-axis sensor makes of a true vector, `devices` the two devices of Ma Long et al. (2014) with
what is known about them, `recording` a log of both together. Everything random has a seed.
"""
