"""Area of a core on a part, and its clock: routed with open tools, or estimated on Spartan-6."""
