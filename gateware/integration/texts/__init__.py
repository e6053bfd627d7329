"""Templates of the files beside a core (`gateware.integration.files`)."""
