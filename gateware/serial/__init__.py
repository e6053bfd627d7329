"""Serial lines.

====== ========================================================================
module contents
====== ========================================================================
uart   asynchronous line: receiver and transmitter of bytes
spi    synchronous, mode 3: one 16-bit frame per command
====== ========================================================================
"""
