"""The tests of Ma Long, Zhang Rui and Su Zhigang (2014), in simulation."""
