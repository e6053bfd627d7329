"""The board's bench under cocotb: the same run, heard by Python."""
