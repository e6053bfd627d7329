"""Bundled logs, as files of this package; read them through `boresight.sim.records.files`."""
