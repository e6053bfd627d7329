"""Settings of the gateware tests."""


def pytest_configure(config):
    # A component that its constructor refuses, or that is only asked for its figures, is never
    # elaborated.
    config.addinivalue_line("filterwarnings", "ignore::amaranth.hdl.UnusedElaboratable")
