"""What takes a core into a design: texts, a bench, AXI."""
