"""One file for each verb of the command line: the Python function and its text form."""
